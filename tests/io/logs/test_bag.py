"""Recordings from ROS bags of both ROS and all storages: which scans, in which order."""

import math
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from firstfix.core.errors import ScanError
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.io.logs.bag import load_bag
from firstfix.io.logs.bag_file import SCAN, BagFile


def test_scans_come_with_the_place_of_their_sensor_and_odometry(bag) -> None:
    recording = load_bag(bag.robot().write())
    assert [scan.stamp for scan in recording.scans] == [1, 2, 3]
    scan = recording.scans[0]
    assert_allclose(scan.ranges, [1, 2, 3])
    assert_allclose(scan.bearings, [-0.5, 0.0, 0.5])
    assert_allclose(scan.T_base_laser.as_array(), [0.2, 0.1, math.pi / 2])
    assert scan.mounting is Mounting.UPRIGHT
    assert (scan.range_min, scan.range_max) == pytest.approx((0.1, 10.0))
    assert recording.odometry is not None
    assert_array_equal(recording.odometry.stamps, [1, 2, 3])
    assert_array_equal(recording.odometry.poses, [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    assert recording.truth is None
    assert recording.notes == ()


def test_bare_storage_files_are_bags_too(new_bag, tmp_path: Path) -> None:
    for storage, suffix in (("sqlite3", ".db3"), ("mcap", ".mcap")):
        path = new_bag(storage, tmp_path / storage).robot().write()
        assert len(load_bag(next(path.glob(f"*{suffix}")))) == 3


def test_a_clockwise_sensor_keeps_its_bearings(bag) -> None:
    bag.tf("base_link", "laser")
    bag.scan(1.0, angle_min=0.5, increment=-0.5)
    assert_allclose(load_bag(bag.write()).scans[0].bearings, [0.5, 0.0, -0.5])


def test_scans_are_sorted_by_stamp(bag) -> None:
    bag.tf("base_link", "laser")
    for stamp, at in ((1.0, 1.0), (3.0, 2.0), (2.0, 3.0)):
        bag.scan(stamp, ranges=(stamp,) * 3, at=at)
    recording = load_bag(bag.write())
    assert [float(scan.ranges[0]) for scan in recording.scans] == [1, 2, 3]
    assert "sorted by stamp" in recording.notes[0]


def test_scans_without_a_stamp_get_the_time_of_recording(bag) -> None:
    bag.tf("base_link", "laser")
    bag.scan(0.0, at=5.0)
    recording = load_bag(bag.write())
    assert recording.scans[0].stamp == pytest.approx(5.0)
    assert "no stamp" in recording.notes[0]


def test_of_several_topics_scan_is_taken(bag) -> None:
    bag.scan(1.0, topic="/rear/scan", frame="base_link")
    bag.scan(2.0, topic="/scan", frame="base_link")
    path = bag.write()
    assert load_bag(path).scans[0].stamp == 2
    assert load_bag(path, topic="/rear/scan").scans[0].stamp == 1
    assert load_bag(path, topic="rear/scan").scans[0].stamp == 1
    with pytest.raises(ScanError, match=r"on the topic /tf.*/rear/scan \(sensor_msgs"):
        load_bag(path, topic="/tf")


def test_several_topics_without_a_scan_must_be_chosen_from(bag) -> None:
    bag.scan(1.0, topic="/front")
    bag.scan(2.0, topic="/rear")
    with pytest.raises(ScanError, match=r"/front .*/rear .*name one topic"):
        load_bag(bag.write())


def test_a_bag_without_scans_lists_what_it_has(bag) -> None:
    bag.odometry(1.0, 0.0)
    with pytest.raises(ScanError, match=r"the topics /odom \(nav_msgs"):
        load_bag(bag.write())


def test_only_the_first_scans_are_read_on_request(bag) -> None:
    bag.robot(8)
    bag.scan(9.0, increment=0.0)
    path = bag.write()
    recording = load_bag(path, max_scans=2)
    assert len(recording) == 2
    assert recording.odometry is not None
    # Enough to interpolate at the last scan, not the whole drive.
    assert recording.odometry.at(2.0) is not None
    assert recording.odometry.stamps[-1] < 5.0
    with pytest.raises(ScanError, match=r"angle_increment 0.0 in scan 8 on /scan in .*drive"):
        load_bag(path)


def test_the_first_scans_are_the_first_by_stamp(bag) -> None:
    late = [3.0, 1.0, 5.0, 2.0, 4.0, 6.0]
    for i, stamp in enumerate(late):
        bag.scan(stamp, at=10.0 + i)
    path = bag.write()
    for n in range(1, len(late) + 1):
        recording = load_bag(path, max_scans=n)
        assert [scan.stamp for scan in recording.scans] == sorted(late)[:n]
        assert "sorted by stamp" in recording.notes[-1]


@pytest.mark.parametrize("name", ["drive", "drive/drive.db3"])
def test_reading_a_ros2_bag_writes_no_files(new_bag, tmp_path: Path, name: str) -> None:
    """Also with a write-ahead log, which rosbag2 uses, and in a read-only folder."""
    folder = new_bag("sqlite3", tmp_path / "drive").robot().write()
    with closing(sqlite3.connect(folder / "drive.db3")) as database:
        assert database.execute("PRAGMA journal_mode=WAL").fetchone() == ("wal",)
    before = sorted(path.name for path in folder.iterdir())
    seen = set()
    folder.chmod(0o500)
    try:
        with BagFile(tmp_path / name) as bag:
            for _ in bag.messages(SCAN, ["/scan"]):
                seen.add(tuple(sorted(path.name for path in folder.iterdir())))
        assert len(load_bag(tmp_path / name)) == 3
    finally:
        folder.chmod(0o700)
    assert seen == {tuple(before)}
    assert (
        sorted(path.name for path in folder.iterdir()) == before == ["drive.db3", "metadata.yaml"]
    )


@pytest.mark.shared
@pytest.mark.parametrize(
    ("name", "topic", "case", "n", "place"),
    [
        ("uob_trace0.bag", "/base_scan", "uob_cs_test0", 958, (0.135, 0.0, 0.0)),
        ("olin_ros2", "/scan", "olin_mac1_9_23", 357, (0.00393584, 0.0, math.pi / 2)),
    ],
)
def test_real_bags_hold_what_their_cases_hold(
    shared: Path, name: str, topic: str, case: str, n: int, place: tuple[float, ...]
) -> None:
    recording = load_bag(shared / "bags" / name)
    expected = np.load(shared / "cases" / case / "scans.npz")
    ranges, odometry = expected["ranges"], expected["odom"]  # unpacked once
    assert len(recording) == n
    assert recording.notes == ()
    assert len(load_bag(shared / "bags" / name, topic=topic, max_scans=3)) == 3
    assert recording.odometry is not None
    by_stamp = {scan.stamp: scan for scan in recording.scans}
    for i, stamp in enumerate(expected["stamp"].tolist()):
        scan = by_stamp[stamp]
        assert scan.T_base_laser.distance_to(SE2(*place)) < 1e-9
        hit = np.isfinite(ranges[i])
        assert np.array_equal(scan.ranges[hit], ranges[i][hit])
        # The case has the sensor's odometry: this checks the place and the frames at once.
        T_odom_base = recording.odometry.at(stamp)
        assert (
            T_odom_base is None
            or (T_odom_base @ scan.T_base_laser).distance_to(SE2.from_array(odometry[i])) < 1e-4
        )
