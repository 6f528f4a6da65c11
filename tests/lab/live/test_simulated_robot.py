"""A simulated robot executes commands, and wanders between them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from firstfix.core.angles import wrap
from firstfix.core.errors import InputError
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.live.simulated_robot import MOST_PEOPLE, SENSORS, SimulatedRobot
from firstfix.lab.simulation.simulation import Moment
from firstfix.lab.worlds.catalog import WORLDS, random_free_poses
from firstfix.lab.worlds.hotel import HOTEL_START

HOUSE = WORLDS["house"]()
SOON = 1200  # scans: two minutes of its time


@pytest.fixture
def robot() -> SimulatedRobot:
    return SimulatedRobot(HOUSE, 1)


def step_until(robot: SimulatedRobot, holds: Callable[[Moment], bool]) -> list[Moment]:
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


def test_the_same_commands_at_the_same_scans_give_the_same_result():
    def story() -> list[Moment]:
        robot = SimulatedRobot(HOUSE, 3)
        moments = []
        for i in range(150):
            if i == 30:
                robot.set_people(3)
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
def test_it_drives_to_a_goal_at_once_and_waits_there(robot, seed):
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
    with pytest.raises(InputError, match="too close to a wall"):
        robot.drive_to(x, y)
    with pytest.raises(InputError, match="too close to a wall"):
        robot.carry_to(SE2(x, y, 0.0))
    assert robot.step() is not None


def test_a_goal_behind_walls_is_refused():
    robot = SimulatedRobot(WORLDS["rooms"](), 1)
    here = robot.T_map_base
    with pytest.raises(InputError, match="behind walls"):
        robot.drive_to((here.x + 8.0) % 32.0, here.y)


def test_it_is_carried_and_the_wheel_drop_reports_it(robot):
    pose = SE2(*goal_of(HOUSE, 1))
    robot.carry_to(pose)
    moments = step_until(robot, lambda moment: moment.phase == "carry")
    with pytest.raises(InputError, match="being carried"):
        robot.drive_to(pose.x, pose.y)
    with pytest.raises(InputError, match="being carried"):
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
    robot.set_people(6)
    assert before_walls() > few + 10
    robot.set_people(0)
    assert before_walls() < few + 10
    for count in (-1, MOST_PEOPLE + 1):
        with pytest.raises(InputError, match="people"):
            robot.set_people(count)


def test_its_clock_stops_and_goes_on(robot):
    before = robot.step().stamp
    robot.pause()
    assert [robot.step(), robot.step()] == [None, None]
    robot.resume()
    assert robot.step().stamp == pytest.approx(before + 0.1)


def test_where_there_is_no_way_out_it_stays():
    robot = SimulatedRobot(WORLDS["house"](), 1)
    robot._simulation.planner._tightest_m = 99.0  # a robot as large as the house
    moments = [robot.step() for _ in range(100)]
    assert {moment.phase for moment in moments} == {"pause", "stand"}


def odometry_of(moments: list[Moment]) -> list[SE2]:
    return [
        event.T_odom_base
        for moment in moments
        for event in moment.events
        if isinstance(event, Odometry)
    ]


def test_a_kidnapped_robot_reports_nothing_of_it(robot):
    step_until(robot, lambda moment: moment.phase == "drive")
    before = robot.T_map_base
    pose = robot.kidnap()
    moments = [robot.step() for _ in range(20)]
    assert robot.T_map_base == pose
    assert pose.distance_to(before) > 0.5
    assert not [e for m in moments for e in m.events if isinstance(e, Signal)]
    first, *_, last = odometry_of(moments)
    assert first.distance_to(last) < 0.05


def test_a_robot_that_is_being_carried_cannot_be_kidnapped(robot):
    robot.carry_to(SE2(*goal_of(HOUSE, 1)))
    step_until(robot, lambda moment: moment.phase == "carry")
    with pytest.raises(InputError, match="being carried"):
        robot.kidnap()


def test_a_covered_sensor_has_no_valid_range_until_it_is_uncovered(robot):
    step_until(robot, lambda moment: moment.scan is not None)
    robot.cover_sensor(covered=True)
    scan = robot.step().scan
    assert (scan.ranges < scan.range_min).all()
    robot.cover_sensor(covered=False)
    assert (robot.step().scan.ranges > scan.range_min).any()


@pytest.mark.parametrize("name", SENSORS)
def test_a_sensor_of_the_menu_has_the_view_and_the_range_in_its_name(robot, name):
    count, _, numbers = name.rpartition(" of ")
    degrees, metres = (float(part.rstrip("° m")) for part in numbers.split("x"))
    robot.select_sensor(name)
    moment = step_until(robot, lambda moment: moment.scan is not None)[-1]
    assert len(moment.scans) == (2 if count == "two" else 1)
    scan = moment.scan
    seen = len(scan.ranges) * scan.angle_increment
    assert np.degrees(seen) == pytest.approx(degrees, abs=1.0)
    assert scan.range_max == metres
    assert robot.status.sensor == name


def test_another_world_restarts_the_simulation_with_the_same_sensor(robot):
    step_until(robot, lambda moment: moment.phase == "drive")
    robot.select_sensor("60° x 5 m")
    robot.select_world("office")
    assert robot.status.world == "office"
    assert (robot.grid.width, robot.grid.height) == WORLDS["office"]().cells.shape[::-1]
    moment = robot.step()
    assert (moment.stamp, moment.phase) == (0.0, "pause")
    assert step_until(robot, lambda m: m.scan is not None)[-1].scan.range_max == 5.0
    robot.select_world("map")
    assert robot.grid is HOUSE


def test_menus_refuse_other_names(robot):
    with pytest.raises(InputError, match="no world"):
        robot.select_world("cellar")
    with pytest.raises(InputError, match="no sensor"):
        robot.select_sensor("sonar")
    assert robot.worlds == ("map", *WORLDS)


def test_a_deciding_motion_turns_and_drives_ahead(robot):
    step_until(robot, lambda moment: moment.phase == "drive")
    robot.drive_to(*goal_of(HOUSE, 1)[:2])
    step_until(robot, lambda moment: moment.phase == "stand")
    start = robot.T_map_base
    robot.move(np.pi / 2, 0.0)
    step_until(robot, lambda moment: moment.phase == "stand")
    turned = robot.T_map_base
    assert turned.distance_to(start) < 0.05
    assert abs(wrap(turned.yaw - start.yaw - np.pi / 2)) < 0.2


def test_the_same_world_can_be_restarted_and_the_hotel_starts_where_a_motion_decides(robot):
    step_until(robot, lambda moment: moment.phase == "drive")
    robot.select_world("map")
    assert robot.starts == 2
    assert robot.step().stamp == 0.0
    robot.select_world("hotel")
    assert robot.T_map_base == HOTEL_START


def test_the_path_to_a_goal_is_shown_until_it_arrives_or_is_interrupted(robot):
    goal, elsewhere = random_free_poses(HOUSE, np.random.default_rng(1), 2, 0.5)
    robot.drive_to(goal.x, goal.y)
    assert robot.status.path[-1] == pytest.approx((goal.x, goal.y), abs=1e-3)
    step_until(robot, lambda moment: not robot.status.path)
    assert np.hypot(robot.T_map_base.x - goal.x, robot.T_map_base.y - goal.y) < 0.2
    robot.drive_to(elsewhere.x, elsewhere.y)
    assert robot.status.path
    robot.kidnap()
    assert robot.status.path == ()
