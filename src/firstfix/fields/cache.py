"""Arrays that are expensive to build, kept on disk between runs.

The cache never changes a result: a file that cannot be read is built again, and a failed write is
ignored. One file in the format .npz holds the array of one key; its CRC-32 detects damage.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAX_TOTAL_BYTES = 2 << 30
"""Size of a cache folder above which the least recently used files are removed."""

_SUFFIX, _TEMPORARY = ".fields", ".partial"
_PLAIN_KINDS = "biufc"  # never objects, which are pickles


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


def load_or_build(key: str, build: Callable[[], NDArray[Any]], folder: Path) -> NDArray[Any]:
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
            _store(path, array)
    array.flags.writeable = False
    return array


def _load(path: Path) -> NDArray[Any] | None:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            array: NDArray[Any] = archive["array"]
            _check_plain(array)
    except Exception:  # noqa: BLE001 - a damaged file raises nearly anything
        return None
    with contextlib.suppress(OSError):
        os.utime(path)  # used now: the last to be removed
    return array


def _store(path: Path, array: NDArray[Any]) -> None:
    if array.nbytes > MAX_TOTAL_BYTES:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, suffix=_TEMPORARY)
    try:
        with os.fdopen(descriptor, "wb") as file:
            np.savez(file, array=array)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    _remove_least_used(path)


def _remove_least_used(newest: Path) -> None:
    """Remove files until the rest fits, also those of processes that were killed."""
    files = [*newest.parent.glob(f"*{_SUFFIX}"), *newest.parent.glob(f"*{_TEMPORARY}")]
    used = {file: file.stat() for file in files}
    total = sum(status.st_size for status in used.values())
    for file in sorted(used, key=lambda file: (file == newest, used[file].st_mtime_ns)):
        if total <= MAX_TOTAL_BYTES:
            return
        file.unlink(missing_ok=True)
        total -= used[file].st_size


def _check_plain(array: NDArray[Any]) -> None:
    if array.dtype.kind not in _PLAIN_KINDS:
        raise TypeError(f"only arrays of numbers can be cached, not of {array.dtype}")
