"""PGM, plain and raw, with any maxval."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from firstfix.core.errors import MapError
from firstfix.io.maps.pgm import open_pgm


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("pgm")


def pixels(folder, data: bytes) -> np.ndarray:
    path = folder / "map.pgm"
    path.write_bytes(data)
    return np.vstack([strip.codes for strip in open_pgm(path, 1000).strips()])


@settings(max_examples=60, deadline=None)
@given(
    data=st.data(),
    maxval=st.sampled_from([1, 100, 255, 256, 65535]),
    gap=st.sampled_from(["\n", " ", "\r\n", "\n# a comment\n", "#\r", "\t \n"]),
)
def test_plain_and_raw_say_the_same(folder, data, maxval, gap):
    shape = npst.array_shapes(min_dims=2, max_dims=2, max_side=5)
    values = data.draw(npst.arrays(np.uint16, shape, elements=st.integers(0, maxval)))
    size = gap.join([str(values.shape[1]), str(values.shape[0]), str(maxval)]).encode()
    raw = b"P5" + gap.encode() + size + b"\n"
    plain = b"P2" + gap.encode() + size + b"\n"
    words = gap.join(str(v) for v in values.ravel()).encode()
    dtype = np.uint8 if maxval < 256 else ">u2"
    np.testing.assert_array_equal(pixels(folder, raw + values.astype(dtype).tobytes()), values)
    np.testing.assert_array_equal(pixels(folder, plain + words), values)


def test_white_is_maxval(tmp_path):
    (tmp_path / "map.pgm").write_bytes(b"P5 1 1 100\n\x32")
    image = open_pgm(tmp_path / "map.pgm", 1)
    assert (image.levels[50], image.white, image.has_alpha) == (50, 100, False)
    assert image.kind == "PGM grey, maxval 100"


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"P5", "header"),
        (b"P5 2 2", "header"),
        (b"P5 2 2 255", "header"),
        (b"P5 x 2 255\n", "header"),
        (b"P5 -2 2 255\n", "header"),
        (b"P5 2 2 0\n\0\0\0\0", "header"),
        (b"P5 2 2 65536\n" + bytes(8), "header"),
        (b"P5 2 2 255\n\0\0\0", "fewer than its 2 x 2"),
        (b"P5 2 2 256\n" + bytes(7), "fewer than its 2 x 2"),
        (b"P2 2 2 255\n1 2 3", "fewer than its 2 x 2"),
        (b"P2 2 2 255\n1 2 3 # 4 5 6", "fewer than its 2 x 2"),
        (b"P2 2 2 255\n1 2 3 x", "other than numbers"),
        (b"P2 2 2 255\n1 2 3 -4", "outside 0"),
        (b"P2 2 2 9\n1 2 3 10", "outside 0"),
        (b"P2 2 2 255\n1 2 3 99999999999999999999", "other than numbers"),
        (b"P2 2 2 255\n1 2 3 " + b"9" * 5000, "other than numbers"),
        (b"P5 2 2 9\n\1\2\3\x0a", "above its maxval 9"),
        (b"P5 0 2 255\n", "at least one pixel"),
        (b"P5 2 0 255\n", "at least one pixel"),
        (b"P5 999999999 999999999 255\n", "at most 1000 pixels"),
    ],
)
def test_what_is_refused_and_why(tmp_path, data, says):
    with pytest.raises(MapError, match=says):
        pixels(tmp_path, data)
