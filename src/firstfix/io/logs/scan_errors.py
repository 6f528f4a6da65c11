"""How the readers of recordings say no: always a ScanError, always with the place."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from firstfix.core.errors import InputError, ScanError

# A day of driving at 10 Hz. Each scan is an object of about 1 kB, however few beams it has, so
# a small file of tiny scans could otherwise fill the memory of a robot.
MAX_SCANS = 1_000_000


@contextmanager
def located(where: str) -> Iterator[None]:
    """Tell, in an error of the core types, which part of which file it is about.

    Parameters
    ----------
    where : str
        Such as ``"scan 3 of log.bag"``.

    Raises
    ------
    ScanError
        In place of any InputError from inside.
    """
    try:
        yield
    except InputError as error:
        if isinstance(error, ScanError) and where in error.received:
            raise  # it was told where it happened
        raise ScanError(
            expected=error.expected,
            received=f"{error.received} in {where}",
            remedy=error.remedy,
        ) from error


def unreadable(path: Path | str, kind: str, error: BaseException) -> ScanError:
    """Turn what a library found wrong with a file into one sentence.

    Parameters
    ----------
    path : Path or str
        The file, or another name for it.
    kind : str
        What it should have been, such as ``"an .npz archive"``.
    error : BaseException
        What the library raised.

    Returns
    -------
    ScanError
        To be raised.
    """
    told = " ".join(str(error).split())[:200] or type(error).__name__
    return ScanError(
        expected=f"{kind} that can be read",
        received=f"{path} ({told})",
        remedy="check that the file is complete and readable, or record it again",
    )


def check_max_scans(max_scans: int | None) -> int:
    """Return how many scans may be read at most.

    Parameters
    ----------
    max_scans : int or None
        What the caller asked for; None for all.

    Returns
    -------
    int
        A number from 1 to `MAX_SCANS`.

    Raises
    ------
    ScanError
        If it is less than one.
    """
    if max_scans is None:
        return MAX_SCANS
    if max_scans < 1:
        raise ScanError(
            expected="max_scans of at least 1",
            received=f"{max_scans}",
            remedy="leave it out to read every scan",
        )
    return min(max_scans, MAX_SCANS)


def too_many_scans(path: Path) -> ScanError:
    """Return the error for a log of more than `MAX_SCANS` scans."""
    return ScanError(
        expected=f"at most {MAX_SCANS} scans",
        received=f"more of them in {path}",
        remedy="set max_scans to read the first ones",
    )
