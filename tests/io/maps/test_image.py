"""Images by their first bytes, and their limits."""

import io
import warnings

import numpy as np
import pytest
from PIL import Image

from firstfix.core.errors import MapError
from firstfix.io.maps.image import open_image
from firstfix.io.maps.pixels import DEFAULT_MAX_CELLS, check_size

PIXELS = np.arange(12, dtype=np.uint8).reshape(3, 4) * 20


def saved(file_format: str) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(PIXELS).save(buffer, file_format)
    return buffer.getvalue()


@pytest.mark.parametrize("file_format", ["PPM", "PNG", "BMP"])
def test_the_kind_is_known_by_content_not_by_name(tmp_path, file_format):
    path = tmp_path / "map.jpg"
    path.write_bytes(saved(file_format))
    (strip,) = open_image(path).strips()
    np.testing.assert_array_equal(strip.codes, PIXELS)
    assert (strip.top, strip.bottom, strip.transparent) == (0, 3, None)


@pytest.mark.parametrize("data", [saved("JPEG"), saved("GIF"), b"", b"text", b"P6 1 1 255\n\0\0\0"])
def test_other_kinds_are_refused_with_a_remedy(tmp_path, data):
    (tmp_path / "map").write_bytes(data)
    with pytest.raises(MapError, match="save the map as PNG or PGM"):
        open_image(tmp_path / "map")


@pytest.mark.parametrize("file_format", ["PPM", "PNG", "BMP"])
def test_size_is_asked_before_decoding(tmp_path, file_format):
    (tmp_path / "map").write_bytes(saved(file_format))
    with pytest.raises(MapError, match="4 x 3 pixels"):
        open_image(tmp_path / "map", max_cells=11)
    assert open_image(tmp_path / "map", max_cells=12).width == 4


def test_a_file_that_no_admitted_image_can_fill_is_not_read(tmp_path):
    path = tmp_path / "map"
    with path.open("wb") as file:
        file.write(b"BM")
        file.truncate(1 << 30)  # sparse
    with pytest.raises(MapError, match="1073741824 bytes"):
        open_image(path, max_cells=1000)


def test_a_vanished_image(tmp_path):
    with pytest.raises(MapError, match="No such file"):
        open_image(tmp_path / "gone.png")


def test_pillow_and_its_limit_are_left_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 2_000_000)
    (tmp_path / "map.png").write_bytes(b"")
    Image.new("L", (2500, 2000), 205).save(tmp_path / "map.png")
    filters = list(warnings.filters)
    image = open_image(tmp_path / "map.png")
    assert sum(strip.codes.size for strip in image.strips()) == 2500 * 2000
    assert Image.MAX_IMAGE_PIXELS == 2_000_000
    assert warnings.filters == filters


def test_the_default_admits_the_largest_known_maps(tmp_path):
    check_size(tmp_path, 4128, 10976, DEFAULT_MAX_CELLS)
    check_size(tmp_path, 4914, 4384, DEFAULT_MAX_CELLS)


@pytest.mark.parametrize(
    ("width", "height", "max_cells"),
    [(0, 5, 10), (5, 0, 10), (11, 1, 10), (1 << 20, 1 << 10, 1 << 40), ((1 << 20) + 1, 1, 1 << 30)],
)
def test_sizes_beyond_the_limits(tmp_path, width, height, max_cells):
    with pytest.raises(MapError, match=f"{width} x {height}"):
        check_size(tmp_path, width, height, max_cells)
