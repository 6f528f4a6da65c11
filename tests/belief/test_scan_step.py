"""Odometry that two consecutive scans contradict, or confirm."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from firstfix.belief.link import link
from firstfix.belief.scan_step import judge_step
from firstfix.belief.view import Link, View
from firstfix.core.angles import angle_error
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.drawing import Drawing

ALL_ROUND = Lidar(beams=180, sigma_m=0.01)
HALF = Lidar(beams=181, fov=math.pi, sigma_m=0.01)
WIDE = Lidar(beams=121, fov=math.radians(120.0), range_max=8.0, sigma_m=0.01)
NARROW = Lidar(beams=61, fov=math.radians(60.0), sigma_m=0.01)
START = SE2(5.5, 1.5, 0.4)
STEPS = [SE2(0.1, 0.0, 0.0), SE2(-0.15, 0.0, 0.05), SE2(0.0, 0.0, -0.3), SE2(0.0, 0.0, 0.0)]


def told(views: list[View], step: SE2) -> tuple[View, View]:
    """Give the second of two views the odometry of another step."""
    before, now = views
    return before, dataclasses.replace(now, T_odom_base=before.T_odom_base @ step)


def assert_near(step: SE2 | None, true: SE2) -> None:
    assert step is not None
    assert step.distance_to(true) < 0.03
    assert angle_error(step.yaw, true.yaw) < math.radians(1.0)


@pytest.mark.parametrize("lidar", [ALL_ROUND, HALF])
@pytest.mark.parametrize("step", STEPS)
def test_right_odometry_is_confirmed_and_stays(room, drive, lidar, step):
    judged = judge_step(*drive(room.grid, START, [step], lidar))
    assert judged.by_scans is None
    assert judged.is_confirmed


@pytest.mark.parametrize("lidar", [ALL_ROUND, HALF])
@pytest.mark.parametrize("true", [SE2(-0.1, 0.0, 0.02), SE2(-0.2, 0.0, -0.1)])
def test_odometry_that_does_not_know_that_the_robot_backs_is_contradicted(room, drive, lidar, true):
    views = drive(room.grid, START, [true], lidar)
    judged = judge_step(*told(views, SE2(-true.x, 0.0, true.yaw)))
    assert_near(judged.by_scans, true)
    assert judged.is_confirmed


@pytest.mark.parametrize("said", [SE2(0.15, 0.0, 0.0), SE2(0.0, 0.0, 0.25)])
def test_wheels_that_turn_while_the_robot_stands_are_contradicted(room, drive, said):
    views = drive(room.grid, START, [SE2.identity()], ALL_ROUND)
    assert_near(judge_step(*told(views, said)).by_scans, SE2.identity())


@pytest.mark.parametrize("lidar", [ALL_ROUND, HALF, WIDE])
@pytest.mark.parametrize("degrees", [-18.0, -10.0, 6.0, 14.0])
def test_a_heading_that_has_slipped_is_contradicted(room, drive, lidar, degrees):
    true = SE2(0.08, 0.0, math.radians(degrees))
    views = drive(room.grid, START, [true], lidar)
    assert_near(judge_step(*told(views, SE2(0.08, 0.0, 0.0))).by_scans, true)


@pytest.mark.parametrize("there", [SE2(2.8, 2.5, 2.0), SE2(5.5, 1.5, 2.6), SE2(3.0, 4.6, -0.3)])
def test_a_robot_that_was_carried_away_has_not_slipped(room, drive, there):
    (before,) = drive(room.grid, START, [], ALL_ROUND)
    (now,) = drive(room.grid, there, [], ALL_ROUND)
    judged = judge_step(before, now)
    assert judged.by_scans is None
    assert not judged.is_confirmed
    assert link(before, now) is Link.BROKEN


def corridor() -> OccupancyGrid:
    """Two walls, 2 m apart, that the sensor sees no end of."""
    plan = Drawing(30.0, 4.0, 0.05, 0.5)
    plan.room(0.0, 1.0, 30.0, 3.0)
    return plan.grid()


def test_along_a_bare_corridor_odometry_is_neither_contradicted_nor_confirmed(drive):
    views = drive(corridor(), SE2(15.0, 2.0, 0.0), [SE2(-0.1, 0.0, 0.0)], ALL_ROUND)
    judged = judge_step(*told(views, SE2(0.1, 0.0, 0.0)))
    assert judged.by_scans is None
    assert not judged.is_confirmed


def test_along_a_bare_corridor_the_heading_is_corrected_and_the_way_kept(drive):
    true = SE2(0.1, 0.0, 0.15)
    views = drive(corridor(), SE2(15.0, 2.0, 0.0), [true], ALL_ROUND)
    found = judge_step(*told(views, SE2(0.1, 0.0, 0.0))).by_scans
    assert found is not None
    assert angle_error(found.yaw, true.yaw) < math.radians(1.0)
    assert found.x == pytest.approx(0.1, abs=0.02)


def with_person(view: View, bearing: float, distance: float) -> View:
    """Let a round person of 0.5 m stand in a direction of the sensor."""
    (scan,) = view.scans
    off = np.abs(scan.bearings - bearing)
    half = math.asin(0.25 / distance)
    near = distance - 0.25 * np.sqrt(np.clip(1.0 - (off / half) ** 2, 0.0, 1.0))
    ranges = np.where(off < half, np.minimum(scan.ranges, near), scan.ranges)
    return dataclasses.replace(
        view, scans=(dataclasses.replace(scan, ranges=ranges.astype(np.float32)),)
    )


@pytest.mark.parametrize("lidar", [ALL_ROUND, HALF, WIDE])
def test_scans_do_not_follow_a_person_who_walks_ahead(drive, lidar):
    grid = corridor()
    before, now = drive(grid, SE2(15.0, 2.0, 0.0), [SE2(0.05, 0.0, 0.0)], lidar)
    judged = judge_step(with_person(before, 0.0, 1.2), with_person(now, 0.0, 1.3))
    assert judged.by_scans is None


@pytest.mark.parametrize("true", [SE2(-0.1, 0.0, 0.0), SE2(0.0, 0.0, 0.2)])
def test_a_narrow_view_says_nothing(room, drive, true):
    views = drive(room.grid, START, [true], NARROW)
    judged = judge_step(*told(views, SE2(0.1, 0.0, 0.0)))
    assert judged.by_scans is None
    assert not judged.is_confirmed


def test_of_a_view_to_the_front_only_the_heading_is_believed(room, drive):
    true = SE2(0.05, 0.0, 0.2)
    views = drive(room.grid, START, [true], WIDE)
    found = judge_step(*told(views, SE2(0.08, 0.0, 0.0))).by_scans
    assert found is not None
    assert (found.x, found.y) == (pytest.approx(0.08), pytest.approx(0.0, abs=1e-9))
    assert angle_error(found.yaw, true.yaw) < math.radians(1.0)


@pytest.mark.parametrize("said", [SE2(3.0, 0.0, 0.0), SE2(0.0, 0.0, 1.5)])
def test_nothing_is_said_after_a_long_step(room, drive, said):
    views = drive(room.grid, START, [SE2.identity()], ALL_ROUND)
    judged = judge_step(*told(views, said))
    assert (judged.by_scans, judged.is_confirmed) == (None, False)


def test_nothing_is_said_while_the_sensor_is_covered(room, drive):
    before, now = drive(room.grid, START, [SE2(0.1, 0.0, 0.0)], ALL_ROUND)
    (scan,) = now.scans
    for value in (np.nan, np.inf):
        dark = dataclasses.replace(scan, ranges=np.full(len(scan), value, np.float32))
        covered = dataclasses.replace(now, scans=(dark,))
        for pair in ((before, covered), (covered, before)):
            judged = judge_step(*pair)
            assert (judged.by_scans, judged.is_confirmed) == (None, False)


def test_two_sensors_are_judged_together_where_they_are_mounted(room, drive):
    true = SE2(-0.1, 0.0, 0.0)
    front = dataclasses.replace(HALF, T_base_laser=SE2(0.2, 0.1, 0.0))
    rear = dataclasses.replace(HALF, T_base_laser=SE2(-0.2, -0.1, math.pi))
    seen = [drive(room.grid, START, [true], lidar) for lidar in (front, rear)]
    views = [View((a.scans[0], b.scans[0]), a.T_odom_base) for a, b in zip(*seen, strict=True)]
    assert judge_step(*views).is_confirmed
    assert_near(judge_step(*told(views, SE2(0.1, 0.0, 0.0))).by_scans, true)


def test_the_frame_of_odometry_means_nothing_and_the_answer_repeats(room, drive):
    views = told(drive(room.grid, START, [SE2(-0.1, 0.0, 0.0)], ALL_ROUND), SE2(0.1, 0.0, 0.0))
    moved = [
        dataclasses.replace(view, T_odom_base=SE2(40.0, -7.0, 2.0) @ view.T_odom_base)
        for view in views
    ]
    once, again, elsewhere = judge_step(*views), judge_step(*views), judge_step(*moved)
    assert once == again
    assert once.by_scans is not None
    assert elsewhere.by_scans is not None
    assert once.by_scans.distance_to(elsewhere.by_scans) < 1e-6
