"""A robot that is lifted, carried, pushed or teleported is found again, never at a wrong pose."""

from __future__ import annotations

import dataclasses
import math

import pytest

from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.phases import CarryTo, DriveTo, Stand, Teleport
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Status, TrackedPose
from firstfix.localizer.states import State

HERE, THERE = SE2(4.0, 3.0, 1.0), SE2(7.5, 1.2, -2.0)  # `in_hall` stands here
A_STEP, A_TURN = SE2(0.05, 0.0, 0.05), SE2(0.0, 0.0, 0.1)


@pytest.mark.parametrize("kind", [SignalKind.WHEEL_DROP, SignalKind.PICKED_UP, SignalKind.CLIFF])
def test_a_lifted_robot_publishes_nothing_until_it_is_set_down(in_hall, kind, kinds, is_at):
    (status,) = in_hall.send(Signal(in_hall.stamp, kind, active=True))
    assert status.state is State.LIFTED
    assert kind.value in status.reason
    assert in_hall.localizer.particles is None
    in_hall.pose = THERE
    assert in_hall.ticks(20) == []
    (status,) = in_hall.send(Signal(in_hall.stamp, kind, active=False))
    assert status.state is State.SEARCHING
    outputs = in_hall.tick()
    assert kinds(outputs) == [InitialPose, TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, THERE)


def test_a_robot_is_set_down_when_the_last_of_its_sensors_is_released(in_hall, kinds):
    for kind in (SignalKind.CLIFF, SignalKind.WHEEL_DROP):
        in_hall.send(Signal(in_hall.stamp, kind, active=True))
    in_hall.send(Signal(in_hall.stamp, SignalKind.CLIFF, active=False))
    assert in_hall.ticks(3) == []
    in_hall.send(Signal(in_hall.stamp, SignalKind.WHEEL_DROP, active=False))
    assert InitialPose in kinds(in_hall.tick())


def test_a_bumper_is_no_kidnapping(in_hall, kinds):
    for active in (True, False):
        assert in_hall.send(Signal(in_hall.stamp, SignalKind.BUMPER, active=active)) == []
        assert kinds(in_hall.tick()) == [TrackedPose, Status]


def test_a_robot_in_the_air_is_not_searched_for_when_its_map_arrives(hall_plan, robot_in, poses):
    robot = robot_in(hall_plan, HERE)
    robot.localizer = Localizer()
    robot.send(Signal(99.0, SignalKind.WHEEL_DROP, active=True))
    robot.send(NewMap(99.5, hall_plan))
    assert robot.localizer.state is State.LIFTED
    assert poses(robot.ticks(3)) == []
    robot.send(Signal(robot.stamp, SignalKind.WHEEL_DROP, active=False))
    assert poses(robot.tick()) != []


def test_a_scan_taken_while_lifted_is_not_used_after_the_robot_is_set_down(in_hall, poses):
    in_hall.send(Signal(in_hall.stamp, SignalKind.WHEEL_DROP, active=True))
    in_hall.stamp += 0.1
    assert in_hall.send(in_hall.scan()) == []
    in_hall.send(Signal(in_hall.stamp + 0.01, SignalKind.WHEEL_DROP, active=False))
    assert poses(in_hall.send(Odometry(in_hall.stamp + 0.02, in_hall.T_odom_base))) == []


@pytest.mark.parametrize("seed", range(8))
def test_a_silent_kidnapping_is_noticed_and_no_wrong_pose_is_published(
    robot_in, office, seed, of, is_at, office_poses
):
    """Odometry is continuous and there is no signal: only scans reveal it."""
    start, goal = office_poses(office, 2, 100 + seed)
    assert start.distance_to(goal) > 1.0
    robot = robot_in(office, start, seed=seed)
    robot.ticks(4, A_STEP)
    robot.pose = goal
    outputs = robot.ticks(30, A_TURN)
    (found,) = of(InitialPose, outputs)
    assert found.stamp - outputs[0].stamp < 3.0
    moved = SE2(0.0, 0.0, 0.1 * round((found.stamp - 100.4) / 0.1))
    assert is_at(found.T_map_base, goal @ moved)
    later = [tracked for tracked in of(TrackedPose, outputs) if tracked.stamp >= found.stamp]
    assert all(tracked.T_map_base.distance_to(goal) < 0.1 for tracked in later)
    for status in of(Status, outputs):  # no LOCALIZED status before that
        if status.stamp < found.stamp:
            assert "doubtful" in status.reason


@pytest.mark.parametrize("seed", range(2))
def test_a_story_with_every_kind_of_kidnapping(maps_cache, office, seed, of, is_at):
    script = [Stand(0.3), DriveTo(seconds=3), Teleport(), Stand(0.5), CarryTo(seconds=1.0)]
    script += [DriveTo(seconds=3)]
    localizer = Localizer(cache_dir=maps_cache)
    localizer.handle(NewMap(0.0, office))
    found, disturbed = 0, 0
    for moment in run(Scenario(script), office, seed):
        disturbed += moment.disturbance is not None
        outputs = [output for event in moment.events for output in localizer.handle(event)]
        for pose in of(InitialPose, outputs):
            assert pose.stamp == moment.stamp
            assert is_at(pose.T_map_base, moment.T_map_base)
            found += 1
    assert disturbed == 2
    assert found == 3
    assert localizer.state is State.LOCALIZED


def test_a_small_slip_is_corrected_before_any_search(
    robot_in, office, searches, of, is_at, office_poses
):
    for seed, pose in enumerate(office_poses(office, 4, 5)):
        robot = robot_in(office, pose, seed=seed)
        robot.tick()
        assert robot.localizer.state is State.LOCALIZED
        searches.clear()
        towards = 1.5 * seed
        robot.pose = pose @ SE2(
            0.6 * math.cos(towards), 0.6 * math.sin(towards), math.radians(20.0)
        )
        outputs = robot.ticks(10)
        (found,) = of(InitialPose, outputs)
        assert all(stamp > found.stamp for stamp in searches)
        assert is_at(found.T_map_base, robot.pose)
        assert is_at(of(TrackedPose, outputs)[-1].T_map_base, robot.pose)


@pytest.mark.parametrize("metres", [0.15, 0.25])
def test_a_slip_too_small_for_a_doubt_is_corrected_at_rest(in_hall, metres, of, is_at):
    in_hall.pose = HERE @ SE2(metres, 0.0, math.radians(8.0))
    outputs = in_hall.ticks(30)
    assert is_at(of(TrackedPose, outputs)[-1].T_map_base, in_hall.pose, 0.1, 3.0)


def test_a_slip_that_scans_show_costs_nothing(in_hall, of, is_at):
    in_hall.ticks(60, A_STEP)
    known = len(in_hall.localizer.belief.window)
    assert known >= 4
    in_hall.pose = in_hall.pose @ SE2(0.2, 0.0, math.radians(8.0))
    outputs = in_hall.ticks(30)
    assert len(of(TrackedPose, outputs)) == 30
    assert all(is_at(each.T_map_base, in_hall.pose, 0.1, 2.0) for each in of(TrackedPose, outputs))
    assert len(in_hall.localizer.belief.window) >= known


def test_a_slip_that_no_scan_saw_costs_nothing_of_what_is_known(in_hall, of, with_ranges):
    in_hall.ticks(60, A_STEP)
    known = len(in_hall.localizer.belief.window)
    assert known >= 4
    in_hall.ticks(5, None, with_ranges(lambda _: math.nan))
    in_hall.pose = in_hall.pose @ SE2(0.2, 0.0, math.radians(8.0))
    said = [status.reason for status in of(Status, in_hall.ticks(30))]
    assert "corrected" in said
    assert len(in_hall.localizer.belief.window) >= known


def surrounded_by(count, more):
    """Return a function that lets the first beams end at 0.6 m, with each scan more of them."""
    ranges = {"shortened": 0}

    def damage(scan):
        ranges["shortened"] = min(count, ranges["shortened"] + more)
        shorter = scan.ranges.copy()
        shorter[: ranges["shortened"]] = 0.6
        return dataclasses.replace(scan, ranges=shorter)

    return damage


@pytest.mark.parametrize(("more", "state"), [(6, State.LOCALIZED), (150, State.DISAMBIGUATING)])
def test_a_pose_is_kept_if_only_the_surroundings_have_changed(in_hall, of, is_at, more, state):
    in_hall.ticks(100, A_TURN)
    outputs = in_hall.ticks(80, None, surrounded_by(150, more))
    assert all(is_at(each.T_map_base, in_hall.pose, 0.3, 5.0) for each in of(TrackedPose, outputs))
    said = [status.state for status in of(Status, outputs)]
    assert (State.SEARCHING in said) is (state is not State.LOCALIZED)
