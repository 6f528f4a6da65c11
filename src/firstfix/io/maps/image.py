"""The image of a map, decoded by Pillow: PGM, PPM, PBM, PNG and BMP."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import MapError
from firstfix.core.grid import MAX_CELLS
from firstfix.io.atomic_files import show

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageFile import ImageFile

_PNG, _BMP = b"\x89PNG\r\n\x1a\n", b"BM"
_NETPBM = tuple(b"P%d" % kind for kind in range(1, 7))
MAGICS = (_PNG, _BMP, *_NETPBM)
"""First bytes of the formats."""

MAX_SIDE = 1 << 20
"""Largest width and height, pixels."""

_MODES = {
    "1": "1-bit",
    "L": "grey",
    "LA": "grey with alpha",
    "P": "palette",
    "RGB": "colour",
    "RGBA": "colour with alpha",
    "I;16": "16-bit grey",
    "I": "16-bit grey",
}
# Pillow stretches greys of 1, 2 and 4 bits to 8 bits, but not the grey declared transparent.
_KEY_SCALES = {"1": 255, "L;2": 85, "L;4": 17}

_ROWS = 256

# Pillow's parsers raise all of these on damaged files.
_DAMAGE = (
    *(OSError, SyntaxError, ValueError, LookupError, TypeError, AttributeError, AssertionError),
    *(ArithmeticError, EOFError, struct.error, zlib.error),
)


@dataclass(frozen=True, eq=False, slots=True)
class MapImage:
    """A decoded image.

    Parameters
    ----------
    levels : ndarray of uint8 or uint16, shape (height, width)
        Brightness, 0 to `white`; row 0 is the top row. Of colours, the sum of the three channels.
    white : int
        Brightness of white.
    transparent : ndarray of bool, shape (height, width), or None
        Pixels with alpha below 255; None if the format of the pixels has no alpha.
    kind : str
        File format and type of pixel, for people.
    """

    levels: NDArray[Any]
    white: int
    transparent: NDArray[np.bool_] | None
    kind: str


def read_image(path: Path) -> MapImage:
    """Decode an image, after checking the size that its header states.

    Parameters
    ----------
    path : Path
        A regular file. Its first bytes decide the format, not its name.

    Returns
    -------
    MapImage
        At least one pixel.

    Raises
    ------
    MapError
        If the file is unreadable, damaged, of another format, empty, or larger than `MAX_CELLS`
        or the free memory.
    """
    try:
        with path.open("rb") as file:
            magic = file.read(len(_PNG))
    except OSError as error:
        raise unreadable(path, error) from error
    if not magic.startswith(MAGICS):
        raise MapError(
            expected=f"a PGM, PPM, PNG or BMP image in {path}",
            received=f"a file that begins with {show(magic)}",
            remedy="save the map as PNG or PGM; JPEG would blur its walls",
        )
    try:
        return _decode(path, magic)
    except _DAMAGE as error:
        raise MapError(
            expected=f"a complete image in {path}",
            received=f"one that cannot be read ({' '.join(str(error).split())[:100]})",
            remedy="copy or save the image again",
        ) from error
    except MemoryError as error:
        raise MapError(
            expected=f"enough memory for the image {path}",
            received="too little",
            remedy="crop the map, use a coarser resolution or close other programs",
        ) from error


def unreadable(path: Path, error: OSError) -> MapError:
    """Return the error for a file that cannot be opened, read or written."""
    return MapError(
        expected=f"access to {show(str(path))}",
        received=error.strerror or type(error).__name__,
        remedy="check the folder and its permissions",
    )


def _decode(path: Path, magic: bytes) -> MapImage:
    # The classes of Pillow, not Image.open: its limit of pixels is one setting for the process.
    from PIL.BmpImagePlugin import BmpImageFile
    from PIL.PngImagePlugin import PngImageFile
    from PIL.PpmImagePlugin import PpmImageFile

    if magic.startswith(_PNG):
        with path.open("rb") as file:
            PngImageFile(file).verify()  # load() does not compare the checksums of pixels
    with path.open("rb") as file:
        if magic.startswith(_NETPBM):
            image: ImageFile = PpmImageFile(file)
        else:
            image = PngImageFile(file) if magic.startswith(_PNG) else BmpImageFile(file)
        _check_size(path, *image.size)
        if image.mode not in _MODES:
            raise ValueError(f"pixels of the type {image.mode}")
        name = "BMP" if magic.startswith(_BMP) else "PNG"
        if magic.startswith(_NETPBM):
            name = {"L": "PGM", "I": "PGM", "RGB": "PPM"}.get(image.mode, "PBM")
        kind = f"{name} {_MODES[image.mode]}"
        tile: Any = image.tile[0]
        codec, _, offset, arguments = tile
        if magic.startswith((b"P5", b"P6")):
            raw_maxval = 65_535 if image.mode == "I" else 255
            return _read_raw(
                image, path, offset, arguments[-1] if codec == "ppm" else raw_maxval, kind
            )
        scale = _KEY_SCALES.get(str(arguments), 1)
        image.load()
        pixels: Image = image
        has_key = "transparency" in image.info
        if image.mode == "P" or (image.mode == "RGB" and has_key):
            pixels = image.convert("RGBA" if has_key else "RGB")
        levels, white = _levels(pixels)
        return MapImage(levels, white, _transparent(pixels, levels, scale), kind)


def _check_size(path: Path, width: int, height: int) -> None:
    if width < 1 or height < 1:
        raise MapError(
            expected=f"at least one pixel in {path}",
            received=f"{width} x {height} pixels",
            remedy="save the map again",
        )
    if width * height > MAX_CELLS or max(width, height) > MAX_SIDE:
        raise MapError(
            expected=f"at most {MAX_CELLS} pixels and {MAX_SIDE} a side in {path}",
            received=f"{width} x {height} pixels",
            remedy="crop the map or use a coarser resolution",
        )


def _read_raw(image: ImageFile, path: Path, offset: int, maxval: int, kind: str) -> MapImage:
    """Read a raw PGM or PPM; if white is not 255, Pillow would loop in Python, and round."""
    channels = 3 if image.mode == "RGB" else 1
    dtype = np.dtype(np.uint8 if maxval < 256 else ">u2")
    count = image.width * image.height * channels
    values = np.fromfile(path, dtype, count, offset=offset)
    if values.size < count:
        raise ValueError("image file is truncated")
    if values.max() > maxval:
        raise ValueError(f"a value of {values.max()} above its maximum {maxval}")
    pixels = values.reshape(image.height, image.width, channels)
    levels = pixels[..., 0] if channels == 1 else pixels.sum(axis=2, dtype=np.uint32)
    return MapImage(levels, channels * maxval, None, kind)


def _levels(image: Image) -> tuple[NDArray[Any], int]:
    """Return the brightness of every pixel, and that of white."""
    if image.mode == "1":
        return np.asarray(image.convert("L")), 255
    if image.mode in ("L", "LA"):
        return np.asarray(image.getchannel(0)), 255
    if image.mode in ("I;16", "I"):
        return np.asarray(image).astype(np.uint16), 65_535
    levels = np.empty((image.height, image.width), np.uint16)
    for top in range(0, image.height, _ROWS):  # in strips: a copy of all channels is large
        strip = np.asarray(image.crop((0, top, image.width, min(top + _ROWS, image.height))))
        levels[top : top + _ROWS] = strip[..., 0].astype(np.uint16) + strip[..., 1] + strip[..., 2]
    return levels, 765


def _transparent(image: Image, levels: NDArray[Any], key_scale: int) -> NDArray[np.bool_] | None:
    if image.mode in ("LA", "RGBA"):
        return np.asarray(image.getchannel("A")) < 255
    key = image.info.get("transparency")
    if key is None:
        return None
    value = min(key * key_scale, 255) if image.mode == "1" else key * key_scale
    transparent: NDArray[np.bool_] = levels == value
    return transparent
