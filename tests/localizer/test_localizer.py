"""The localizer as its users see it: inputs in, poses and reasons out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.localizer.outputs import Hypotheses, InitialPose, MotionRequest, Status, TrackedPose
from firstfix.localizer.states import State

HERE = SE2(4.0, 3.0, 1.0)  # where `in_hall` stands
IN_A_ROOM = SE2(10.5, 1.2, 0.3)
BEHIND = SE2(2.5, 2.0, 0.0)  # in `two_rooms`, facing away from what differs
A_STEP, A_TURN = SE2(0.05, 0.0, 0.05), SE2(0.0, 0.0, 0.1)


# ---- found at once, and tracked


@pytest.mark.parametrize("seed", range(4))
def test_the_first_scan_finds_the_robot_and_all_others_track_it(
    robot_in, office, seed, of, kinds, poses, is_at, office_poses
):
    robot = robot_in(office, office_poses(office, 1, seed)[0], seed=seed)
    for k in range(25):
        outputs = robot.tick(A_STEP if k else None)
        assert kinds(outputs) == ([InitialPose] if k == 0 else []) + [TrackedPose, Status]
        assert {output.stamp for output in outputs} == {robot.stamp}
        for found in poses(outputs):
            assert is_at(found.T_map_base, robot.pose)
            assert np.linalg.eigvalsh(found.covariance).min() > 0.0
        (tracked,) = of(TrackedPose, outputs)
        assert is_at(tracked.T_map_odom @ robot.T_odom_base, tracked.T_map_base, 1e-9, 1e-7)
        (status,) = of(Status, outputs)
        assert status.state is State.LOCALIZED
        assert status.evidence.explained > 0.9


def test_a_drive_with_drifting_wheels_is_followed(robot_in, driven, hall_plan, of, is_at):
    robot = robot_in(hall_plan, HERE)
    odometry = driven.odometry
    for scan, stamp, counted, truth in zip(
        driven.scans, odometry.stamps.tolist(), odometry.poses, driven.truth, strict=True
    ):
        robot.send(Odometry(stamp, SE2.from_array(counted)))
        (tracked,) = of(TrackedPose, robot.send(scan))
        assert is_at(tracked.T_map_base, SE2.from_array(truth), 0.1, 4.0)
    assert len(of(InitialPose, robot.outputs)) == 1


def test_the_pose_of_a_scan_does_not_wait_for_the_search_in_the_background(
    robot_in, driven, hall_plan, of
):
    robot = robot_in(hall_plan, HERE)
    settled_at, weighed_later = 5, 0
    for scan, stamp, counted in zip(
        driven.scans, driven.odometry.stamps.tolist(), driven.odometry.poses, strict=True
    ):
        before = robot.localizer.belief
        robot.send(Odometry(stamp, SE2.from_array(counted)))
        views_before = len(before.window) if before else 0
        is_settled = views_before >= settled_at
        weighed_later += is_settled and robot.localizer.belief.window != before.window
        window = robot.localizer.belief.window
        assert of(TrackedPose, robot.send(scan))
        if is_settled:
            assert robot.localizer.belief.window == window
    assert weighed_later >= 1


# ---- scans and odometry meet by their stamps


def test_a_scan_waits_until_odometry_reaches_it(in_hall, of, with_ranges):
    covered = with_ranges(lambda _: np.nan)  # leaves the pose to odometry
    in_hall.tick(damage=covered)
    T_map_odom = of(TrackedPose, in_hall.outputs)[-1].T_map_odom
    in_hall.stamp += 0.1
    scan, T_odom_base = covered(in_hall.scan()), in_hall.T_odom_base
    assert in_hall.send(scan) == []
    assert in_hall.send(Odometry(scan.stamp - 0.02, T_odom_base)) == []
    outputs = in_hall.send(Odometry(scan.stamp + 0.02, T_odom_base @ SE2(0.2, 0.0, 0.0)))
    (tracked,) = of(TrackedPose, outputs)
    assert tracked.stamp == scan.stamp
    # Half the way: at the time of the scan, not of the message.
    expected = T_map_odom @ T_odom_base @ SE2(0.1, 0.0, 0.0)
    assert tracked.T_map_base.distance_to(expected) < 1e-6


def test_without_odometry_there_is_no_output(robot_in, hall_plan):
    robot = robot_in(hall_plan, HERE)
    assert robot.send(robot.scan()) == []
    assert robot.localizer.state is State.SEARCHING


def test_of_the_scans_that_wait_the_newest_wins(in_hall, of):
    waiting = []
    for _ in range(3):
        in_hall.stamp += 0.1
        waiting.append(in_hall.scan())
        assert in_hall.send(waiting[-1]) == []
    outputs = in_hall.send(Odometry(in_hall.stamp, in_hall.T_odom_base))
    assert [tracked.stamp for tracked in of(TrackedPose, outputs)] == [waiting[-1].stamp]
    later = Odometry(in_hall.stamp + 1.0, in_hall.T_odom_base)
    assert in_hall.send(later) == []  # the others are gone


def test_a_scan_older_than_all_odometry_is_skipped_and_reported(in_hall):
    old = dataclasses.replace(in_hall.scan(), stamp=50.0)
    (status,) = in_hall.send(old)
    assert "older" in status.reason
    assert "left out" in status.reason
    assert status.stamp == 50.0
    assert in_hall.localizer.state is State.LOCALIZED


# ---- several places


def test_identical_places_are_listed_and_none_is_published(robot_in, three_rooms, of, kinds, poses):
    robot = robot_in(three_rooms, IN_A_ROOM)
    outputs = robot.tick()
    assert kinds(outputs) == [Hypotheses, Status]  # no motion inside would help
    (status,) = of(Status, outputs)
    reported = "3 places look identical to this sensor; no motion of up to 3 m would decide"
    assert status.reason == reported
    assert robot.localizer.state is State.DISAMBIGUATING
    rooms = [place.pose.x - IN_A_ROOM.x for place in outputs[0].places if place.probability > 0.1]
    assert sorted(round(x) for x in rooms) == [-8, 0, 8]
    assert sum(place.probability for place in outputs[0].places) == pytest.approx(1.0, abs=0.05)
    robot.ticks(30)
    robot.ticks(120, A_TURN)
    assert poses(robot.outputs) == []
    (*_, last) = of(Hypotheses, robot.outputs)
    shares = [place.probability for place in last.places[:3]]
    assert min(shares) > 0.1
    assert sum(shares) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("room", [0.0, 7.0])
@pytest.mark.parametrize("seed", range(2))
def test_the_requested_motion_decides(
    robot_in, two_rooms, half_lidar, room, seed, of, kinds, poses, is_at
):
    robot = robot_in(two_rooms, SE2(room, 0.0, 0.0) @ BEHIND, lidar=half_lidar, seed=seed)
    outputs = robot.tick()
    assert kinds(outputs) == [Hypotheses, Status, MotionRequest]
    motion = outputs[-1]
    robot.ticks(10)
    assert poses(robot.outputs) == []
    robot.ticks(20, SE2(0.0, 0.0, motion.turn / 20))
    robot.ticks(20, SE2(motion.ahead / 20, 0.0, 0.0))
    robot.ticks(20, SE2(0.0, 0.0, motion.turn / 20))
    (found,) = of(InitialPose, robot.outputs)
    assert robot.localizer.state is State.LOCALIZED
    assert all(
        is_at(tracked.T_map_base, robot.pose) for tracked in of(TrackedPose, robot.outputs)[-1:]
    )
    assert abs(found.T_map_base.x - room - BEHIND.x) < 1.5


# ---- nothing fits


def test_a_wrong_map_is_searched_once_a_second_at_rest(foreign, searches, of, kinds):
    robot = foreign
    searches.clear()
    before = len(robot.outputs)
    robot.ticks(30)
    assert np.diff(searches).min() > 0.99
    assert len(searches) == 3
    assert kinds(robot.outputs[before:]) == [Status] * 3
    for status in of(Status, robot.outputs):
        assert status.state is State.SEARCHING
        assert "no place of the map explains" in status.reason
        assert status.evidence.explained < 0.8
        assert status.rivals == 0
        assert status.elsewhere > 0.5
    # A robot that moves sees something else, which is worth a search of its own.
    searches.clear()
    robot.ticks(5, SE2(0.31, 0.0, 0.0))
    assert len(searches) == 5
