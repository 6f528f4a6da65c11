"""A simulated robot does as it is told, and wanders when nobody tells it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.odometry import Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.live.steered_robot import MOST_PEOPLE, SimRobot
from firstfix.lab.simulation.simulation import Moment
from firstfix.lab.worlds.catalog import WORLDS, random_free_poses

HOUSE = WORLDS["house"]()
SOON = 1200  # scans: two minutes of its time


@pytest.fixture
def robot() -> SimRobot:
    return SimRobot(HOUSE, 1)


def step_until(robot: SimRobot, holds: Callable[[Moment], bool]) -> list[Moment]:
    """Go on until a moment of which something holds; all moments on the way."""
    moments = []
    for _ in range(SOON):
        moment = robot.step()
        assert moment is not None
        moments.append(moment)
        if holds(moment):
            return moments
    pytest.fail("it never came")


def lifts(moments: list[Moment]) -> list[bool]:
    return [
        event.active
        for moment in moments
        for event in moment.events
        if isinstance(event, Signal) and event.kind is SignalKind.WHEEL_DROP
    ]


def test_it_wakes_stands_and_wanders(robot):
    moments = step_until(robot, lambda moment: moment.phase == "drive")
    assert [moment.phase for moment in moments] == ["pause"] * 20 + ["stand"] * 20 + ["drive"]
    assert moments[19].events == ()
    assert moments[20].scan is not None
    start = robot.T_map_base
    step_until(robot, lambda moment: moment.T_map_base.distance_to(start) > 2.0)


def test_the_same_orders_at_the_same_scans_lead_to_the_same_story():
    def story() -> list[Moment]:
        robot = SimRobot(HOUSE, 3)
        moments = []
        for i in range(150):
            if i == 30:
                robot.meet(3)
            if i == 60:
                robot.carry_to(SE2(*goal_of(HOUSE, 1)))
            moments.append(robot.step())
        return moments

    for one, other in zip(story(), story(), strict=True):
        assert one.T_map_base == other.T_map_base
        if one.scan is not None:
            np.testing.assert_array_equal(one.scan.ranges, other.scan.ranges)


def goal_of(grid, seed: int) -> tuple[float, float, float]:
    (pose,) = random_free_poses(grid, np.random.default_rng(seed), 1, 0.5)
    return pose.x, pose.y, pose.yaw


@pytest.mark.parametrize("seed", [1, 2])
def test_it_goes_where_it_is_sent_at_once_and_waits_there(robot, seed):
    step_until(robot, lambda moment: moment.phase == "drive")
    x, y, _ = goal_of(HOUSE, seed)
    robot.drive_to(x, y)
    moments = step_until(robot, lambda moment: moment.phase == "stand")
    assert moments[0].phase == "drive"
    assert robot.T_map_base.distance_to(SE2(x, y, 0.0)) < 0.15
    waiting = step_until(robot, lambda moment: moment.phase == "drive")
    assert len(waiting) == 150  # the rest of 15 s


def test_a_goal_replaces_the_one_before(robot):
    robot.drive_to(*goal_of(HOUSE, 1)[:2])
    robot.step()
    x, y, _ = goal_of(HOUSE, 2)
    robot.drive_to(x, y)
    step_until(robot, lambda moment: moment.phase == "stand")
    assert robot.T_map_base.distance_to(SE2(x, y, 0.0)) < 0.15


@pytest.mark.parametrize(("x", "y"), [(-50.0, 0.0), (1e6, 1e6), (0.0, 0.0)])
def test_a_goal_where_it_does_not_fit_is_refused_and_it_goes_on(robot, x, y):
    with pytest.raises(InputError, match="free space"):
        robot.drive_to(x, y)
    with pytest.raises(InputError, match="free space"):
        robot.carry_to(SE2(x, y, 0.0))
    assert robot.step() is not None


def test_a_goal_behind_walls_is_refused():
    robot = SimRobot(WORLDS["rooms"](), 1)
    here = robot.T_map_base
    with pytest.raises(InputError, match="behind walls"):
        robot.drive_to((here.x + 8.0) % 32.0, here.y)


def test_it_is_carried_and_its_wheels_tell(robot):
    pose = SE2(*goal_of(HOUSE, 1))
    robot.carry_to(pose)
    moments = step_until(robot, lambda moment: moment.phase == "carry")
    with pytest.raises(InputError, match="hands"):
        robot.drive_to(pose.x, pose.y)
    with pytest.raises(InputError, match="hands"):
        robot.carry_to(pose)
    moments += step_until(robot, lambda moment: moment.phase == "stand")
    assert robot.T_map_base == pose
    moments += step_until(robot, lambda moment: moment.phase == "drive")
    assert lifts(moments) == [True, False]


def test_people_come_and_go(robot):
    step_until(robot, lambda moment: moment.scan is not None)
    free = robot.step().scan.ranges

    def before_walls() -> int:
        return np.count_nonzero(robot.step().scan.ranges < np.minimum(free, 12.0) - 0.3)

    few = before_walls()
    robot.meet(6)
    assert before_walls() > few + 10
    robot.meet(0)
    assert before_walls() < few + 10
    for count in (-1, MOST_PEOPLE + 1):
        with pytest.raises(InputError, match="people"):
            robot.meet(count)


def test_its_clock_stops_and_goes_on(robot):
    before = robot.step().stamp
    robot.pause()
    assert [robot.step(), robot.step()] == [None, None]
    robot.go_on()
    assert robot.step().stamp == pytest.approx(before + 0.1)


def test_where_there_is_no_way_out_it_stays():
    robot = SimRobot(WORLDS["house"](), 1)
    robot._simulation.planner._tightest_m = 99.0  # a robot as large as the house
    moments = [robot.step() for _ in range(100)]
    assert {moment.phase for moment in moments} == {"pause", "stand"}
