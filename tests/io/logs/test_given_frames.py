"""Bags whose frames or sensors a person has to name."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from firstfix.core.errors import ScanError
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.io.logs.load import load_recording


def test_a_given_pose_replaces_missing_transforms(bag) -> None:
    """Odometry is known though no transform connects it with the sensor."""
    for i in range(3):
        bag.odometry(1.0 + i, float(i), topic="/vesc/odom")
        bag.scan(1.0 + i)
    path = bag.write()
    assert load_recording(path).odometry is None
    recording = load_recording(path, T_base_laser=(0.2, 0.1, 0.5), mounting="upside_down")
    assert recording.scans[0].T_base_laser == SE2(0.2, 0.1, 0.5)
    assert recording.scans[0].mounting is Mounting.UPSIDE_DOWN
    assert_allclose(recording.odometry.poses[:, 0], [0.0, 1.0, 2.0])
    assert not any("--laser-pose" in note for note in recording.notes)


def test_a_given_pose_overrules_transforms(bag) -> None:
    recording = load_recording(bag.robot().write(), T_base_laser=SE2(1.0, 0.0, 0.0))
    assert recording.scans[0].T_base_laser == SE2(1.0, 0.0, 0.0)
    assert_allclose(recording.odometry.poses[:, 0], [0.0, 1.0, 2.0])


def test_a_bag_without_transforms_names_the_option(bag) -> None:
    bag.scan(1.0)
    (note,) = load_recording(bag.write()).notes
    assert "--laser-pose" in note


def test_given_frames_replace_those_of_the_messages(bag) -> None:
    bag.tf("chassis", "lidar_link", (0.3, 0.0, 0.0))
    bag.tf("odom", "chassis", stamp=1.0, topic="/tf")
    bag.scan(1.0, frame="wrong")
    recording = load_recording(bag.write(), base_frame="chassis", laser_frame="/lidar_link")
    assert_allclose(recording.scans[0].T_base_laser.as_array(), [0.3, 0.0, 0.0])
    assert recording.odometry is not None


def test_given_frames_that_are_not_connected_are_refused(bag) -> None:
    with pytest.raises(ScanError, match=r"fixed transforms from chassis to laser.*--laser-pose"):
        load_recording(bag.robot().write(), base_frame="chassis")


def test_only_bags_take_frames(tmp_path) -> None:
    path = tmp_path / "a.log"
    path.write_text("FLASER 1 1.0 0 0 0 0 0 0 1.0 a 1.0\n")
    with pytest.raises(ScanError, match="only bags need them"):
        load_recording(path, T_base_laser=(0.0, 0.0, 0.0))


def two_sensors(bag):
    bag.tf("base_link", "front", (0.4, 0.0, 0.0))
    bag.tf("base_link", "rear", (-0.4, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
    for i in range(3):
        bag.tf("odom", "base_link", (float(i), 0.0, 0.0), stamp=1.0 + i, topic="/tf")
        bag.scan(1.0 + i, topic="/front/scan", frame="front")
        bag.scan(1.05 + i, topic="/rear/scan", frame="rear", ranges=(4.0, 5.0, 6.0))
    return bag.write()


def test_several_topics_are_one_recording_in_the_order_of_time(bag) -> None:
    recording = load_recording(two_sensors(bag), topic=["/front/scan", "/rear/scan"])
    np.testing.assert_array_equal(recording.sensors, [0, 1, 0, 1, 0, 1])
    assert recording.instants() == [(0, 1), (2, 3), (4, 5)]
    front, rear = recording.scans[:2]
    assert (front.T_base_laser.x, rear.T_base_laser.x) == pytest.approx((0.4, -0.4))
    assert abs(rear.T_base_laser.yaw) == pytest.approx(math.pi)
    assert len(recording.odometry) == 3


def test_one_pose_cannot_be_that_of_two_sensors(bag) -> None:
    path = two_sensors(bag)
    with pytest.raises(ScanError, match="2 topics"):
        load_recording(path, topic=["/front/scan", "/rear/scan"], T_base_laser=(0.0, 0.0, 0.0))
