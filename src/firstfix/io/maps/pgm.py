"""PGM images, plain and raw, with any maxval; Pillow's reader loops over pixels in Python."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import MapError
from firstfix.io.maps.pixels import MapImage, check_size

PGM_MAGIC = (b"P2", b"P5")

_MAX_HEADER_BYTES = 65_536
_COMMENT = re.compile(rb"#[^\r\n]*")
_GAP = rb"(?:\s|#[^\r\n]*[\r\n])+"
_HEADER = re.compile(
    rb"P([25])" + _GAP + rb"([0-9]{1,9})" + _GAP + rb"([0-9]{1,9})" + _GAP + rb"([0-9]{1,5})\s"
)
_PLAIN_BLOCK = 1 << 20


class _Header(NamedTuple):
    plain: bool
    width: int
    height: int
    maxval: int
    start: int


def open_pgm(path: Path, max_cells: int) -> MapImage:
    """Open and decode a PGM, either P2 (plain) or P5 (raw).

    Raises
    ------
    MapError
        If it is broken, empty or larger than `max_cells`.
    """
    header = _read_header(path)
    check_size(path, header.width, header.height, max_cells)
    pixels = _read_pixels(path, header)

    def read(top: int, bottom: int) -> tuple[NDArray[Any], None]:
        return pixels[top:bottom], None

    return MapImage(
        width=header.width,
        height=header.height,
        kind=f"PGM grey, maxval {header.maxval}",
        levels=np.arange(header.maxval + 1),
        white=header.maxval,
        has_alpha=False,
        read=read,
    )


def _read_header(path: Path) -> _Header:
    with path.open("rb") as file:
        match = _HEADER.match(file.read(_MAX_HEADER_BYTES))
    if match is None or not 1 <= int(match[4]) <= 65_535:
        raise _broken(path, "a header without width, height and a maxval up to 65535")
    return _Header(match[1] == b"2", int(match[2]), int(match[3]), int(match[4]), match.end())


def _read_pixels(path: Path, header: _Header) -> NDArray[Any]:
    count = header.width * header.height
    dtype = np.dtype(np.uint8 if header.maxval < 256 else ">u2")
    # The least its pixels take, asked before memory is spent on what a header claims.
    least = 2 * count - 1 if header.plain else count * dtype.itemsize
    with path.open("rb") as file:
        pixels: NDArray[Any] = np.empty(0, dtype)
        if path.stat().st_size - header.start >= least:
            file.seek(header.start)
            pixels = (
                _plain_pixels(path, file, count, header.maxval)
                if header.plain
                else np.fromfile(file, dtype, count)
            )
    if pixels.size != count:
        raise _broken(path, f"fewer than its {header.width} x {header.height} pixels")
    if pixels.max() > header.maxval:
        raise _broken(path, f"a pixel of {pixels.max()} above its maxval {header.maxval}")
    return pixels.reshape(header.height, header.width)


def _plain_pixels(path: Path, file: BinaryIO, count: int, maxval: int) -> NDArray[np.uint16]:
    pixels = np.empty(count, np.uint16)
    filled = 0
    while filled < count and (lines := file.readlines(_PLAIN_BLOCK)):
        words = _COMMENT.sub(b"", b"".join(lines)).split()[: count - filled]
        try:
            values = np.fromiter(map(int, words), np.int64, len(words))
        except (ValueError, OverflowError) as error:
            raise _broken(path, "something other than numbers among its pixels") from error
        if values.size and not 0 <= values.min() <= values.max() <= maxval:
            raise _broken(path, f"a pixel outside 0 to its maxval {maxval}")
        pixels[filled : filled + len(values)] = values
        filled += len(values)
    return pixels[:filled]


def _broken(path: Path, received: str) -> MapError:
    return MapError(
        expected=f"a whole PGM image in {path}",
        received=received,
        remedy="copy or save the image again",
    )
