"""PNG and BMP: the same drawing in every layout of pixels means the same."""

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from firstfix.core.errors import MapError
from firstfix.io.maps.pillow_image import open_with_pillow

GREYS = np.array([[0, 85, 170], [255, 255, 0]], np.uint8)


@pytest.fixture
def opened(tmp_path):
    def opened(data: bytes):
        path = tmp_path / "map"
        path.write_bytes(data)
        return open_with_pillow(path, data[:8], 1000)

    return opened


def encoded(picture: Image.Image, file_format: str = "PNG", **options) -> bytes:
    buffer = io.BytesIO()
    picture.save(buffer, file_format, **options)
    return buffer.getvalue()


def png(depth: int, colour: int, raster: bytes, *chunks: tuple[bytes, bytes], size=(3, 2)) -> bytes:
    """Write a PNG by hand, for what Pillow does not write."""
    header = struct.pack(">IIBBBBB", *size, depth, colour, 0, 0, 0)
    parts = [(b"IHDR", header), *chunks, (b"IDAT", zlib.compress(raster)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in parts
    )


def shades(image) -> tuple[list, list | None]:
    """Return brightness from 0 to 1 and transparency of every pixel."""
    (strip,) = image.strips()
    hidden = None if strip.transparent is None else strip.transparent.tolist()
    return (image.levels[strip.codes] / image.white).tolist(), hidden


@pytest.mark.parametrize("file_format", ["PNG", "BMP"])
@pytest.mark.parametrize("mode", ["L", "RGB", "P", "RGBA"])
def test_every_layout_has_the_same_brightness(opened, mode, file_format):
    picture = Image.fromarray(GREYS).convert("RGB").convert(mode)
    if mode == "P":
        picture = Image.fromarray(GREYS).quantize(4)
    assert shades(opened(encoded(picture, file_format)))[0] == (GREYS / 255).tolist()


def test_16_bit_grey(opened):
    assert shades(opened(encoded(Image.fromarray(GREYS.astype(np.uint16) * 257))))[0] == (
        (GREYS / 255).tolist()
    )


@pytest.mark.parametrize("file_format", ["PNG", "BMP"])
def test_1_bit(opened, file_format):
    image = opened(encoded(Image.fromarray(GREYS).convert("1", dither=0), file_format))
    assert shades(image) == ([[0, 0, 1], [1, 1, 0]], None)


def test_an_interlaced_png(opened):
    picture = Image.fromarray(np.full((9, 9), 205, np.uint8))
    assert opened(encoded(picture, interlace=1)).levels[205] == 205


def test_colour_is_the_average_of_its_channels(opened):
    image = opened(encoded(Image.new("RGB", (1, 1), (255, 0, 51))))
    assert shades(image)[0] == [[(255 + 0 + 51) / 765]]


@pytest.mark.parametrize("mode", ["LA", "RGBA"])
def test_any_alpha_below_255_is_transparent(opened, mode):
    grey = [Image.new("L", (3, 1), 205)] * (1 if mode == "LA" else 3)
    alpha = Image.fromarray(np.array([[0, 254, 255]], np.uint8))
    image = opened(encoded(Image.merge(mode, [*grey, alpha])))
    assert image.has_alpha
    assert shades(image) == ([[205 / 255] * 3], [[True, True, False]])


def test_alpha_in_a_palette(opened):
    palette = (b"PLTE", bytes([0, 0, 0, 255, 255, 255, 9, 9, 9]))
    raster = b"\0\0\1\2\0\2\1\0"
    image = opened(png(8, 3, raster, palette, (b"tRNS", bytes([255, 128]))))
    assert shades(image)[1] == [[False, True, False], [False, True, False]]
    image = opened(png(8, 3, raster, palette, (b"tRNS", bytes([255, 0]))))  # Pillow: an index
    assert shades(image)[1] == [[False, True, False], [False, True, False]]


@pytest.mark.parametrize(
    ("depth", "colour", "raster", "key"),
    [
        (1, 0, b"\0\x40\0\x40", struct.pack(">H", 1)),
        (2, 0, b"\0\x10\0\x10", struct.pack(">H", 1)),
        (4, 0, b"\0\x01\0\0\x01\0", struct.pack(">H", 1)),
        (8, 0, b"\0\0\7\0\0\0\7\0", struct.pack(">H", 7)),
        (16, 0, b"\0\0\0\1\7\0\0\0\0\0\1\7\0\0", struct.pack(">H", 0x107)),
        (8, 2, b"\0" + b"\0\0\0\1\2\3\1\2\0" + b"\0" + b"\0\0\0\1\2\3\0\2\3", b"\0\1\0\2\0\3"),
    ],
)
def test_one_grey_or_colour_declared_transparent(opened, depth, colour, raster, key):
    image = opened(png(depth, colour, raster, (b"tRNS", key)))
    assert image.has_alpha
    assert shades(image)[1] == [[False, True, False], [False, True, False]]


def test_metadata_is_not_even_read(opened):
    # Pillow would warn of the broken animation and unpack the text.
    bomb = b"Comment\0\0" + zlib.compress(b"\0" * (1 << 20))
    image = opened(png(8, 0, b"\0abc\0abc", (b"acTL", b""), (b"zTXt", bomb), (b"iCCP", b"x")))
    assert image.kind == "PNG grey"
    info = PngImagePlugin.PngInfo()
    info.add_text("Author", "somebody")
    assert opened(encoded(Image.fromarray(GREYS), pnginfo=info)).width == 3


@pytest.mark.parametrize("file_format", ["PNG", "BMP"])
@pytest.mark.parametrize("mode", ["1", "L", "P", "RGB"])
def test_every_truncation_is_refused(opened, file_format, mode):
    data = encoded(Image.fromarray(GREYS).convert(mode), file_format)
    # The last bytes of a BMP are padding, and the middle of the larger ones is palette.
    last = len(data) - (3 if file_format == "BMP" else 0)
    for end in sorted({*range(8, min(70, last)), *range(max(8, last - 30), last)}):
        with pytest.raises(MapError, match=f"whole {file_format}"):
            opened(data[:end])


def test_every_flipped_bit_of_a_png_is_noticed(opened):
    data = encoded(Image.fromarray(GREYS))
    for at in range(8, len(data)):
        damaged = bytearray(data)
        damaged[at] ^= 16
        with pytest.raises(MapError):
            opened(bytes(damaged))


@pytest.mark.parametrize("size", [(0, 2), (3, 0)])
def test_no_pixels(opened, size):
    with pytest.raises(MapError):
        opened(png(8, 0, b"", size=size))


def test_a_bomb_is_refused_by_its_header(opened):
    with pytest.raises(MapError, match="50000 x 50000"):
        opened(png(1, 0, b"", size=(50_000, 50_000)))
