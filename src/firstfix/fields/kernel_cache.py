"""Compiled kernels on disk, in a folder whose name is a hash of all kernel sources.

Numba's cache notices changes of a kernel's own file, but not of a constant or a callee from another
file. A folder for each state of the sources never holds stale code, also when a checkout goes back
and forth between two states.
"""

from __future__ import annotations

import contextlib
import gc
import hashlib
import logging
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba import njit
from numba.core import event

from firstfix.fields.cache import cache_folder

_SETTINGS: Any = numba.config  # set from the environment when numba was imported
_EVENTS: Any = event

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

PACKAGE = Path(__file__).parents[1]
_FOLDERS = ("amcl", "belief", "changes", "fields", "global_localization", "lab/simulation")
_CONSTANTS = ("core/angles.py", "fields/search_grid.py")

# Less to compile: no check for a division by zero, no entry point for C.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}

_log = logging.getLogger("firstfix.kernels")

_PREFIX = "kernels-"
# Other versions may share the folder: keep what was used lately.
_KEPT = 4
_UNUSED_AFTER_S = 24 * 3600.0


def kernel(function: Kernel) -> Kernel:
    """Compile a function at its first call, without the GIL, and keep the machine code on disk.

    The folder is ``NUMBA_CACHE_DIR`` if that is set, else ``__pycache__`` of the package, else the
    user's cache folder. Numba's settings for other packages stay as they are.
    """
    with _cached_in(kernel_folder()):
        compiled: Any = njit(cache=True, nogil=True, **_OPTIONS)(function)
    return cast("Kernel", compiled)


def part(function: Kernel) -> Kernel:
    """Copy a function into the kernels that call it: it is never compiled by itself."""
    copied: Any = njit(nogil=True, inline="always", **_OPTIONS)(function)
    return cast("Kernel", copied)


def kernel_sources() -> list[Path]:
    """Return the files that compiled code depends on, sorted."""
    files = [file for folder in _FOLDERS for file in (PACKAGE / folder).glob("*.py")]
    kernels = [file for file in files if b"\n@kernel\n" in file.read_bytes()]
    return sorted([*kernels, *(PACKAGE / name for name in _CONSTANTS)])


@cache
def kernel_folder() -> Path:
    """Return the folder of compiled kernels for the sources as they are; removes unused ones."""
    digest = hashlib.blake2b(digest_size=8)
    for file in kernel_sources():
        content = file.read_bytes()
        digest.update(f"{file.relative_to(PACKAGE).as_posix()} {len(content)}\n".encode())
        digest.update(content)
    name = f"{_PREFIX}{digest.hexdigest()}"
    named = _SETTINGS.CACHE_DIR
    for parent in (Path(named),) if named else (PACKAGE / "__pycache__", cache_folder()):
        folder = parent / name
        if _is_writable(folder):
            _remove_unused(parent, folder)
            return folder
    return Path(named or cache_folder()) / name  # numba raises an error that names the remedy


@contextlib.contextmanager
def _cached_in(folder: Path) -> Iterator[None]:
    """Let numba choose a folder for the kernels decorated meanwhile."""
    before = _SETTINGS.CACHE_DIR
    _SETTINGS.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        _SETTINGS.CACHE_DIR = before


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            os.utime(folder)  # used now
    except OSError:
        return False
    return True


def _remove_unused(parent: Path, used: Path) -> None:
    with contextlib.suppress(OSError):  # another process may remove them at the same time
        times = {folder: folder.stat().st_mtime for folder in parent.glob(f"{_PREFIX}*")}
        newest = sorted(times, key=lambda folder: -times[folder])
        for folder in newest[_KEPT:]:
            if folder != used and time.time() - times[folder] > _UNUSED_AFTER_S:
                shutil.rmtree(folder, ignore_errors=True)


class _Compilation(event.Listener):
    """Logs once in a process that kernels are compiled; those on disk are loaded instead.

    Meanwhile no garbage is collected: a compiler makes many objects that stay, and looking through
    them again and again takes 6 % of its time. Numba holds a lock between start and end, and
    compiles callees in between.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._is_announced = False
        self._collects = False

    def on_start(self, started: Any) -> None:
        """Log before the first kernel, and stop the collector."""
        if self._depth == 0:
            self._collects = gc.isenabled()
            gc.disable()
        self._depth += 1
        module = started.data["dispatcher"].py_func.__module__
        if not self._is_announced and module.startswith("firstfix."):
            self._is_announced = True
            _log.warning(
                "Compiling kernels, once on this machine: up to half a minute. "
                "They are kept in %s.",
                kernel_folder(),
            )

    def on_end(self, _: Any) -> None:
        """Start the collector again after the outermost function."""
        self._depth -= 1
        if self._depth == 0 and self._collects:
            gc.enable()


_EVENTS.register("numba:compile", _Compilation())
