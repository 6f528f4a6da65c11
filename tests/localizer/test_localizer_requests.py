"""Maps, hints, resets and requests for an update."""

from __future__ import annotations

import numpy as np
import pytest

from firstfix.core.errors import MapError
from firstfix.core.grid import FREE, OccupancyGrid
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.inputs import NewMap, NoMotionUpdate, PoseHint, Reset
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Status, TrackedPose
from firstfix.localizer.states import State

HERE = SE2(4.0, 3.0, 1.0)  # where `in_hall` stands
IN_A_ROOM = SE2(10.5, 1.2, 0.3)
A_TURN = SE2(0.0, 0.0, 0.1)


def test_inputs_without_a_map_are_ignored_and_reported(hall_plan):
    localizer = Localizer()
    assert localizer.handle(Odometry(1.0, SE2.identity())) == []
    scan = Lidar(beams=60).scan(hall_plan, HERE, np.random.default_rng(0), 1.0)
    hint = PoseHint(1.0, HERE)
    for given in (scan, hint, Reset(1.0), NoMotionUpdate(1.0)):
        (status,) = localizer.handle(given)
        assert (status.stamp, status.state, status.reason) == (1.0, State.NO_MAP, "no map yet")
    assert localizer.particles is None


def test_a_new_map_discards_the_pose_and_waiting_scans(in_hall, office, kinds, is_at, office_poses):
    in_hall.stamp += 0.1
    waiting = in_hall.scan()
    in_hall.send(waiting)
    (status,) = in_hall.send(NewMap(in_hall.stamp, office))
    assert status.state is State.SEARCHING
    assert in_hall.localizer.particles is None
    # What waited belongs to the floor before.
    assert in_hall.send(Odometry(in_hall.stamp + 0.01, in_hall.T_odom_base)) == []
    (pose,) = office_poses(office, 1, 0)
    in_hall.world, in_hall.pose = office, pose
    outputs = in_hall.tick()
    assert kinds(outputs) == [InitialPose, TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, pose)


def test_a_map_that_cannot_be_searched_changes_nothing(in_hall, kinds):
    empty = OccupancyGrid(np.full((50, 50), FREE, np.int8), 0.05)
    with pytest.raises(MapError):
        in_hall.send(NewMap(in_hall.stamp, empty))
    assert in_hall.localizer.state is State.LOCALIZED
    assert kinds(in_hall.tick()) == [TrackedPose, Status]


@pytest.mark.parametrize("reported", ["map", "reset", "lifted", "update"])
def test_after_a_change_the_next_scan_is_searched_at_once(foreign, office, reported):
    robot = foreign
    if reported == "map":
        robot.send(NewMap(robot.stamp, office))
    elif reported == "reset":
        robot.send(Reset(robot.stamp))
    elif reported == "lifted":
        for active in (True, False):
            robot.send(Signal(robot.stamp, SignalKind.PICKED_UP, active=active))
    else:
        robot.send(NoMotionUpdate(robot.stamp))
    assert robot.tick() != []


def test_a_reset_discards_the_pose_and_searches(in_hall, kinds):
    (status,) = in_hall.send(Reset(in_hall.stamp))
    assert status.state is State.SEARCHING
    assert in_hall.localizer.particles is None
    assert kinds(in_hall.tick()) == [InitialPose, TrackedPose, Status]


def test_an_update_can_be_asked_for_at_rest(in_hall):
    in_hall.tick()
    before = in_hall.localizer.particles
    in_hall.tick()
    assert in_hall.localizer.particles is before
    (status,) = in_hall.send(NoMotionUpdate(in_hall.stamp))
    assert status.state is State.LOCALIZED
    in_hall.tick()
    once = in_hall.localizer.particles
    assert once is not before
    in_hall.tick()
    assert in_hall.localizer.particles is once  # one scan was asked for


def test_a_right_hint_decides_between_identical_rooms(robot_in, three_rooms, kinds, is_at):
    """A person decides between identical rooms."""
    robot = robot_in(three_rooms, IN_A_ROOM)
    robot.tick()
    robot.send(PoseHint(robot.stamp, IN_A_ROOM @ SE2(0.4, -0.3, 0.3)))
    outputs = robot.tick()
    assert kinds(outputs) == [InitialPose, TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, IN_A_ROOM)
    robot.ticks(20, A_TURN)
    assert robot.localizer.state is State.LOCALIZED


def test_a_hint_may_come_before_odometry(robot_in, hall_plan, of, is_at):
    robot = robot_in(hall_plan, HERE)
    (status,) = robot.send(PoseHint(robot.stamp, HERE @ SE2(0.3, 0.3, 0.3)))
    assert status.state is State.VERIFYING_HINT
    outputs = robot.tick()
    assert is_at(of(InitialPose, outputs)[0].T_map_base, HERE)


@pytest.mark.parametrize("hint", [SE2(1.0, 2.0, 2.0), SE2(8.0, 6.0, 0.0)])
def test_a_wrong_hint_costs_one_scan(in_hall, hint, kinds, is_at):
    in_hall.send(PoseHint(in_hall.stamp, hint))
    (status,) = in_hall.tick()
    assert status.state is State.SEARCHING
    assert "does not explain the scan" in status.reason
    outputs = in_hall.tick()
    assert kinds(outputs) == [InitialPose, TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, HERE)


@pytest.mark.parametrize("hint", [SE2(900.0, 0.0, 0.0), SE2(-2.0, -2.0, 0.0)])
def test_a_hint_outside_the_map_is_refused_and_the_places_stay(in_hall, hint, kinds):
    (status,) = in_hall.send(PoseHint(in_hall.stamp, hint))
    assert status.state is State.LOCALIZED
    assert status.reason.startswith("hint of a person refused: expected a prior on the map")
    assert kinds(in_hall.tick()) == [TrackedPose, Status]


@pytest.mark.parametrize(
    ("truth", "hint"),
    [
        (SE2(7.03, 12.35, -0.30), SE2(33.40, 11.91, 2.20)),
        (SE2(17.41, 6.91, -1.50), SE2(13.60, 3.87, 1.33)),
        (SE2(35.08, 12.34, -3.09), SE2(21.86, 11.52, -2.33)),
    ],
)
def test_a_wrong_hint_is_not_followed_where_the_scan_is_sure_of_another_place(
    robot_in, office, truth, hint, of, poses, is_at
):
    """About three quarters of the beams fit near the hint; all of them fit elsewhere."""
    robot = robot_in(office, truth)
    assert is_at(of(InitialPose, robot.tick())[0].T_map_base, truth)  # UNIQUE
    robot.send(PoseHint(robot.stamp, hint))
    for pose in poses(robot.ticks(2)):
        assert is_at(pose.T_map_base, truth)
