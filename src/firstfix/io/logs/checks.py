"""Limits, errors and notes that all readers of recordings share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError, ScanError

# A day of driving at 10 Hz. Each scan is an object of about 1 kB, however few beams it has, so
# a small file of tiny scans could otherwise fill the memory of a robot.
MAX_SCANS = 1_000_000

# The first scans of a log are the first by stamp, as if all scans had been read and sorted, unless
# one was recorded more than this number of scans too late.
SORTED_AHEAD = 100


@contextmanager
def located(where: str) -> Iterator[None]:
    """Turn an InputError from inside into a ScanError that names the part of the file.

    Parameters
    ----------
    where : str
        Such as ``"scan 3"`` or the path of the file.
    """
    try:
        yield
    except InputError as error:
        if isinstance(error, ScanError) and where in error.received:
            raise
        if not error.expected:
            raise ScanError(f"In {where}: {error}") from error
        raise ScanError(
            expected=error.expected,
            received=f"{error.received} in {where}",
            remedy=error.remedy,
        ) from error


def unreadable(path: Path | str, kind: str, error: BaseException) -> ScanError:
    """Return the error for a file that a library could not read.

    Parameters
    ----------
    path : Path or str
        The file, or another name for it.
    kind : str
        Such as ``"an .npz archive"``.
    error : BaseException
        The error of the library.
    """
    text = " ".join(str(error).split())[:200] or type(error).__name__
    return ScanError(
        expected=f"{kind} that can be read",
        received=f"{path} ({text})",
        remedy="check that the file is complete and readable, or record it again",
    )


def check_max_scans(max_scans: int | None) -> int:
    """Return how many scans to read at most, 1 to `MAX_SCANS`; None means all."""
    if max_scans is None:
        return MAX_SCANS
    if max_scans < 1:
        raise ScanError(
            expected="max_scans of at least 1",
            received=f"{max_scans}",
            remedy="leave it out to read every scan",
        )
    return min(max_scans, MAX_SCANS)


def check_count(count: int, max_scans: int | None, path: Path) -> None:
    """Reject a log of more than `MAX_SCANS` scans, if all of them are wanted."""
    if max_scans is None and count > MAX_SCANS:
        raise ScanError(
            expected=f"at most {MAX_SCANS} scans",
            received=f"more of them in {path}",
            remedy="set max_scans to read the first ones",
        )


def ascending(stamps: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the order that sorts stamps, shape (n,); equal stamps keep theirs."""
    return np.argsort(stamps, kind="stable")


def sorting_notes(order: NDArray[np.intp]) -> tuple[str, ...]:
    """Return a note if an order, shape (n,), is not that of the file."""
    steps_back = int(np.count_nonzero(np.diff(order) < 0))
    if not steps_back:
        return ()
    return (f"stamps step back {steps_back} time(s) in the file: scans were sorted by stamp",)
