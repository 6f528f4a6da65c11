"""People, blocked sensors, restarted odometry and clocks, and invalid input do no harm."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.localizer.outputs import InitialPose, Status, TrackedPose
from firstfix.localizer.states import State

HERE = SE2(4.0, 3.0, 1.0)  # where `in_hall` stands
A_STEP, A_TURN = SE2(0.05, 0.0, 0.05), SE2(0.0, 0.0, 0.1)


# ---- people, and sensors that see nothing


@pytest.mark.slow
@pytest.mark.parametrize("together", [True, False])
def test_people_do_not_look_like_a_kidnap(
    robot_in, office, with_ranges, together, kinds, is_at, office_poses
):
    """A minute in which a third of the beams ends at people."""
    rng = np.random.default_rng(0)

    def crowd(scan):
        ranges = scan.ranges.astype(np.float64)
        n = len(ranges)
        hit = (rng.integers(n) + np.arange(54)) % n if together else rng.permutation(n)[:54]
        hit = hit[np.isfinite(ranges[hit])]
        ranges[hit] = rng.uniform(np.minimum(0.3, ranges[hit]), ranges[hit])
        return ranges

    robot = robot_in(office, office_poses(office, 1, 8)[0])
    robot.tick()
    for _ in range(600):
        outputs = robot.tick(None, with_ranges(crowd))
        assert kinds(outputs) == [TrackedPose, Status]
        assert is_at(outputs[0].T_map_base, robot.pose)
    assert robot.localizer.state is State.LOCALIZED


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, 0.15])
def test_a_blocked_sensor_causes_no_wrong_pose(in_hall, with_ranges, value, of, poses, is_at):
    outputs = in_hall.ticks(60, None, with_ranges(lambda _: value))
    assert of(InitialPose, outputs) == []
    assert all(is_at(tracked.T_map_base, HERE) for tracked in of(TrackedPose, outputs))
    # When it is clear again the robot is found, at the latest when it moves on.
    in_hall.ticks(40, A_TURN)
    assert in_hall.localizer.state is State.LOCALIZED
    for pose in poses(in_hall.outputs):
        assert pose.T_map_base.distance_to(HERE) < 0.1


def test_a_covered_sensor_at_the_start_has_no_later_effect(
    robot_in, office, with_ranges, poses, office_poses
):
    rng = np.random.default_rng(0)
    robot = robot_in(office, office_poses(office, 1, 1)[0])
    robot.ticks(5, None, with_ranges(lambda scan: rng.uniform(0.12, 0.3, len(scan))))
    assert poses(robot.outputs) == []
    robot.ticks(100)
    assert robot.localizer.state is State.LOCALIZED


# ---- odometry that begins anew


@pytest.mark.parametrize("restart", [SE2.identity(), SE2(100.0, -50.0, 3.0)])
def test_restarted_odometry_changes_no_pose(in_hall, restart, of, is_at):
    in_hall.ticks(10, A_STEP)
    in_hall.T_odom_base = restart
    outputs = in_hall.ticks(10, A_STEP)
    assert of(InitialPose, outputs) == []
    tracked = of(TrackedPose, outputs)
    assert len(tracked) == 10
    assert is_at(tracked[-1].T_map_base, in_hall.pose)
    expected = in_hall.pose @ in_hall.T_odom_base.inverse()
    assert is_at(tracked[-1].T_map_odom @ in_hall.T_odom_base, expected @ in_hall.T_odom_base)


@pytest.mark.parametrize("silence_s", [0.5, 3.0, 60.0])
def test_a_base_without_messages_during_its_restart_changes_no_pose(in_hall, silence_s, of, is_at):
    """For any earlier odometry: the robot has not driven there and back meanwhile."""
    in_hall.ticks(10, A_STEP)
    in_hall.T_odom_base = SE2.identity()
    in_hall.pass_time(silence_s)
    for moved in (SE2.identity(), *[A_STEP] * 9):
        (tracked,) = of(TrackedPose, in_hall.tick(moved))
        assert is_at(tracked.T_map_base, in_hall.pose)


def back(step: SE2, times: int) -> SE2:
    pose = SE2.identity()
    for _ in range(times):
        pose = pose @ step.inverse()
    return pose


@pytest.mark.parametrize("restart", [SE2(0.4, 0.2, 0.0), SE2(-1.0, 6.0, -2.0)])
def test_a_base_that_drove_before_its_next_message_causes_no_wrong_pose(
    in_hall, restart, poses, of
):
    in_hall.ticks(10, A_STEP)
    in_hall.T_odom_base = restart  # no longer at its start: no message reports the new frame
    in_hall.pass_time(5.0)
    outputs = in_hall.ticks(30, A_STEP)
    reported = poses(outputs)
    assert len(reported) > 20
    for pose in reported:
        ticks_since = round((in_hall.stamp - pose.stamp) / 0.1)
        true = in_hall.pose @ back(A_STEP, ticks_since)
        assert pose.T_map_base.distance_to(true) < 0.3
    assert "odometry has leapt" in of(Status, outputs)[0].reason


@pytest.mark.parametrize("carried_to", [SE2(7.5, 5.5, -2.0), SE2(7.5, 1.0, 2.5)])
def test_a_robot_that_was_off_and_carried_publishes_no_wrong_pose(in_hall, carried_to, poses):
    """Its odometry is as before: it stood near the start of it, and begins there again."""
    in_hall.ticks(10, A_STEP)
    in_hall.pose = carried_to
    in_hall.pass_time(3.0)
    reported = [pose for _ in range(30) for pose in poses(in_hall.tick())]
    assert reported
    assert all(pose.T_map_base.distance_to(carried_to) < 0.3 for pose in reported)


def test_a_robot_that_drove_without_messages_stays_localized(in_hall, kinds, is_at):
    for _ in range(12):
        in_hall.skip(A_STEP)
    for _ in range(3):
        outputs = in_hall.tick(A_STEP)
        assert kinds(outputs) == [TrackedPose, Status]
        assert is_at(outputs[0].T_map_base, in_hall.pose)


def test_a_clock_that_goes_back_changes_no_pose(in_hall, kinds, is_at):
    in_hall.ticks(5, A_STEP)
    for k in range(5):
        stamp = 3.0 + 0.1 * k
        in_hall.send(Odometry(stamp, in_hall.T_odom_base))
        outputs = in_hall.send(dataclasses.replace(in_hall.scan(), stamp=stamp))
        assert kinds(outputs) == [TrackedPose, Status]
        assert outputs[0].stamp == stamp
        assert is_at(outputs[0].T_map_base, in_hall.pose)


# ---- nonsense


@pytest.mark.parametrize("beams", [1, 7, 8])
@pytest.mark.parametrize("value", [1.0, math.nan, math.inf, -math.inf, -1.0, 1e30])
def test_nearly_uninformative_scans_do_no_harm(robot_in, hall_plan, beams, value, of, poses, is_at):
    robot = robot_in(hall_plan, HERE)
    ranges = np.full(beams, value, np.float32)
    for k in range(5):
        robot.send(Odometry(float(k), SE2.identity()))
        robot.send(LaserScan(ranges, 0.0, 0.5, 0.1, 12.0, stamp=float(k)))
    assert poses(robot.outputs) == []
    outputs = robot.ticks(30, A_TURN)  # and they are discarded
    assert robot.localizer.state is State.LOCALIZED
    assert is_at(of(TrackedPose, outputs)[-1].T_map_base, robot.pose)


def test_stamps_that_go_back_and_forth_do_no_harm(in_hall, poses, is_at):
    rng = np.random.default_rng(0)
    for stamp in rng.uniform(-1e9, 1e9, 30).tolist():
        in_hall.send(Odometry(stamp, in_hall.T_odom_base))
        in_hall.send(dataclasses.replace(in_hall.scan(), stamp=stamp + rng.uniform(-1.0, 1.0)))
    assert all(is_at(pose.T_map_base, HERE) for pose in poses(in_hall.outputs))


@pytest.mark.parametrize("stamp", [-1e300, 1e18, 1e300])
def test_huge_stamps_do_no_harm(in_hall, stamp, kinds, is_at):
    in_hall.send(Odometry(stamp, in_hall.T_odom_base))
    outputs = in_hall.send(dataclasses.replace(in_hall.scan(), stamp=stamp))
    assert kinds(outputs) == [TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, HERE)


def test_huge_odometry_does_no_harm(in_hall, poses, is_at):
    in_hall.T_odom_base = SE2(1e12, -1e12, 1.0)
    in_hall.ticks(5)
    in_hall.T_odom_base = SE2.identity()
    assert is_at(poses(in_hall.ticks(5))[-1].T_map_base, HERE)


def test_signals_without_end_do_no_harm(in_hall, kinds):
    for k in range(500):
        in_hall.send(Signal(in_hall.stamp + 1e-4 * k, SignalKind.CLIFF, active=True))
    assert in_hall.ticks(2) == []
    in_hall.send(Signal(in_hall.stamp, SignalKind.CLIFF, active=False))
    assert InitialPose in kinds(in_hall.tick())
