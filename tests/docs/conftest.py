"""The files that the commands of the pages name."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer

import firstfix as ff
from firstfix.io.ros_messages.outgoing import header, transforms

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))
from ros1_bag import STORE, make

BASE, LASER, CAMERA = "chassis", "lidar_link", "camera_optical"
DEPTH = "/camera/depth/image_rect_raw"
# z of the optical frame forward, x to the right, half a metre above the floor.
OPTICAL = {"x": -0.5, "y": 0.5, "z": -0.5, "w": 0.5}
WIDTH, HEIGHT, FOCAL = 64, 4, 50.0


class BagWriter:
    """A bag of ROS 1 that is being written."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._connections: dict[str, Any] = {}

    def add(self, topic: str, stamp: float, message: Any) -> None:
        kind = message.__msgtype__
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, kind, typestore=STORE)
        data = STORE.serialize_ros1(message, kind)
        self._writer.write(self._connections[topic], round(1e9 * stamp), data)


@contextmanager
def begin_bag(path: Path, drive: ff.Recording) -> Iterator[tuple[BagWriter, ff.Recording]]:
    """Begin a bag with the odometry of a drive."""
    with Writer(path) as writer:
        begun = BagWriter(writer)
        assert drive.odometry is not None
        for stamp, row in zip(drive.odometry.stamps, drive.odometry.poses, strict=True):
            begun.add("/tf", stamp, transforms(make, stamp, "odom", BASE, ff.SE2(*row)))
        yield begun, drive


def add_scans(bag: BagWriter, drive: ff.Recording, topic: str, frame: str) -> None:
    """Add all scans as those of a laser with a frame of its own."""
    first = drive.scans[0]
    T = first.T_base_laser
    bag.add("/tf_static", first.stamp, transforms(make, first.stamp, BASE, frame, T))
    for scan in drive.scans:
        message = make(
            "sensor_msgs/LaserScan",
            header=header(make, scan.stamp, frame),
            angle_min=scan.angle_min,
            angle_max=scan.angle_min + scan.angle_increment * (len(scan.ranges) - 1),
            angle_increment=scan.angle_increment,
            time_increment=0.0,
            scan_time=0.1,
            range_min=scan.range_min,
            range_max=scan.range_max,
            ranges=np.asarray(scan.ranges, np.float32),
            intensities=np.zeros(0, np.float32),
        )
        bag.add(topic, scan.stamp, message)


def add_depth_images(bag: BagWriter, drive: ff.Recording) -> None:
    """Add what a depth camera beside the laser sees: its walls, from bottom to top."""
    stamp = drive.scans[0].stamp
    mounted = transforms(make, stamp, BASE, CAMERA, drive.scans[0].T_base_laser)
    mounted.transforms[0].transform.translation.z = 0.5
    mounted.transforms[0].transform.rotation = make("geometry_msgs/Quaternion", **OPTICAL)
    bag.add("/tf_static", stamp, mounted)
    bearings = np.arctan((WIDTH / 2 - np.arange(WIDTH)) / FOCAL)
    nothing = make(
        "sensor_msgs/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    for scan in drive.scans:
        head = header(make, scan.stamp, CAMERA)
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        depth = np.interp(bearings, angles, scan.ranges) * np.cos(bearings)
        row = np.where(np.isfinite(depth), 1e3 * depth, 0.0).astype("<u2")
        info = make(
            "sensor_msgs/CameraInfo",
            header=head, height=HEIGHT, width=WIDTH, distortion_model="plumb_bob",
            D=np.zeros(5), R=np.eye(3).ravel(), P=np.zeros(12),
            K=np.array([FOCAL, 0.0, WIDTH / 2, 0.0, FOCAL, HEIGHT / 2, 0.0, 0.0, 1.0]),
            binning_x=0, binning_y=0, roi=nothing,
        )  # fmt: skip
        image = make(
            "sensor_msgs/Image",
            header=head, height=HEIGHT, width=WIDTH, encoding="16UC1", is_bigendian=0,
            step=2 * WIDTH, data=np.tile(row, HEIGHT).view(np.uint8),
        )  # fmt: skip
        bag.add(f"{DEPTH.rpartition('/')[0]}/camera_info", scan.stamp, info)
        bag.add(DEPTH, scan.stamp, image)


@pytest.fixture(scope="module")
def files(
    hall_plan: ff.OccupancyGrid, driven: ff.Recording, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Give a folder with every file that a command of a page reads, of a small hall."""
    folder = tmp_path_factory.mktemp("files")
    for name in ("map", "older", "office", "rooms", "warehouse", "floors/ground", "floors/first"):
        (folder / name).parent.mkdir(exist_ok=True)
        ff.save_map(hall_plan, folder / f"{name}.yaml")
    zone = "zones: {warehouse: [[0, 0], [9, 0], [9, 7], [0, 7]]}\n"
    (folder / "map.zones.yaml").write_text(zone)
    for name in ("scans", "drive", "office", "rooms"):
        ff.save_recording(driven, folder / f"{name}.npz")
    for name in ("drive", "monday", "tuesday"):
        later = 86400.0 if name == "tuesday" else 0.0
        with begin_bag(folder / f"{name}.bag", moved_in_time(driven, later)) as (bag, drive):
            add_scans(bag, drive, "/scan", LASER)
            if name == "drive":
                add_scans(bag, drive, "/front/scan", "front")
                add_scans(bag, drive, "/rear/scan", "rear")
                add_depth_images(bag, drive)
    assert driven.truth is not None
    truth = ff.Trajectory(np.array([scan.stamp for scan in driven.scans]), driven.truth)
    ff.save_trajectory(truth, folder / "poses.tum")
    return folder


def moved_in_time(drive: ff.Recording, later: float) -> ff.Recording:
    """Return the same drive some seconds later."""
    assert drive.odometry is not None
    return replace(
        drive,
        scans=tuple(replace(scan, stamp=scan.stamp + later) for scan in drive.scans),
        odometry=ff.Trajectory(drive.odometry.stamps + later, drive.odometry.poses),
    )
