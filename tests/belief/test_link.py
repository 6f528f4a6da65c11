"""Whether a scan goes on where the one before ended."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from firstfix.belief.belief import begin, update
from firstfix.belief.link import link, nearly_all_goes_on
from firstfix.belief.view import Link, View
from firstfix.core.estimate import Verdict
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar

ALL_ROUND = Lidar(beams=180, sigma_m=0.01)
WIDE = Lidar(beams=121, fov=math.radians(120.0), range_max=8.0, sigma_m=0.01)
START = SE2(5.5, 1.5, 0.4)
SENSORS = pytest.mark.parametrize("lidar", [ALL_ROUND, WIDE])


@SENSORS
@pytest.mark.parametrize(
    "step", [SE2(0.0, 0.0, 0.0), SE2(0.1, 0.0, 0.0), SE2(-0.2, 0.05, 0.1), SE2(0.0, 0.0, -0.2)]
)
def test_a_robot_that_drives_sees_what_it_saw_before(room, drive, lidar, step):
    before, now = drive(room.grid, START, [step], lidar)
    assert link(before, now) is Link.GOES_ON
    assert nearly_all_goes_on(before, now)


@SENSORS
@pytest.mark.parametrize("there", [SE2(2.8, 2.5, 2.0), SE2(5.5, 1.5, 2.6), SE2(3.0, 4.6, -0.3)])
def test_a_robot_that_is_carried_away_sees_something_else(room, drive, lidar, there):
    (before,) = drive(room.grid, START, [], lidar)
    (now,) = drive(room.grid, there, [], lidar)
    assert link(before, now) is Link.BROKEN
    assert not nearly_all_goes_on(before, now)
    assert link(now, before) is Link.BROKEN


@SENSORS
def test_a_wheel_that_slips_is_no_kidnap(room, drive, lidar):
    before, now = drive(room.grid, START, [SE2(0.05, 0.0, math.radians(12.0))], lidar)
    slipped = dataclasses.replace(now, T_odom_base=before.T_odom_base @ SE2(0.05, 0.0, 0.0))
    assert link(before, slipped) is not Link.BROKEN


@pytest.mark.parametrize("step", [SE2(0.5, 0.0, 0.0), SE2(0.0, 0.0, 0.5)])
def test_nothing_is_said_after_a_longer_way(room, drive, step):
    before, now = drive(room.grid, START, [step], ALL_ROUND)
    assert link(before, now) is Link.UNKNOWN
    assert not nearly_all_goes_on(before, now)


def test_nothing_is_said_while_the_sensor_is_covered(room, drive):
    (before,) = drive(room.grid, START, [], ALL_ROUND)
    (scan,) = before.scans
    covered = dataclasses.replace(scan, ranges=np.full(len(scan), np.nan, np.float32))
    assert link(before, View.of(covered, before.T_odom_base)) is Link.UNKNOWN


def test_a_few_people_break_nothing(room, drive):
    before, now = drive(room.grid, START, [SE2(0.05, 0.0, 0.0)], ALL_ROUND)
    (scan,) = now.scans
    ranges = scan.ranges.copy()
    ranges[:30] = np.minimum(ranges[:30], 0.8)
    crowded = dataclasses.replace(now, scans=(dataclasses.replace(scan, ranges=ranges),))
    there, surely = link(before, crowded), nearly_all_goes_on(before, crowded)
    assert there is Link.GOES_ON
    assert not surely


def test_all_sensors_count(room, drive):
    before, now = drive(room.grid, START, [SE2(0.05, 0.0, 0.0)], WIDE)
    (elsewhere,) = drive(room.grid, SE2(3.0, 4.6, -0.3), [], WIDE)
    two = View((*before.scans, *before.scans), before.T_odom_base)
    same = View((*now.scans, *now.scans), now.T_odom_base)
    mixed = View((*now.scans, *elsewhere.scans), now.T_odom_base)
    assert link(two, same) is Link.GOES_ON
    assert not (link(two, mixed) is Link.GOES_ON and nearly_all_goes_on(two, mixed))


def test_a_step_that_scans_have_confirmed_goes_on_without_a_second_look(room, drive):
    (before,) = drive(room.grid, START, [], ALL_ROUND)
    (now,) = drive(room.grid, SE2(2.8, 2.5, 2.0), [], ALL_ROUND)
    assert link(before, now) is Link.BROKEN
    counted, next_one = (dataclasses.replace(view, unconfirmed=3) for view in (before, now))
    assert link(counted, next_one) is Link.GOES_ON
    assert not nearly_all_goes_on(counted, next_one)
    assert link(counted, dataclasses.replace(now, unconfirmed=4)) is Link.BROKEN
    far = SE2(1.0, 0.0, 0.0) @ before.T_odom_base
    assert link(counted, dataclasses.replace(next_one, T_odom_base=far)) is Link.UNKNOWN


# --- what the belief makes of it ---


THERE = SE2(11.0, 2.5, -2.0)
ROUND = SE2(0.25, 0.0, 0.25)


def beliefs_of_a_kidnap(halls, drive, how):
    """Drive in one hall, then in the other one; return the beliefs there, and the first link."""
    first = drive(halls.grid, SE2(2.0, 2.0, 0.3), [ROUND] * 24, WIDE)
    odometry = first[-1].T_odom_base
    then = drive(halls.grid, THERE, [ROUND] * 12, WIDE, odometry)
    views = [dataclasses.replace(view, link=Link.GOES_ON) for view in (*first, *then)]
    views[len(first)] = dataclasses.replace(then[0], link=how)
    belief, beliefs = begin(halls), []
    for view in views:
        belief = update(belief, view)
        beliefs.append(belief)
    return beliefs[len(first) :]


def views_until_it_is_found(beliefs):
    truth = THERE
    for count, belief in enumerate(beliefs, start=1):
        if belief.places[0].pose.distance_to(truth) < 0.2:
            return count
        truth = truth @ ROUND
    return math.inf


def test_a_view_that_does_not_go_on_lets_go_of_the_old_place_at_once(halls, drive):
    broken = views_until_it_is_found(beliefs_of_a_kidnap(halls, drive, Link.BROKEN))
    unseen = views_until_it_is_found(beliefs_of_a_kidnap(halls, drive, Link.GOES_ON))
    assert broken <= 3
    assert broken < unseen


def test_the_views_before_are_forgotten_once_the_robot_was_carried(halls, drive):
    beliefs = beliefs_of_a_kidnap(halls, drive, Link.BROKEN)
    assert beliefs[0].window[-1].link is Link.BROKEN
    assert len(beliefs[0].window) > 1  # not joined, though odometry stood still
    assert len(beliefs[6].window) == 7
    assert beliefs[-1].verdict is Verdict.UNIQUE
