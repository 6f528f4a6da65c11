"""Scans of a moving robot, straightened by odometry."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from firstfix.core.deskew import deskew, straighten
from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory

PERIOD_S = 0.1
N = 360
MOUNTS = [
    (SE2(0.0, 0.0, 0.0), Mounting.UPRIGHT),
    (SE2(0.3, -0.2, 1.0), Mounting.UPRIGHT),
    (SE2(0.3, -0.2, 1.0), Mounting.UPSIDE_DOWN),
]
# Slow and fast, turning both ways, driving backwards: x, y (m), yaw (rad) in a period.
MOTIONS = [SE2(0.1, 0.0, 0.08), SE2(-0.2, 0.0, -0.16), SE2(0.0, 0.0, 0.3), SE2(0.2, 0.05, 0.0)]


# Of the room, in the base frame at the first beam: off centre, so that turning shows.
CENTRE = np.array([0.8, -0.5])


def off_centre(scan):
    return np.hypot(*(scan.points() - CENTRE).T)


def in_round_room(T_base_laser, mounting, motion, radius=3.0):
    """A scan in a round room; one beam sees nothing."""
    share = np.arange(N) / (N - 1)
    blank = LaserScan(
        np.full(N, np.inf), -math.pi, 2 * math.pi / N, 0.1, 10.0, stamp=5.0,
        T_base_laser=T_base_laser, mounting=mounting, time_increment=PERIOD_S / (N - 1),
    )  # fmt: skip
    ranges = np.empty(N)
    for i, s in enumerate(share):
        at = SE2(s * motion.x, s * motion.y, s * motion.yaw) @ T_base_laser
        heading = at.yaw + blank.bearings[i]
        x, y = at.x - CENTRE[0], at.y - CENTRE[1]
        along = x * math.cos(heading) + y * math.sin(heading)
        ranges[i] = -along + math.sqrt(along**2 + radius**2 - x**2 - y**2)
    ranges[7] = np.inf
    return replace(blank, ranges=ranges)


@pytest.mark.parametrize(("T_base_laser", "mounting"), MOUNTS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_round_room_is_round_again(T_base_laser, mounting, motion):
    skewed = in_round_room(T_base_laser, mounting, motion)
    straight = straighten(skewed, motion)
    assert_allclose(off_centre(straight), 3.0, atol=1e-5)
    assert len(straight.points()) == N - 1
    assert straight.no_return[7]
    assert np.abs(off_centre(skewed) - 3.0).max() > 0.02


def test_motion_comes_from_the_odometry_of_the_sweep():
    motion = MOTIONS[0]
    skewed = in_round_room(*MOUNTS[1], motion)
    start = SE2(7.0, -3.0, 2.0)
    poses = [start @ SE2(-motion.x, 0.0, -motion.yaw), start, start @ motion]
    odometry = Trajectory([4.9, 5.0, 5.1], [pose.as_array() for pose in poses])
    assert_allclose(off_centre(deskew(skewed, odometry)), 3.0, atol=1e-3)
    recording = Recording((skewed,), odometry).deskewed()
    assert_allclose(off_centre(recording.scans[0]), 3.0, atol=1e-3)
    # On the live path, odometry ends before the scan does.
    known = Trajectory(odometry.stamps[:2], odometry.poses[:2])
    assert_allclose(off_centre(deskew(skewed, known)), 3.0, atol=0.02)


def test_a_scan_of_unknown_motion_or_skew_stays_as_it_is():
    scan = in_round_room(*MOUNTS[0], MOTIONS[0])
    odometry = Trajectory([4.9, 5.2], [[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    at_once = replace(scan, time_increment=0.0)
    assert deskew(at_once, odometry) is at_once
    too_slow = replace(scan, time_increment=1.0)
    assert deskew(too_slow, odometry) is too_slow
    for stamps in ([1.0, 2.0], [8.0, 9.0]):
        unknown = Trajectory(stamps, odometry.poses)
        assert deskew(scan, unknown) is scan
    assert deskew(scan, Trajectory([], np.empty((0, 3)))) is scan
    alone = Recording((scan,))
    assert alone.deskewed() is alone


def test_a_robot_at_rest_has_no_skew():
    scan = in_round_room(*MOUNTS[2], SE2.identity())
    straight = straighten(scan, SE2.identity())
    assert_allclose(straight.ranges, scan.ranges, rtol=1e-6)
    turned = np.remainder(straight.bearings - scan.bearings + math.pi, 2 * math.pi) - math.pi
    assert_allclose(turned, 0.0, atol=1e-6)


def test_a_hit_near_a_limit_stays_a_hit():
    scan = LaserScan(np.array([9.99, 0.11, 9.99]), -0.1, 0.1, 0.1, 10.0, time_increment=0.01)
    for motion in (SE2(0.5, 0.0, 0.0), SE2(-0.5, 0.0, 0.0)):
        assert straighten(scan, motion).hit.all()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"time_increment": -1.0}, "time_increment of at least 0 s"),
        ({"time_increment": math.nan}, "time_increment"),
        ({"directions": [0.0, 1.0]}, "1 finite directions"),
        ({"directions": [math.inf]}, "1 finite directions"),
    ],
)
def test_times_and_directions_are_checked(changes, words):
    with pytest.raises(ScanError, match=words):
        LaserScan(np.ones(1), 0.0, 0.1, 0.1, 10.0, **changes)
