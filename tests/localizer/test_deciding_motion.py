"""The motion asked for tells places apart, and can be driven at all of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.core.estimate import Evidence, Hypothesis
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.localizer.deciding_motion import deciding_motion
from firstfix.localizer.outputs import MotionRequest

POSE = SE2(2.5, 2.0, 0.0)


def places(*poses: SE2) -> list[Hypothesis]:
    n, evidence = len(poses), Evidence(1.0, 0.0, 0.0, 0.0, 100)
    return [Hypothesis(pose, np.eye(3), 0.1, 1.0 / n, evidence) for pose in poses]


def seen(grid, pose, lidar, stamp=5.0):
    return lidar.scan(grid, pose, np.random.default_rng(0), stamp)


def moved(motion: MotionRequest) -> SE2:
    return SE2(0.0, 0.0, motion.turn) @ SE2(motion.ahead, 0.0, 0.0)


def test_a_robot_that_must_look_behind_itself_is_asked_to_turn(two_rooms, half_lidar):
    other = SE2(7.0, 0.0, 0.0) @ POSE
    scan = seen(two_rooms, POSE, half_lidar)
    motion = deciding_motion(scan, places(POSE, other), two_rooms)
    assert motion is not None
    assert motion.stamp == scan.stamp
    assert abs(motion.turn) > math.radians(80.0)
    assert 0.1 < motion.gain <= 1.0
    # What is gained is what the sensor would see.
    views = [seen(two_rooms, pose @ moved(motion), half_lidar).ranges for pose in (POSE, other)]
    assert np.mean(np.abs(views[0] - views[1]) > 0.3) == pytest.approx(motion.gain, abs=0.1)


def test_which_place_comes_first_makes_no_difference_between_two(two_rooms, half_lidar):
    other = SE2(7.0, 0.0, 0.0) @ POSE
    scan = seen(two_rooms, POSE, half_lidar)
    there = deciding_motion(scan, places(POSE, other), two_rooms)
    back = deciding_motion(scan, places(other, POSE), two_rooms)
    assert there == back


def test_nothing_is_asked_for_where_nothing_would_help(three_rooms):
    lidar = Lidar(beams=180)
    scan = seen(three_rooms, POSE, lidar)
    rooms = places(*(SE2(8.0 * i, 0.0, 0.0) @ POSE for i in range(3)))
    assert deciding_motion(scan, rooms, three_rooms) is None


def test_one_twin_among_the_places_is_enough(three_rooms):
    """Telling the first from the third is worth nothing while it looks like the second."""
    lidar = Lidar(beams=180)
    scan = seen(three_rooms, POSE, lidar)
    twin, stranger = SE2(8.0, 0.0, 0.0) @ POSE, SE2(5.0, 3.0, 2.0)
    assert deciding_motion(scan, places(POSE, stranger), three_rooms) is not None
    assert deciding_motion(scan, places(POSE, stranger, twin), three_rooms) is None


@pytest.mark.parametrize("n", [0, 1])
def test_there_must_be_something_to_decide(hall_plan, n):
    pose = SE2(4.0, 3.0, 1.0)
    scan = seen(hall_plan, pose, Lidar(beams=60))
    assert deciding_motion(scan, places(*[pose] * n), hall_plan) is None


def test_the_way_is_free_wherever_the_robot_is(office):
    lidar, asked_to_drive = Lidar(beams=60, range_max=3.0), 0
    drawn = random_free_poses(office, np.random.default_rng(0), 120, 0.3)
    for first, second in zip(drawn[::2], drawn[1::2], strict=True):
        motion = deciding_motion(seen(office, first, lidar), places(first, second), office)
        if motion is None or motion.ahead == 0.0:
            continue
        asked_to_drive += 1
        for pose in (first, second):
            (room,) = expected_ranges(office, pose, np.array([motion.turn]), 10.0)
            assert room >= motion.ahead + 0.4
    assert asked_to_drive > 5


def test_who_cannot_drive_may_turn(two_rooms, half_lidar):
    """At one of the places the robot stands before a wall on every side that would help."""
    other = SE2(7.0, 0.0, 0.0) @ POSE
    boxed = two_rooms.cells.copy()
    ring = [(1.95, 1.45, 3.05, 1.55), (1.95, 2.45, 3.05, 2.55)]
    ring += [(1.95, 1.45, 2.05, 2.55), (2.95, 1.45, 3.05, 2.55)]
    for west, south, east, north in ring:
        (x0, y0), (x1, y1) = np.rint(two_rooms.to_cells(np.array([[west, south], [east, north]])))
        boxed[int(y0) : int(y1), int(x0) : int(x1)] = 100
    grid = type(two_rooms)(boxed, two_rooms.resolution, two_rooms.T_map_grid)
    motion = deciding_motion(seen(grid, POSE, half_lidar), places(POSE, other), grid)
    assert motion is not None
    assert motion.ahead == 0.0


def test_a_sensor_that_sees_nothing_asks_for_nothing(hall_plan):
    lidar = Lidar(beams=60, range_max=0.2)
    poses = [SE2(4.0, 3.0, 1.0), SE2(3.0, 3.0, -1.0)]
    assert deciding_motion(seen(hall_plan, poses[0], lidar), places(*poses), hall_plan) is None
