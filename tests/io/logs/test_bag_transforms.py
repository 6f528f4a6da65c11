"""Where the sensor of a bag sits, and where its odometry comes from."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from firstfix.core.errors import ScanError
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.io.logs.bag import load_bag


def turned(yaw: float) -> tuple[float, float, float, float]:
    return (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def turned_over(yaw: float) -> tuple[float, float, float, float]:
    return (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0)  # Rz(yaw) Rx(π)


def pitched(pitch: float) -> tuple[float, float, float, float]:
    return (0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2))


@pytest.mark.parametrize("yaw", [-2.0, 0.0, 0.6])
def test_scans_of_an_upside_down_sensor_agree_with_rotations_in_space(bag, yaw: float) -> None:
    bag.tf("base_link", "laser", (0.2, 0.1, 0.3), turned_over(yaw))
    bag.scan(1.0, ranges=(1.0, 2.0, 3.0), angle_min=0.3)
    scan = load_bag(bag.write()).scans[0]
    assert scan.mounting is Mounting.UPSIDE_DOWN
    c, s = math.cos(yaw), math.sin(yaw)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.diag([1.0, -1.0, -1.0])
    a = np.array([0.3, 0.8, 1.3])
    r = np.array([1.0, 2.0, 3.0])
    points = np.column_stack([r * np.cos(a), r * np.sin(a), 0 * a]) @ R.T + [0.2, 0.1, 0.3]
    assert_allclose(scan.points(), points[:, :2], atol=1e-6)


def test_transforms_chain_in_space_and_either_way(bag) -> None:
    bag.tf("base_link", "camera", (1.0, 0.0, 0.5), (-0.5, 0.5, -0.5, 0.5))  # an optical frame
    bag.tf("laser", "camera", (0.0, 0.2, 0.0), (-0.5, 0.5, -0.5, 0.5))
    bag.scan(1.0)
    scan = load_bag(bag.write()).scans[0]
    assert_allclose(scan.T_base_laser.as_array(), [1.0, -0.2, 0.0], atol=1e-12)


def test_ros1_repeats_static_transforms_and_puts_slashes(ros1) -> None:
    for i in range(5):
        kind = "tf/msg/tfMessage"
        ros1.tf("/base_link", "/laser", (0.2, 0.0, 0.0), stamp=1.0 + i, topic="/tf", kind=kind)
        ros1.tf("/odom", "/base_link", (float(i), 0, 0), stamp=1.0 + i, topic="/tf", kind=kind)
        ros1.scan(1.0 + i, frame="/laser")
    recording = load_bag(ros1.write())
    assert recording.scans[0].T_base_laser == SE2(0.2, 0.0, 0.0)
    assert recording.odometry is not None
    assert len(recording.odometry) == 5


def test_a_sensor_that_moves_on_the_robot_has_no_place(bag) -> None:
    for i in range(3):
        bag.tf("base_link", "laser", q=turned(0.1 * i), stamp=1.0 + i, topic="/tf")
        bag.tf("odom", "base_link", (float(i), 0, 0), stamp=1.0 + i, topic="/tf")
        bag.scan(1.0 + i)
    recording = load_bag(bag.write())
    assert "no fixed transforms" in recording.notes[0]
    assert recording.odometry is None


def test_without_transforms_the_base_is_the_sensor_with_a_note(bag) -> None:
    bag.scan(1.0)
    bag.odometry(1.0, 0.0)
    recording = load_bag(bag.write())
    assert recording.scans[0].T_base_laser == SE2.identity()
    assert recording.odometry is None
    assert "no fixed transforms lead from the base to laser" in recording.notes[0]
    assert "/odom has no frame" in recording.notes[1]


def test_scans_in_the_frame_of_the_base_need_no_transform(bag) -> None:
    bag.scan(1.0, frame="base_link")
    recording = load_bag(bag.write())
    assert recording.scans[0].T_base_laser == SE2.identity()
    assert recording.notes == ()


def test_odometry_messages_serve_where_transforms_are_missing(bag) -> None:
    bag.tf("base_link", "laser", (0.2, 0.0, 0.0))
    for i in range(3):
        bag.scan(1.0 + i)
        bag.odometry(1.0 + i, 2.0 * i)
        bag.odometry(1.0 + i, -9.0, topic="/another")
    recording = load_bag(bag.write())
    assert recording.odometry is not None
    assert_array_equal(recording.odometry.poses[:, 0], [0, 2, 4])
    assert "odometry is from /odom" in recording.notes[0]


def test_transforms_are_preferred_to_odometry_messages(bag) -> None:
    bag.robot().odometry(1.0, 77.0)
    odometry = load_bag(bag.write()).odometry
    assert odometry is not None
    assert odometry.poses[:, 0].max() == 2.0


def test_odometry_of_the_footprint_is_taken_to_the_base(bag) -> None:
    bag.tf("base_footprint", "base_link", (0.5, 0.0, 0.1))
    bag.tf("base_link", "laser", (0.2, 0.0, 0.0))
    for i in range(2):
        bag.tf("odom", "base_footprint", q=turned(i * math.pi / 2), stamp=1.0 + i, topic="/tf")
        bag.scan(1.0 + i)
    recording = load_bag(bag.write())
    assert recording.scans[0].T_base_laser == SE2(0.2, 0.0, 0.0)
    assert recording.odometry is not None
    assert_allclose(recording.odometry.poses[1], [0.0, 0.5, math.pi / 2], atol=1e-12)


def test_a_base_of_any_name_is_known_by_its_odometry(bag) -> None:
    bag.tf("chassis", "laser", (0.2, 0.0, 0.0))
    bag.odometry(1.0, 0.0, child="chassis")
    bag.scan(1.0)
    recording = load_bag(bag.write())
    assert recording.scans[0].T_base_laser == SE2(0.2, 0.0, 0.0)
    assert recording.odometry is not None


def test_odometry_is_sorted_and_each_stamp_is_kept_once(bag) -> None:
    bag.tf("base_link", "laser")
    bag.scan(1.0)
    for stamp, x in ((2.0, 2.0), (1.0, 1.0), (2.0, 2.0), (3.0, math.nan), (4.0, 4.0)):
        bag.tf("odom", "base_link", (x, 0.0, 0.0), stamp=stamp, topic="/tf")
    odometry = load_bag(bag.write()).odometry
    assert odometry is not None
    assert_array_equal(odometry.stamps, [1, 2, 4])
    assert_array_equal(odometry.poses[:, 0], [1, 2, 4])


def test_poses_of_a_localizer_are_not_ground_truth(bag) -> None:
    bag.robot().tf("map", "odom", (5.0, 0.0, 0.0), topic="/tf")
    recording = load_bag(bag.write())
    assert recording.truth is None
    assert recording.odometry is not None
    assert recording.odometry.poses[0, 0] == 0.0


def test_two_sensors_on_one_topic_each_have_their_place(bag) -> None:
    bag.tf("base_link", "front", (0.3, 0.0, 0.0))
    bag.tf("base_link", "rear", (-0.3, 0.0, 0.0), turned(math.pi))
    bag.scan(1.0, frame="front")
    bag.scan(2.0, frame="rear")
    places = [scan.T_base_laser.x for scan in load_bag(bag.write()).scans]
    assert places == [0.3, -0.3]


def test_two_sensors_on_one_topic_are_refused_without_transforms(bag) -> None:
    bag.scan(1.0, frame="front")
    bag.scan(2.0, frame="rear")
    with pytest.raises(ScanError, match="scans in the frames front, rear"):
        load_bag(bag.write())


def test_a_slight_tilt_is_noted_and_a_steep_one_rejected(bag) -> None:
    bag.tf("base_link", "slight", q=pitched(math.radians(10)))
    bag.tf("base_link", "steep", q=pitched(math.radians(90)))
    bag.scan(1.0, frame="slight", topic="/slight")
    bag.scan(1.0, frame="steep", topic="/steep")
    path = bag.write()
    assert "slight is tilted by 10°" in load_bag(path, topic="/slight").notes[0]
    with pytest.raises(ScanError, match="steep tilted by 90°"):
        load_bag(path, topic="/steep")
