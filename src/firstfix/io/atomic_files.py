"""Files that are read whole, or written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import re
import time
import uuid
from collections.abc import Iterable
from pathlib import Path

from firstfix.core.errors import InputError
from firstfix.io.maps.files import is_file, show

_DRAFT = re.compile(r"\.[0-9a-f]{32}\.draft")
# Nobody writes for so long, s: what is older was left by somebody who was killed while writing.
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
            remedy="check that it is the right file",
        )
    return data


def check_is_file(path: Path, what: str) -> None:
    """Refuse what is no regular file; a pipe or a device may never end.

    Raises
    ------
    InputError
        If there is no such file, or it is of another kind.
    """
    if not is_file(path):
        raise InputError(
            expected=what,
            received=f"no file {show(str(path))}",
            remedy="check the path",
        )


def replace_file(path: Path, pieces: Iterable[bytes]) -> None:
    """Write a file, so that whoever reads it meanwhile sees the old one or the new one, whole.

    A power cut leaves one of the two as well. Several may write at once; the last one counts.

    Parameters
    ----------
    path : Path
        Where to. An existing file is replaced, through a link if it is one; its folder must exist.
    pieces : iterable of bytes
        The content, in order.

    Raises
    ------
    InputError
        If it cannot be written; then the old file, if any, is as it was.
    """
    try:
        target = path.resolve()
        if target.exists() and not target.is_file():  # a device must not become a file
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
    """Write a draft and give it the name of the file; raises OSError, and then nothing changed.

    Parameters
    ----------
    target : Path
        The file itself, no link to it.
    pieces : iterable of bytes
        The content, in order.
    """
    # Renaming is atomic only within one folder, and the name must not be anybody else's.
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
    with contextlib.suppress(OSError):  # not every file system can; the content is safe already
        folder = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _remove_abandoned(folder: Path) -> None:
    """Remove drafts that nobody will finish; a robot that is switched off often leaves many."""
    with contextlib.suppress(OSError):
        for path in folder.iterdir():
            is_draft = _DRAFT.fullmatch(path.name) is not None
            if is_draft and time.time() - path.lstat().st_mtime > _ABANDONED_AFTER_S:
                path.unlink(missing_ok=True)


def remove_file(path: Path) -> None:
    """Remove a file, if there is one.

    Raises
    ------
    InputError
        If it stays there.
    """
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
