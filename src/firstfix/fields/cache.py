"""Arrays that are expensive to build, kept on disk between runs.

The cache never changes a result: a file that cannot be read is built again, and a failed write is
ignored. One file in the format .npy holds the array of one key, followed by the CRC-32 of all that,
which detects damage. Arrays are mapped into memory: processes share them, and the system can drop
what is not in use.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import mmap
import os
import tempfile
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

MAX_TOTAL_BYTES = 2 << 30
"""Default size of a cache folder above which the least recently used files are removed."""

_SUFFIX, _TEMPORARY = ".fields", ".partial"
_PLAIN_KINDS = "biufc"  # never objects, which are pickles
_CRC_BYTES = 4


def cache_folder() -> Path:
    """Return the folder of the cache: ``FIRSTFIX_CACHE_DIR``, or the user's cache folder."""
    import platformdirs

    named = os.environ.get("FIRSTFIX_CACHE_DIR")
    return Path(named or platformdirs.user_cache_dir("firstfix", appauthor=False))


def content_key(*parts: bytes | str | NDArray[Any]) -> str:
    """Return a key for everything that a cached array depends on.

    Parameters
    ----------
    *parts : bytes, str or ndarray
        Content; of arrays also the dtype and shape count. Include the version of the algorithm.

    Returns
    -------
    str
        32 hexadecimal digits (BLAKE2b).
    """
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        if isinstance(part, np.ndarray):
            _check_plain(part)
            kind = f"{part.dtype.str}{part.shape}"
            content = np.ascontiguousarray(part).reshape(-1).view(np.uint8).data
        elif isinstance(part, str):
            kind, content = "str", memoryview(part.encode())
        else:
            kind, content = "bytes", memoryview(part)
        # The length separates ("ab", "c") from ("a", "bc").
        digest.update(f"{kind} {content.nbytes}\n".encode())
        digest.update(content)
    return digest.hexdigest()


def load_or_build(
    key: str,
    build: Callable[[], NDArray[Any]],
    folder: Path,
    limit: int | None = MAX_TOTAL_BYTES,
) -> NDArray[Any]:
    """Load an array from the cache, or build and store it.

    Processes may share a folder: files are replaced atomically.

    Parameters
    ----------
    key : str
        What the array depends on, from `content_key`.
    build : callable
        Builds the array; called only if there is no valid file for this key.
    folder : Path
        The cache, such as `cache_folder`; created if missing.
    limit : int or None
        Size of the folder above which the least recently used files are removed, bytes; None for
        a folder without limit.

    Returns
    -------
    ndarray
        Read-only.
    """
    if not (key.isascii() and key.isalnum()):
        raise ValueError(f"a key consists of letters and digits, unlike {key!r}: see content_key")
    path = folder / f"{key}{_SUFFIX}"
    array = _load(path)
    if array is None:
        array = build().view()
        _check_plain(array)
        with contextlib.suppress(OSError):  # a full or read-only disk
            _store(path, array, limit)
            stored = _load(path)
            array = array if stored is None else stored
    array.flags.writeable = False
    return array


def _load(path: Path) -> NDArray[Any] | None:
    try:
        with path.open("rb") as file:
            content = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        array = _array_in(content)
        if hasattr(mmap, "MADV_DONTNEED"):  # the check has read all of it: keep what is used
            content.madvise(mmap.MADV_DONTNEED)
    except Exception:  # noqa: BLE001 - a damaged file raises nearly anything
        return None
    with contextlib.suppress(OSError):
        os.utime(path)  # used now: the last to be removed
    return array


def _array_in(content: mmap.mmap) -> NDArray[Any]:
    """Return the array in a file; raises nearly anything if it is damaged."""
    end = len(content) - _CRC_BYTES
    with memoryview(content) as whole, whole[:end] as sealed:
        if zlib.crc32(sealed) != int.from_bytes(content[end:], "little"):
            raise ValueError("damaged")
    version = np.lib.format.read_magic(content)
    if version != (1, 0):
        raise ValueError("another version of .npy")
    shape, is_fortran, dtype = np.lib.format.read_array_header_1_0(content)
    array = np.ndarray(shape, dtype, content, content.tell(), order="F" if is_fortran else "C")
    _check_plain(array)
    return array


def _store(path: Path, array: NDArray[Any], limit: int | None) -> None:
    if limit is not None and array.nbytes > limit:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, suffix=_TEMPORARY)
    try:
        with os.fdopen(descriptor, "wb") as file:
            _write(file, np.asarray(array, order="C"))
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    if limit is not None:
        _remove_least_used(path, limit)


def _write(file: BinaryIO, array: NDArray[Any]) -> None:
    start = io.BytesIO()
    np.lib.format.write_array_header_1_0(start, np.lib.format.header_data_from_array_1_0(array))
    data = array.reshape(-1).view(np.uint8).data
    file.writelines((start.getbuffer(), data))
    crc = zlib.crc32(data, zlib.crc32(start.getbuffer()))
    file.write(crc.to_bytes(_CRC_BYTES, "little"))


def remove_unused(folder: Path, days: float) -> None:
    """Remove the files of a cache that have not been read for some days."""
    oldest = time.time() - days * 86400.0
    with contextlib.suppress(OSError):
        for file in _files(folder):
            if file.stat().st_mtime < oldest:
                file.unlink(missing_ok=True)


def _files(folder: Path) -> list[Path]:
    """Return the files of a cache, also those of processes that were killed."""
    return [*folder.glob(f"*{_SUFFIX}"), *folder.glob(f"*{_TEMPORARY}")]


def _remove_least_used(newest: Path, limit: int) -> None:
    """Remove files until the rest fits."""
    used = {file: file.stat() for file in _files(newest.parent)}
    total = sum(status.st_size for status in used.values())
    for file in sorted(used, key=lambda file: (file == newest, used[file].st_mtime_ns)):
        if total <= limit:
            return
        file.unlink(missing_ok=True)
        total -= used[file].st_size


def _check_plain(array: NDArray[Any]) -> None:
    if array.dtype.kind not in _PLAIN_KINDS:
        raise TypeError(f"only arrays of numbers can be cached, not of {array.dtype}")
