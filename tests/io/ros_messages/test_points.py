"""Messages of 3D LIDARs and depth cameras."""

from __future__ import annotations

import math
from types import SimpleNamespace as Message

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from firstfix.core.errors import ScanError
from firstfix.io.ros_messages.points import to_depth_points, to_points

XYZ = np.array([[1.0, 2.0, 3.0], [np.nan, 0.0, 1.0], [4.0, 5.0, 6.0], [-1.0, 0.5, 0.25]])


def cloud(xyz=XYZ, *, order="<", float_kind="f4", before=4, after=6, rows=1, padding=0, **changes):
    """A cloud with other fields around the coordinates, and padding behind each row."""
    kinds = {"f4": 7, "f8": 8}
    size = np.dtype(float_kind).itemsize
    step = before + 3 * size + after
    kind = np.dtype(
        {
            "names": list("xyz"),
            "formats": [order + float_kind] * 3,
            "offsets": [before + i * size for i in range(3)],
            "itemsize": step,
        }
    )
    points = np.zeros(len(xyz), kind)
    for i, name in enumerate("xyz"):
        points[name] = xyz[:, i]
    width = len(xyz) // rows
    data = points.view(np.uint8).reshape(rows, width * step) if len(xyz) else np.empty((0, 0))
    data = np.pad(data, ((0, 0), (0, padding)), constant_values=255).astype(np.uint8)
    message = {
        "fields": [
            Message(name=name, offset=before + i * size, datatype=kinds[float_kind], count=1)
            for i, name in enumerate("xyz")
        ],
        "is_bigendian": order == ">",
        "point_step": step,
        "row_step": width * step + padding,
        "width": width,
        "height": rows,
        "data": data.ravel(),
    }
    return Message(**message | changes)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("float_kind", ["f4", "f8"])
@pytest.mark.parametrize("shape", [{}, {"rows": 2}, {"rows": 2, "padding": 3}, {"after": 0}])
def test_points_of_every_layout_are_the_same(order, float_kind, shape):
    points = to_points(cloud(order=order, float_kind=float_kind, **shape))
    assert_array_equal(points, XYZ.astype(np.float32))


@pytest.mark.parametrize("convert", [bytes, bytearray, lambda data: data])
def test_data_of_every_client_library_is_read(convert):
    message = cloud()
    message.data = convert(message.data)
    assert_array_equal(to_points(message), XYZ.astype(np.float32))


def test_a_cloud_without_points_has_none():
    assert to_points(cloud(np.empty((0, 3)))).shape == (0, 3)


def test_a_million_points_are_read():
    xyz = np.random.default_rng(0).normal(size=(1_000_000, 3)).astype(np.float32)
    assert_array_equal(to_points(cloud(xyz)), xyz)


def test_the_last_row_may_lack_its_padding():
    message = cloud(rows=2, padding=8)
    message.data = message.data[:-8]
    assert len(to_points(message)) == 4


def without_z(message):
    message.fields = message.fields[:2]


def with_whole_numbers(message):
    message.fields[0].datatype = 4


def with_too_little(message):
    message.data = message.data[:-1]


def with_a_short_step(message):
    message.point_step = 8


def with_overlapping_rows(message):
    message.row_step = 3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (without_z, r"no float field z \(its fields: x, y\)"),
        (with_whole_numbers, "no float field x"),
        (with_too_little, "has 87 bytes"),
        (with_a_short_step, "A point of 8 bytes cannot hold"),
        (with_overlapping_rows, "each 3 bytes"),
    ],
)
def test_a_damaged_cloud_is_refused_in_one_sentence(change, words):
    message = cloud(rows=2)
    change(message)
    with pytest.raises(ScanError, match=words) as caught:
        to_points(message)
    assert "\n" not in str(caught.value)


def image(depth_m, encoding="16UC1", *, order="<", padding=0):
    kind, unit = ("u2", 1e-3) if encoding != "32FC1" else ("f4", 1.0)
    depth = np.atleast_2d(np.asarray(depth_m, np.float64))
    pixels = (depth / unit).round(6).astype(order + kind)
    data = pixels.view(np.uint8).reshape(len(depth), -1)
    return Message(
        encoding=encoding,
        is_bigendian=order == ">",
        width=depth.shape[1],
        height=depth.shape[0],
        step=data.shape[1] + padding,
        data=np.pad(data, ((0, 0), (0, padding))).ravel(),
    )


def camera(width, height, f=100.0, *, name="k"):
    matrix = [f, 0.0, (width - 1) / 2, 0.0, f, (height - 1) / 2, 0.0, 0.0, 1.0]
    return Message(width=width, height=height, **{name: np.array(matrix).tolist()})


@pytest.mark.parametrize("encoding", ["16UC1", "mono16", "32FC1"])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("name", ["k", "K"])
def test_depth_is_along_the_optical_axis(encoding, order, name):
    depth = [[1.0, 2.0, 0.0], [1.5, 2.5, 3.5]]
    points, view = to_depth_points(
        image(depth, encoding, order=order, padding=6), camera(3, 2, name=name)
    )
    known = np.array(depth) > 0.0
    assert_allclose(points[..., 2][known], np.array(depth)[known], rtol=1e-6)
    assert np.isnan(points[0, 2]).all()
    assert_allclose(points[1, 0], [-0.015, 0.0075, 1.5], atol=1e-6)
    assert_allclose(view, [math.atan2(1.5, 100.0)] * 2)


@pytest.mark.parametrize(
    ("message", "info", "words"),
    [
        (image([[1.0]]), camera(2, 1), "1 x 1 pixels, its camera info 2 x 1"),
        (image([[1.0]]), camera(1, 1, f=0.0), "no focal length"),
        (Message(encoding="rgb8"), camera(1, 1), "'rgb8' is not that of a depth image"),
    ],
)
def test_an_image_that_is_no_depth_is_refused(message, info, words):
    with pytest.raises(ScanError, match=words):
        to_depth_points(message, info)


def test_a_short_image_is_refused():
    message = image(np.ones((2, 2)))
    message.data = message.data[:-1]
    with pytest.raises(ScanError, match="depth image states 2 rows"):
        to_depth_points(message, camera(2, 2))
