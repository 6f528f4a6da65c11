"""Images: the same drawing means the same in every format and type of pixel."""

import io
import struct
import warnings
import zlib
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from PIL import Image

from firstfix.core.errors import MapError
from firstfix.io.maps import image as image_module
from firstfix.io.maps.image import read_image

GREYS = np.array([[0, 85, 170], [255, 255, 0]], np.uint8)


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    path = tmp_path_factory.mktemp("images") / "map.jpg"  # the content decides, not the name

    def read(data: bytes):
        path.write_bytes(data)
        return read_image(path)

    return read


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


def shades(image) -> list[list[float]]:
    return (image.levels / image.white).tolist()


# --- formats and types of pixels ---


@pytest.mark.parametrize("file_format", ["PPM", "PNG", "BMP"])
@pytest.mark.parametrize("mode", ["L", "RGB", "P", "RGBA"])
def test_every_type_of_pixel_has_the_same_brightness(read, mode, file_format):
    if file_format == "PPM" and mode == "P":
        return
    picture = Image.fromarray(GREYS).convert("RGB").convert(mode)
    if mode == "P":
        picture = Image.fromarray(GREYS).quantize(4)
    assert shades(read(encoded(picture, file_format))) == (GREYS / 255).tolist()


def test_16_bit_grey(read):
    picture = Image.fromarray(GREYS.astype(np.uint16) * 257)
    assert shades(read(encoded(picture))) == (GREYS / 255).tolist()


@pytest.mark.parametrize("file_format", ["PPM", "PNG", "BMP"])
def test_1_bit(read, file_format):
    image = read(encoded(Image.fromarray(GREYS).convert("1", dither=0), file_format))
    assert shades(image) == [[0, 0, 1], [1, 1, 0]]
    assert image.transparent is None


def test_an_interlaced_png(read):
    assert read(encoded(Image.fromarray(GREYS), interlace=1)).levels.tolist() == GREYS.tolist()


def test_colour_is_the_average_of_its_channels(read):
    for file_format in ("PNG", "PPM"):
        image = read(encoded(Image.new("RGB", (1, 1), (255, 0, 51)), file_format))
        assert shades(image) == [[(255 + 0 + 51) / 765]]


@pytest.mark.parametrize(
    ("magic", "kind"),
    [(b"P1", "PBM 1-bit"), (b"P2", "PGM grey"), (b"P3", "PPM colour"), (b"P6", "PPM colour")],
)
def test_the_kind_of_netpbm_images(read, magic, kind):
    data = {
        b"P1": b"1 1\n0",
        b"P2": b"1 1 255\n0",
        b"P3": b"1 1 255\n0 0 0",
        b"P6": b"1 1 255\n" + bytes(3),
    }
    assert read(magic + b"\n" + data[magic]).kind == kind


# --- transparency ---


@pytest.mark.parametrize("mode", ["LA", "RGBA"])
def test_any_alpha_below_255_is_transparent(read, mode):
    grey = [Image.new("L", (3, 1), 205)] * (1 if mode == "LA" else 3)
    alpha = Image.fromarray(np.array([[0, 254, 255]], np.uint8))
    image = read(encoded(Image.merge(mode, [*grey, alpha])))
    assert shades(image) == [[205 / 255] * 3]
    assert image.transparent.tolist() == [[True, True, False]]


@pytest.mark.parametrize("alpha", [128, 0])  # Pillow reads the second one as an index
def test_alpha_in_a_palette(read, alpha):
    palette = (b"PLTE", bytes([0, 0, 0, 255, 255, 255, 9, 9, 9]))
    raster = b"\0\0\1\2\0\2\1\0"
    image = read(png(8, 3, raster, palette, (b"tRNS", bytes([255, alpha]))))
    assert image.transparent.tolist() == [[False, True, False], [False, True, False]]


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
def test_one_grey_or_colour_declared_transparent(read, depth, colour, raster, key):
    image = read(png(depth, colour, raster, (b"tRNS", key)))
    assert image.transparent.tolist() == [[False, True, False], [False, True, False]]


# --- Netpbm with any maximum ---


@settings(max_examples=60, deadline=None)
@given(
    data=st.data(),
    maxval=st.sampled_from([1, 100, 255, 256, 65535]),
    gap=st.sampled_from(["\n", " ", "\r\n", "\n# a comment\n", "\t \n"]),
)
def test_raw_pgm_is_exact_and_plain_pgm_within_rounding(read, data, maxval, gap):
    shape = npst.array_shapes(min_dims=2, max_dims=2, max_side=5)
    values = data.draw(npst.arrays(np.uint16, shape, elements=st.integers(0, maxval)))
    size = gap.join([str(values.shape[1]), str(values.shape[0]), str(maxval)]).encode()
    dtype = np.uint8 if maxval < 256 else ">u2"
    raw = read(b"P5" + gap.encode() + size + b"\n" + values.astype(dtype).tobytes())
    np.testing.assert_array_equal(raw.levels / raw.white, values / maxval)
    words = gap.join(str(v) for v in values.ravel()).encode()
    plain = read(b"P2" + gap.encode() + size + b"\n" + words)
    np.testing.assert_allclose(plain.levels / plain.white, values / maxval, atol=0.51 / 255)


def test_raw_ppm_of_16_bits(read):
    image = read(b"P6 2 1 1000\n" + np.array([1000, 0, 500, 0, 0, 0], ">u2").tobytes())
    assert shades(image) == [[0.5, 0.0]]


# --- damage, other formats and sizes ---


@pytest.mark.parametrize("data", [encoded(Image.new("L", (2, 2)), "JPEG"), b"", b"text", b"P7\n"])
def test_other_formats_are_rejected_with_a_remedy(read, data):
    with pytest.raises(MapError, match="save the map as PNG or PGM"):
        read(data)


@pytest.mark.parametrize(
    "data",
    [
        b"P5",
        b"P5 2 2",
        b"P5 x 2 255\n",
        b"P5 -2 2 255\n",
        b"P5 2 2 0\n\0\0\0\0",
        b"P5 2 2 65536\n" + bytes(8),
        b"P5 2 2 255\n\0\0\0",
        b"P5 2 2 256\n" + bytes(7),
        b"P6 2 2 255\n" + bytes(11),
        b"P2 2 2 255\n1 2 3",
        b"P2 2 2 255\n1 2 3 # 4 5 6",
        b"P2 2 2 255\n1 2 3 x",
        b"P2 2 2 255\n1 2 3 -4",
        b"P2 2 2 9\n1 2 3 10",
        b"P2 2 2 255\n1 2 3 " + b"9" * 5000,
        b"P5 2 2 9\n\1\2\3\x0a",
        b"P5 0 2 255\n",
        b"P5 2 0 255\n",
        b"P5 999999999 999999999 255\n",
        png(8, 0, b"", size=(0, 2)),
        png(1, 0, b"", size=(50_000, 50_000)),
    ],
)
def test_damaged_headers_and_pixels_are_rejected(read, data):
    with pytest.raises(MapError, match=r"a complete image|at least one pixel|at most 500000000"):
        read(data)


@pytest.mark.parametrize("file_format", ["PNG", "BMP"])
@pytest.mark.parametrize("mode", ["1", "L", "P", "RGB"])
def test_every_truncation_is_rejected(read, file_format, mode):
    data = encoded(Image.fromarray(GREYS).convert(mode), file_format)
    # The last bytes of a BMP are padding, and the middle of the larger ones is palette.
    last = len(data) - (3 if file_format == "BMP" else 4)
    for end in sorted({*range(8, min(70, last)), *range(max(8, last - 30), last)}):
        with pytest.raises(MapError, match="a complete image"):
            read(data[:end])


def test_every_flipped_bit_of_a_png_is_rejected(read):
    data = encoded(Image.fromarray(GREYS))
    for at in range(8, len(data) - 12):  # the last chunk is empty
        damaged = bytearray(data)
        damaged[at] ^= 16
        with pytest.raises(MapError):
            read(bytes(damaged))


def test_a_text_that_unpacks_to_too_much_is_rejected(read):
    bomb = b"Comment\0\0" + zlib.compress(b"\0" * (2 << 20))
    with pytest.raises(MapError, match="a complete image"):
        read(png(8, 0, b"\0abc\0abc", (b"zTXt", bomb)))


@pytest.mark.parametrize("file_format", ["PPM", "PNG", "BMP"])
def test_the_size_is_checked_before_decoding(read, monkeypatch, file_format):
    data = encoded(Image.fromarray(GREYS), file_format)
    monkeypatch.setattr(image_module, "MAX_CELLS", 5)
    with pytest.raises(MapError, match=r"at most 5 pixels .* received 3 x 2 pixels"):
        read(data)
    monkeypatch.setattr(image_module, "MAX_CELLS", 6)
    assert read(data).levels.shape == (2, 3)


@pytest.mark.slow
def test_images_above_100_megapixels_load(read):
    image = read(encoded(Image.new("1", (11_000, 10_000)), compress_level=1))
    assert image.levels.shape == (10_000, 11_000)


def test_too_little_memory_is_one_sentence(read):
    data = encoded(Image.fromarray(GREYS))
    no_memory = patch("PIL.PngImagePlugin.PngImageFile.load", side_effect=MemoryError)
    with no_memory, pytest.raises(MapError, match="enough memory for the image"):
        read(data)


def test_a_missing_image(tmp_path):
    with pytest.raises(MapError, match="No such file"):
        read_image(tmp_path / "gone.png")


def test_the_settings_of_pillow_are_not_changed(read, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 2_000_000)
    filters = list(warnings.filters)
    assert read(encoded(Image.new("L", (2500, 2000), 205))).levels.size == 2500 * 2000
    assert Image.MAX_IMAGE_PIXELS == 2_000_000
    assert warnings.filters == filters
