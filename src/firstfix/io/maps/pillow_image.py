"""PNG and BMP images, through Pillow."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import MapError
from firstfix.io.maps.pixels import MapImage, check_size

if TYPE_CHECKING:
    from PIL.ImageFile import ImageFile

PNG_MAGIC, BMP_MAGIC = b"\x89PNG\r\n\x1a\n", b"BM"

# Text, colour profiles and animations are no part of a map, but can be bombs or raise warnings.
_PNG_CHUNKS = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")

# Pillow's readers raise whatever their parsing stumbles over.
_BROKEN = (
    *(OSError, SyntaxError, ValueError, LookupError, TypeError, AttributeError, AssertionError),
    *(ArithmeticError, EOFError, struct.error, zlib.error),
)

# Number of brightness levels by Pillow mode; colours count the sum of their three channels.
_LEVELS = {"1": 2, "L": 256, "LA": 256, "RGB": 766, "RGBA": 766, "I;16": 65_536, "I": 65_536}
_NAMES = {
    "1": "1-bit",
    "L": "grey",
    "LA": "grey with alpha",
    "P": "palette",
    "RGB": "colour",
    "RGBA": "colour with alpha",
    "I;16": "16-bit grey",
    "I": "16-bit grey",
}


def open_with_pillow(path: Path, magic: bytes, max_cells: int) -> MapImage:
    """Open and decode a PNG or BMP.

    The readers are called by name, not through ``Image.open``, whose limit of size and its warning
    are one setting for the whole process.

    Raises
    ------
    MapError
        If the image is broken, empty, larger than `max_cells` or of an odd kind.
    """
    from PIL.BmpImagePlugin import BmpImageFile
    from PIL.PngImagePlugin import PngImageFile

    is_png = magic.startswith(PNG_MAGIC)
    data = path.read_bytes()
    try:
        image: ImageFile
        if is_png:
            image = PngImageFile(BytesIO(_pixel_chunks(data)))
        else:
            image = BmpImageFile(BytesIO(data))
        check_size(path, *image.size, max_cells)
        key = _colour_key(image)
        image.load()
        return _as_map_image(image, "PNG" if is_png else "BMP", key)
    except _BROKEN as error:
        raise MapError(
            expected=f"a whole {'PNG' if is_png else 'BMP'} image in {path}",
            received=f"one that cannot be read ({error})",
            remedy="copy or save the image again",
        ) from error


def _pixel_chunks(data: bytes) -> bytes:
    """Return a PNG with only those chunks that make pixels, each with the right checksum."""
    kept, at, kind = [PNG_MAGIC], len(PNG_MAGIC), b""
    while kind != b"IEND":
        length, kind = struct.unpack_from(">I4s", data, at)
        end = at + 12 + length
        if kind in _PNG_CHUNKS:
            (checksum,) = struct.unpack_from(">I", data, end - 4)
            if zlib.crc32(memoryview(data)[at + 4 : end - 4]) != checksum:
                raise ValueError("wrong checksum")
            kept.append(data[at:end])
        at = end
    return b"".join(kept)


def _colour_key(image: ImageFile) -> Any:
    """Return the colour that a tRNS chunk declares transparent; for palettes, their alphas."""
    key = image.info.get("transparency")
    if isinstance(key, int) and image.mode == "L":
        # Pillow stretches the pixels of 2- and 4-bit greys to 8 bits, but not this key.
        key *= {"L;2": 85, "L;4": 17}.get(str(image.tile[0][3]), 1)
    return key


def _as_map_image(image: ImageFile, file_format: str, key: Any) -> MapImage:
    mode = image.mode
    width, height = image.size
    if mode == "P":
        white, levels = 765, _palette_levels(image)
    elif mode in _LEVELS:
        white, levels = _LEVELS[mode] - 1, np.arange(_LEVELS[mode])
    else:
        raise ValueError(f"pixels of kind {mode}")
    hidden = _hidden_codes(mode, len(levels), key)

    def read(top: int, bottom: int) -> tuple[NDArray[Any], NDArray[np.bool_] | None]:
        pixels = np.asarray(image.crop((0, top, width, bottom)))
        codes = _codes(pixels, mode)
        if mode in ("LA", "RGBA"):
            return codes, pixels[..., -1] < 255
        if mode == "RGB" and key is not None:
            return codes, (pixels == np.asarray(key)).all(axis=2)
        return codes, None if hidden is None else hidden[codes]

    return MapImage(
        width=width,
        height=height,
        kind=f"{file_format} {_NAMES[mode]}",
        levels=levels.astype(np.int64),
        white=white,
        has_alpha=mode in ("LA", "RGBA") or key is not None,
        read=read,
    )


def _palette_levels(image: ImageFile) -> NDArray[np.int64]:
    """Return the sum of the channels of every palette entry; missing entries are black."""
    colours = np.asarray(image.getpalette("RGB") or [], np.int64)[: 3 * 256].reshape(-1, 3)
    levels = np.zeros(256, np.int64)
    levels[: len(colours)] = colours.sum(axis=1)
    return levels


def _hidden_codes(mode: str, n_codes: int, key: Any) -> NDArray[np.bool_] | None:
    """Return which pixel codes are transparent as such; None where none is."""
    if key is None or mode == "RGB":
        return None
    hidden = np.zeros(n_codes, np.bool_)
    if isinstance(key, bytes):
        alphas = np.frombuffer(key[:n_codes], np.uint8)
        hidden[: len(alphas)] = alphas < 255
    elif key < n_codes or mode == "1":
        hidden[min(key, n_codes - 1)] = True
    return hidden


def _codes(pixels: NDArray[Any], mode: str) -> NDArray[Any]:
    if mode in ("RGB", "RGBA"):
        total = pixels[..., 0].astype(np.uint16)
        total += pixels[..., 1]
        total += pixels[..., 2]
        return total
    if mode == "LA":
        return pixels[..., 0]
    if mode == "I":  # 16-bit grey in Pillow before 11
        return pixels.clip(0, 65_535).astype(np.uint16)
    if mode == "1":  # true is 255 here
        return np.minimum(pixels.view(np.uint8), 1)
    return pixels
