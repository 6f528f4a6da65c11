"""Hints: a proposed pose, confirmed or rejected by scans."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.core.odometry import Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import PoseHint
from firstfix.localizer.outputs import Status
from firstfix.localizer.states import State

IN_ROOM_1 = SE2(10.5, 1.2, 0.3)
OTHERS = [SE2(-8.0, 0.0, 0.0), SE2(8.0, 0.0, 0.0)]


def in_words(outputs):
    return [output.reason for output in outputs if isinstance(output, Status)]


def test_the_source_of_a_hint_is_in_the_status(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(4.0, 3.0, 1.0))
    reported = robot.send(PoseHint(robot.stamp, robot.pose, "the saved pose"))
    assert in_words(reported) == ["the saved pose proposes a pose: the next scan will verify it"]
    assert in_words(robot.tick())[0].startswith("the saved pose proposed this pose; ")
    robot.send(PoseHint(robot.stamp, SE2(1.0, 2.0, 2.0), "the saved pose"))
    assert in_words(robot.tick()) == [
        "the pose proposed by the saved pose does not explain the scan: searching"
    ]


@pytest.mark.parametrize("room", [*OTHERS, SE2.identity()])
def test_in_equal_rooms_a_hint_of_any_room_is_confirmed(robot_in, three_rooms, poses, room, is_at):
    """Nothing that the sensor sees could contradict it."""
    robot = robot_in(three_rooms, IN_ROOM_1)
    robot.send(PoseHint(robot.stamp, room @ IN_ROOM_1))
    assert is_at(poses(robot.tick())[0].T_map_base, room @ IN_ROOM_1)


@pytest.mark.parametrize("ranges", [math.nan, 0.0, math.inf, [2.0] * 7 + [math.nan] * 173])
def test_an_uninformative_scan_leaves_the_hint_waiting(
    robot_in, three_rooms, with_ranges, poses, is_at, ranges
):
    robot = robot_in(three_rooms, IN_ROOM_1)
    robot.send(PoseHint(robot.stamp, IN_ROOM_1))
    outputs = robot.ticks(3, damage=with_ranges(lambda scan: ranges))
    assert poses(outputs) == []
    assert (
        in_words(outputs)
        == ["a person proposes a pose; the sensor sees too little to verify it"] * 3
    )
    assert robot.localizer.state is State.VERIFYING_HINT
    assert is_at(poses(robot.tick())[0].T_map_base, IN_ROOM_1)


@pytest.mark.slow
def test_in_a_building_without_equals_a_wrong_hint_never_wins(
    robot_in, office, office_poses, poses, is_at
):
    robot = robot_in(office, office_poses(office, 1, 0)[0])
    for truth, wrong in zip(office_poses(office, 15, 1), office_poses(office, 15, 2), strict=True):
        robot.pose = truth
        robot.send(PoseHint(robot.stamp, wrong))
        for pose in poses(robot.tick()):
            assert is_at(pose.T_map_base, truth, 0.2, 5.0)


def test_a_hint_that_is_a_little_off_is_corrected(robot_in, office, office_poses, poses, is_at):
    rng = np.random.default_rng(3)
    robot = robot_in(office, office_poses(office, 1, 0)[0])
    for truth in office_poses(office, 15, 4):
        robot.pose = truth
        off = SE2(*rng.uniform([-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]))
        robot.send(PoseHint(robot.stamp, truth @ off))
        assert is_at(poses(robot.tick())[0].T_map_base, truth)


def test_a_hint_given_in_the_air_is_verified_after_the_robot_is_set_down(
    robot_in, three_rooms, poses, is_at
):
    robot = robot_in(three_rooms, IN_ROOM_1)
    for active in (True, False):
        robot.send(Signal(robot.stamp, SignalKind.WHEEL_DROP, active=active))
        if active:
            robot.send(PoseHint(robot.stamp, IN_ROOM_1))
            assert robot.localizer.state is State.LIFTED
    assert robot.localizer.state is State.VERIFYING_HINT
    assert is_at(poses(robot.tick())[0].T_map_base, IN_ROOM_1)
