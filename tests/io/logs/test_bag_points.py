"""Bags with point clouds and depth images."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from firstfix.core.errors import ScanError
from firstfix.io.logs.load import load_recording

CLOUD = "sensor_msgs/msg/PointCloud2"
IMAGE = "sensor_msgs/msg/Image"
INFO = "sensor_msgs/msg/CameraInfo"

# z of the optical frame forward, x to the right.
OPTICAL = (-0.5, 0.5, -0.5, 0.5)


def add_cloud(bag, stamp, xyz):
    data = np.asarray(xyz, "<f4")
    fields = [
        bag.new("sensor_msgs/msg/PointField", name=name, offset=4 * i, datatype=7, count=1)
        for i, name in enumerate("xyz")
    ]
    message = bag.new(
        CLOUD,
        header=bag.header("velodyne", stamp),
        height=1,
        width=len(data),
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=12 * len(data),
        data=data.view(np.uint8).ravel(),
        is_dense=True,
    )
    bag.entries.append(("/points", CLOUD, stamp, message))


def add_depth(bag, stamp, depth):
    pixels = (1e3 * np.asarray(depth)).astype("<u2")
    height, width = pixels.shape
    header = bag.header("camera_optical", stamp)
    message = bag.new(
        IMAGE,
        header=header,
        height=height,
        width=width,
        encoding="16UC1",
        is_bigendian=0,
        step=2 * width,
        data=pixels.view(np.uint8).ravel(),
    )
    bag.entries.append(("/camera/depth", IMAGE, stamp, message))


def add_info(bag, width, height):
    f, cx, cy = 100.0, (width - 1) / 2, (height - 1) / 2
    arrays = {
        "d": np.zeros(5),
        "k": np.array([f, 0, cx, 0, f, cy, 0, 0, 1.0]),
        "r": np.eye(3).ravel(),
        "p": np.zeros(12),
    }
    if bag.storage == "ros1":
        arrays = {name.upper(): array for name, array in arrays.items()}
    roi = bag.new(
        "sensor_msgs/msg/RegionOfInterest",
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False,
    )  # fmt: skip
    message = bag.new(
        INFO,
        header=bag.header("camera_optical", 1.0),
        height=height,
        width=width,
        distortion_model="plumb_bob",
        binning_x=0,
        binning_y=0,
        roi=roi,
        **arrays,
    )
    bag.entries.append(("/camera/camera_info", INFO, 1.0, message))


def robot(bag, frame, xyz, q=(0.0, 0.0, 0.0, 1.0)):
    bag.tf("base_link", frame, xyz, q)
    for i in range(3):
        bag.tf("odom", "base_link", (float(i), 0.0, 0.0), stamp=1.0 + i, topic="/tf")


def test_a_cloud_becomes_a_scan_without_the_ground(bag) -> None:
    pitch = 0.1
    robot(bag, "velodyne", (0.2, 0.0, 0.5), (0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2)))
    c, s = math.cos(pitch), math.sin(pitch)
    in_base = np.array([[3.2, 0.01, 0.5], [2.2, 0.01, 0.0]]) - [0.2, 0.0, 0.5]
    tilted = in_base @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    for stamp in (1.0, 2.0, 3.0):
        add_cloud(bag, stamp, tilted)
    path = bag.write()
    recording = load_recording(path, topic="/points")
    assert [scan.stamp for scan in recording.scans] == [1.0, 2.0, 3.0]
    assert_allclose(recording.scans[0].points(), [[3.2, 0.01]], atol=0.02)
    assert len(recording.odometry) == 3
    assert len(load_recording(path, topic="points", max_scans=2)) == 2


def test_a_depth_image_becomes_a_scan(bag) -> None:
    robot(bag, "camera_optical", (0.1, 0.0, 0.6), OPTICAL)
    add_info(bag, 64, 48)
    add_depth(bag, 1.5, np.full((48, 64), 2.0))
    (scan,) = load_recording(bag.write(), topic="/camera/depth").scans
    ends = scan.points()
    assert len(ends) > 60
    assert_allclose(ends[:, 0], 2.1, atol=0.01)
    assert_allclose([ends[:, 1].min(), ends[:, 1].max()], [-0.63, 0.63], atol=0.02)
    assert math.degrees(abs(scan.angle_increment) * len(scan)) == pytest.approx(35.5, abs=0.6)


def test_depth_without_camera_info_is_refused(bag) -> None:
    robot(bag, "camera_optical", (0.1, 0.0, 0.6), OPTICAL)
    add_depth(bag, 1.5, np.full((4, 4), 2.0))
    with pytest.raises(ScanError, match="no /camera/camera_info"):
        load_recording(bag.write(), topic="/camera/depth")


def test_a_cloud_of_unknown_height_is_refused(bag) -> None:
    add_cloud(bag, 1.0, [[1.0, 0.0, 0.0]])
    path = bag.write()
    with pytest.raises(ScanError, match="heights of points on /points are unknown"):
        load_recording(path, topic="/points")
    with pytest.raises(ScanError, match="--laser-pose has none"):
        load_recording(path, topic="/points", T_base_laser=(0.0, 0.0, 0.0))


def test_clouds_are_read_where_they_are_named_only(bag) -> None:
    robot(bag, "velodyne", (0.0, 0.0, 0.5))
    add_cloud(bag, 1.0, [[1.0, 0.0, 0.0]])
    bag.scan(1.0, frame="base_link")
    assert len(load_recording(bag.write()).scans[0]) == 3


def test_a_damaged_cloud_is_named_by_its_number(bag) -> None:
    robot(bag, "velodyne", (0.0, 0.0, 0.5))
    add_cloud(bag, 1.0, [[1.0, 0.0, 0.0]])
    bag.entries[-1][3].width = 7
    with pytest.raises(
        ScanError, match="message 0 on /points: The point cloud states 1 rows of 84 bytes"
    ):
        load_recording(bag.write(), topic="/points")
