"""Files that are read as a whole, and written completely or not at all."""

from __future__ import annotations

import contextlib
import os
import re
import reprlib
import time
import uuid
from collections.abc import Iterable
from pathlib import Path

from firstfix.core.errors import InputError

_DRAFT = re.compile(r"\.[0-9a-f]{32}\.draft")
# Writing never takes so long, s: an older draft is left from a process that was killed.
_ABANDONED_AFTER_S = 3600.0


def read_bytes(path: Path, *, what: str, limit: int) -> bytes:
    """Read a regular file of bounded size.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What it should be, such as ``"a saved pose"``.
    limit : int
        Greatest size, bytes.

    Returns
    -------
    bytes
        All of it.

    Raises
    ------
    InputError
        If it is no regular file, cannot be read or is larger.
    """
    check_is_file(path, what)
    try:
        with path.open("rb") as file:
            data = file.read(limit + 1)
    except OSError as error:
        raise unreachable(path, error) from error
    if len(data) > limit:
        raise InputError(
            expected=f"{what} of at most {limit} bytes",
            received=f"a larger file, {path}",
            remedy="check that it is the right file, and that the paths are in the right order",
        )
    return data


def is_file(path: Path) -> bool:
    """Return whether this is a regular file; reading a pipe or a device may never end."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # names that no file system can hold
        return False


def show(value: object) -> str:
    """Return a short printable form of any content of a file."""
    shortener = reprlib.Repr()
    shortener.maxstring = shortener.maxother = 100
    return shortener.repr(value)


def check_is_file(path: Path, what: str) -> None:
    """Check that this is a regular file.

    Raises
    ------
    InputError
        If there is no such file, or it is a folder, pipe or device.
    """
    if not is_file(path):
        raise InputError(
            expected=what,
            received=f"no file {show(str(path))}",
            remedy="check the path",
        )


def replace_file(path: Path, pieces: Iterable[bytes]) -> None:
    """Write a file atomically: readers see the complete old one or the complete new one.

    This holds after a power cut, too. Of several writers at once, the last one counts.

    Parameters
    ----------
    path : Path
        An existing file is replaced; a symbolic link is followed. The folder must exist.
    pieces : iterable of bytes
        The content, in order.

    Raises
    ------
    InputError
        If it cannot be written; an old file is then unchanged.
    """
    try:
        target = path.resolve()
        if target.exists() and not target.is_file():  # do not replace a device
            raise InputError(
                expected="the path of a file to write",
                received=f"{path}, which is a folder or a device",
                remedy="give the name of a file",
            )
        write_whole(target, pieces)
    except OSError as error:
        raise unreachable(path, error) from error
    except (ValueError, RuntimeError) as error:  # names that no file system holds, links in a ring
        raise InputError(
            expected="the path of a file to write",
            received=show(str(path)),
            remedy="give another name",
        ) from error


def write_whole(target: Path, pieces: Iterable[bytes | memoryview]) -> None:
    """Write a draft and rename it; raises OSError, and then nothing changed.

    Parameters
    ----------
    target : Path
        The file, not a link to it.
    pieces : iterable of bytes
        The content, in order.
    """
    # Renaming is atomic only within one folder, and no other process may use the name.
    draft = target.with_name(f".{uuid.uuid4().hex}.draft")
    try:
        with draft.open("xb") as file:
            file.writelines(pieces)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(target)
    finally:
        draft.unlink(missing_ok=True)
    _remove_abandoned(target.parent)
    with contextlib.suppress(OSError):  # not on every file system; the content is already safe
        folder = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _remove_abandoned(folder: Path) -> None:
    """Remove drafts of killed processes; a robot that is often switched off leaves many."""
    with contextlib.suppress(OSError):
        for path in folder.iterdir():
            is_draft = _DRAFT.fullmatch(path.name) is not None
            if is_draft and time.time() - path.lstat().st_mtime > _ABANDONED_AFTER_S:
                path.unlink(missing_ok=True)


def remove_file(path: Path) -> None:
    """Remove a file if it exists; raises InputError if that is impossible."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise unreachable(path, error) from error
    except ValueError:  # a name that no file system can hold
        return


def unreachable(path: Path, error: OSError) -> InputError:
    """Return the error for a file that cannot be opened, read or written."""
    return InputError(
        expected=f"access to {show(str(path))}",
        received=error.strerror or type(error).__name__,
        remedy="check the folder and its permissions",
    )
