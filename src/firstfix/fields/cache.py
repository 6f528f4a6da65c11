"""Arrays that are expensive to build, kept on disk between runs.

A cache must never be the reason for a wrong answer or for none: what cannot be read, or does not
check, is built again; what cannot be written is used all the same. One file holds the arrays of
one key::

    16 bytes  magic and version
     4 bytes  CRC-32 of all that follows, little endian
     4 bytes  length of the header, little endian
    header    JSON: the key and, for each array, name, dtype and shape
    arrays    C order, one after another, each on a multiple of 64 bytes
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import struct
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAX_TOTAL_BYTES = 2 << 30
"""Size of a cache folder above which the least recently used files are removed."""

_MAGIC = b"firstfix cache 1"
_PREFIX = struct.Struct("<16sII")
_CHECKED_FROM = 20
_ALIGNMENT = 64
_SUFFIX = ".fields"
_TEMPORARY = ".partial"
_ABANDONED_AFTER_S = 24 * 3600.0
_PLAIN_KINDS = "biufc"  # never objects: reading them would run what the file says

Arrays = dict[str, NDArray[Any]]


def cache_folder() -> Path:
    """Name the folder of the cache: ``FIRSTFIX_CACHE_DIR``, or the user's own cache folder."""
    import platformdirs

    named = os.environ.get("FIRSTFIX_CACHE_DIR")
    return Path(named or platformdirs.user_cache_dir("firstfix", appauthor=False))


def content_key(*parts: bytes | str | NDArray[Any]) -> str:
    """Derive a key from everything that the cached arrays depend on.

    Parameters
    ----------
    *parts : bytes, str or ndarray
        Content; of arrays also the dtype and shape count. Name the version of the algorithm too.

    Returns
    -------
    str
        32 hexadecimal digits (BLAKE2b).
    """
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        if isinstance(part, np.ndarray):
            _check_plain(part)
            kind, content = f"{part.dtype.str}{part.shape}", _bytes_of(part)
        elif isinstance(part, str):
            kind, content = "str", memoryview(part.encode())
        else:
            kind, content = "bytes", memoryview(part)
        # Lengths keep ("ab", "c") apart from ("a", "bc").
        digest.update(f"{kind} {content.nbytes}\n".encode())
        digest.update(content)
    return digest.hexdigest()


def load_or_build(key: str, build: Callable[[], Arrays], folder: Path) -> Arrays:
    """Fetch arrays from the cache, or build them and keep them there.

    Processes may share a folder; a reader sees a whole file or none.

    Parameters
    ----------
    key : str
        What the arrays depend on, from `content_key`.
    build : callable
        Makes the arrays, by name; called only if the cache has nothing sound under this key.
    folder : Path
        Where the cache lives, such as `cache_folder`; made if missing.

    Returns
    -------
    dict of ndarray
        The arrays, by name, read-only.
    """
    if not (key.isascii() and key.isalnum()):
        raise ValueError(f"a key is made of letters and digits, not {key!r}: see content_key")
    path = folder / f"{key}{_SUFFIX}"
    arrays = _load(path, key)
    if arrays is None:
        arrays = {name: array.view() for name, array in build().items()}
        for array in arrays.values():
            _check_plain(array)
        _store(path, key, arrays)
    for array in arrays.values():
        array.flags.writeable = False
    return arrays


def _load(path: Path, key: str) -> Arrays | None:
    try:
        if not path.is_file() or path.stat().st_size > MAX_TOTAL_BYTES:
            return None
        # Read, not mapped: nobody can change or cut the file under us after it was checked.
        arrays = _decode(np.fromfile(path, np.uint8), key)
    except Exception:  # noqa: BLE001 - whatever is wrong with a file, the answer is to build
        return None
    with contextlib.suppress(OSError):
        os.utime(path)  # used just now: the last to be removed
    return arrays


def _decode(content: NDArray[np.uint8], key: str) -> Arrays:
    magic, checksum, length = _PREFIX.unpack(content[: _PREFIX.size].tobytes())
    if magic != _MAGIC or zlib.crc32(content[_CHECKED_FROM:].data) != checksum:
        raise ValueError("not a sound cache file of this version")
    offset = _PREFIX.size + length
    header = json.loads(content[_PREFIX.size : offset].tobytes())
    if header["key"] != key:
        raise ValueError("the file of another key")
    arrays: Arrays = {}
    for name, code, shape in header["arrays"]:
        dtype = np.dtype(code)
        offset = _aligned(offset)
        end = offset + int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
        arrays[name] = content[offset:end].view(dtype).reshape(shape)
        _check_plain(arrays[name])
        offset = end
    return arrays


def _store(path: Path, key: str, arrays: Arrays) -> None:
    pieces = list(_encode(key, arrays))
    if sum(piece.nbytes for piece in pieces) > MAX_TOTAL_BYTES:
        return
    checksum = 0
    for piece in pieces:
        checksum = zlib.crc32(piece, checksum)
    with contextlib.suppress(OSError):  # a full or read-only disk costs time, not the answer
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(dir=path.parent, suffix=_TEMPORARY)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.writelines([_MAGIC, struct.pack("<I", checksum), *pieces])
            Path(temporary).replace(path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
        _remove_least_used(path)


def _encode(key: str, arrays: Arrays) -> Iterator[memoryview]:
    """Yield all that the checksum covers."""
    entries = [(name, array.dtype.str, array.shape) for name, array in arrays.items()]
    header = json.dumps({"key": key, "arrays": entries}).encode()
    yield memoryview(struct.pack("<I", len(header)) + header)
    offset = _PREFIX.size + len(header)
    for array in arrays.values():
        yield memoryview(bytes(_aligned(offset) - offset))
        yield _bytes_of(array)
        offset = _aligned(offset) + array.nbytes


def _remove_least_used(newest: Path) -> None:
    for abandoned in newest.parent.glob(f"*{_TEMPORARY}"):
        if time.time() - abandoned.stat().st_mtime > _ABANDONED_AFTER_S:
            abandoned.unlink(missing_ok=True)
    used = {path: path.stat() for path in newest.parent.glob(f"*{_SUFFIX}")}
    total = sum(status.st_size for status in used.values())
    for path in sorted(used, key=lambda path: used[path].st_mtime_ns):
        if total <= MAX_TOTAL_BYTES:
            return
        if path != newest:
            path.unlink(missing_ok=True)
            total -= used[path].st_size


def _bytes_of(array: NDArray[Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def _check_plain(array: NDArray[Any]) -> None:
    if array.dtype.kind not in _PLAIN_KINDS:
        raise TypeError(f"only arrays of plain numbers can be cached, not of {array.dtype}")


def _aligned(offset: int) -> int:
    return -(-offset // _ALIGNMENT) * _ALIGNMENT
