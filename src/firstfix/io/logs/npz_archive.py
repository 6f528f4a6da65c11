"""Arrays out of an .npz archive that nobody vouches for."""

from __future__ import annotations

import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import IO

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.io.logs.scan_errors import unreadable

# 2**28 float32 ranges are a day of 360 beams at 8 Hz; an archive that unpacks to more is a bomb
# or would not fit beside the map on a robot anyway.
MAX_BYTES = 2**30

# What zipfile, its decompressors and NumPy's header parser raise on damaged archives.
_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    tokenize.TokenError,
    EOFError,
    LookupError,
    MemoryError,
    OSError,
    OverflowError,
    RuntimeError,  # encrypted members, unknown compression
    SyntaxError,
    TypeError,
    ValueError,
)


class NpzArchive:
    """The arrays of an archive, each measured before it is unpacked; a context manager.

    Parameters
    ----------
    file : Path or binary file
        The .npz file.
    max_bytes : int
        What its arrays may unpack to together.

    Raises
    ------
    ScanError
        If it is not an archive, or an array is damaged, not numeric, or too large.
    """

    def __init__(self, file: Path | IO[bytes], max_bytes: int = MAX_BYTES) -> None:
        self._name = f"{file}" if isinstance(file, Path) else "what was sent"
        self._max_bytes = self._left = max_bytes
        with self._damage_told():
            self._zip = zipfile.ZipFile(file)

    def __enter__(self) -> NpzArchive:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._zip.close()

    def __contains__(self, name: str) -> bool:
        return f"{name}.npy" in self._zip.NameToInfo

    def array(self, name: str) -> NDArray[np.generic]:
        """Unpack one array that must be there.

        Parameters
        ----------
        name : str
            Its name in the archive.

        Returns
        -------
        ndarray
            Numbers (bool, integer or float) of any shape.
        """
        if name not in self:
            raise ScanError(
                expected=f"the array `{name}`",
                received=f"none in {self._name}",
                remedy="save ranges, angle_min, angle_increment, range_min and range_max",
            )
        with self._damage_told(), self._zip.open(f"{name}.npy") as stream:
            self._measure(name, stream)
        with self._damage_told(), self._zip.open(f"{name}.npy") as stream:
            array: NDArray[np.generic] = np.lib.format.read_array(stream, allow_pickle=False)
            return array

    def number(self, name: str) -> float:
        """Unpack a single number that must be there."""
        array = self.array(name)
        if array.size != 1:
            raise ScanError(
                expected=f"one number `{name}` for the whole sensor",
                received=f"shape {array.shape} in {self._name}",
                remedy="save the scans of different sensors in files of their own",
            )
        return float(_as_float64(array).item())

    def column(self, name: str, shape: tuple[int, ...]) -> NDArray[np.float64] | None:
        """Unpack an array that may be missing.

        Parameters
        ----------
        name : str
            Its name in the archive.
        shape : tuple of int
            What it has to be.

        Returns
        -------
        ndarray or None
            As float64.
        """
        if name not in self:
            return None
        array = self.array(name)
        if array.shape != shape:
            raise ScanError(
                expected=f"`{name}` of shape {shape}",
                received=f"shape {array.shape} in {self._name}",
                remedy="give one row for every scan",
            )
        return _as_float64(array)

    def _measure(self, name: str, stream: IO[bytes]) -> None:
        shape, dtype = _read_header(stream)
        if dtype.kind not in "biuf":
            raise ScanError(
                expected=f"numbers in the array `{name}`",
                received=f"{dtype} in {self._name}",
                remedy="save plain float or integer arrays",
            )
        # The promise of the header, and what the archive holds: each alone can be a lie.
        size = math.prod(shape) * dtype.itemsize
        packed = self._zip.getinfo(f"{name}.npy").file_size
        if min(shape, default=0) < 0 or not 0 <= size <= packed:
            raise ScanError(
                expected=f"{size} bytes in the array `{name}`, as its header says",
                received=f"{packed} in {self._name}",
                remedy="save the archive again",
            )
        self._left -= size
        if self._left < 0:
            raise ScanError(
                expected=f"arrays of at most {self._max_bytes} bytes in total",
                received=f"more with `{name}` of shape {shape} in {self._name}",
                remedy="split the recording",
            )

    @contextmanager
    def _damage_told(self) -> Iterator[None]:
        try:
            yield
        except _DAMAGE as error:
            raise unreadable(self._name, "an .npz archive", error) from error


def _as_float64(array: NDArray[np.generic]) -> NDArray[np.float64]:
    with np.errstate(over="ignore"):  # what float64 cannot hold becomes inf, which readers judge
        return array.astype(np.float64)


def _read_header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[np.generic]]:
    version = np.lib.format.read_magic(stream)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:  # version 3 is for field names beyond latin-1
        raise ValueError(f"array format {version}")
    shape, _, dtype = readers[version](stream)
    return shape, dtype
