"""The requested motion decides between places, and can be driven at all of them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from firstfix.belief.judge import SECOND_LOOK_RAD
from firstfix.core.estimate import Evidence, Hypothesis
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.localizer.deciding_motion import advise, deciding_motion
from firstfix.localizer.outputs import MotionRequest

POSE = SE2(2.5, 2.0, 0.0)


def places(*poses: SE2) -> list[Hypothesis]:
    n, evidence = len(poses), Evidence(1.0, 0.0, 0.0, 0.0, 100)
    return [Hypothesis(pose, np.eye(3), 0.1, 1.0 / n, evidence) for pose in poses]


def seen(grid, pose, lidar, stamp=5.0):
    return lidar.scan(grid, pose, np.random.default_rng(0), stamp)


def moved(motion: MotionRequest) -> SE2:
    return SE2(0.0, 0.0, motion.turn) @ SE2(motion.ahead, 0.0, 0.0)


def test_a_robot_whose_places_differ_behind_it_turns(two_rooms, half_lidar):
    other = SE2(7.0, 0.0, 0.0) @ POSE
    scan = seen(two_rooms, POSE, half_lidar)
    motion = deciding_motion(scan, places(POSE, other), two_rooms)
    assert motion is not None
    assert motion.stamp == scan.stamp
    assert abs(motion.turn) > math.radians(80.0)
    # All of the uncertainty goes: the sensor sees different ranges there.
    assert motion.gain == pytest.approx(math.log(2.0), abs=0.1)
    views = [seen(two_rooms, pose @ moved(motion), half_lidar).ranges for pose in (POSE, other)]
    assert np.mean(np.abs(views[0] - views[1]) > 0.3) > 0.1


def test_the_order_of_two_places_makes_no_difference(two_rooms, half_lidar):
    other = SE2(7.0, 0.0, 0.0) @ POSE
    scan = seen(two_rooms, POSE, half_lidar)
    there = deciding_motion(scan, places(POSE, other), two_rooms)
    back = deciding_motion(scan, places(other, POSE), two_rooms)
    assert there == back


def test_no_motion_is_requested_between_identical_rooms(three_rooms):
    lidar = Lidar(beams=180)
    scan = seen(three_rooms, POSE, lidar)
    rooms = places(*(SE2(8.0 * i, 0.0, 0.0) @ POSE for i in range(3)))
    assert deciding_motion(scan, rooms, three_rooms) is None


def test_the_gain_is_the_expected_decrease_of_entropy(two_rooms, half_lidar):
    """Of three places two are identical: what is left in two cases of three is log 2."""
    other = SE2(7.0, 0.0, 0.0) @ POSE
    scan = seen(two_rooms, POSE, half_lidar)
    motion = deciding_motion(scan, places(POSE, POSE, other), two_rooms)
    assert motion is not None
    assert motion.gain == pytest.approx(math.log(3.0) - 2.0 / 3.0 * math.log(2.0), abs=0.1)


def test_differences_in_the_present_view_are_no_gain(three_rooms):
    """The present scan has not decided, although the map expects other ranges."""
    scan = seen(three_rooms, POSE, Lidar(beams=180))
    assert deciding_motion(scan, places(POSE, SE2(5.0, 3.0, 2.0)), three_rooms) is None


def test_places_that_are_no_rivals_do_not_count(two_rooms, half_lidar):
    here, there = places(POSE, SE2(7.0, 0.0, 0.0) @ POSE)
    scan = seen(two_rooms, POSE, half_lidar)
    unlikely = dataclasses.replace(there, probability=0.04)
    assert deciding_motion(scan, [here, unlikely], two_rooms) is None


@pytest.mark.parametrize("n", [0, 1])
def test_there_must_be_something_to_decide(hall_plan, n):
    pose = SE2(4.0, 3.0, 1.0)
    scan = seen(hall_plan, pose, Lidar(beams=60))
    assert deciding_motion(scan, places(*[pose] * n), hall_plan) is None


def test_the_way_is_free_wherever_the_robot_is(office):
    """A sensor of 1 m reach sees nothing at any of the places: only a drive can help."""
    lidar, asked_to_drive = Lidar(beams=60, range_max=1.0), 0
    drawn = random_free_poses(office, np.random.default_rng(0), 40, 1.05)
    for first, second in zip(drawn[::2], drawn[1::2], strict=True):
        motion = deciding_motion(seen(office, first, lidar), places(first, second), office)
        if motion is None or motion.ahead == 0.0:
            continue
        asked_to_drive += 1
        for pose in (first, second):
            (room,) = expected_ranges(office, pose, np.array([motion.turn]), 10.0)
            assert room >= motion.ahead + 0.4
    assert asked_to_drive > 5


def test_a_robot_without_space_to_drive_turns(two_rooms, half_lidar):
    """The places differ behind the robot, and at one of them a wall stands close behind it."""
    other = SE2(7.0, 0.0, 0.0) @ POSE
    walled = two_rooms.cells.copy()
    (x0, y0), (x1, y1) = np.rint(two_rooms.to_cells(np.array([[2.05, 1.5], [2.1, 2.5]])))
    walled[int(y0) : int(y1), int(x0) : int(x1)] = 100
    grid = type(two_rooms)(walled, two_rooms.resolution, two_rooms.T_map_grid)
    motion = deciding_motion(seen(grid, POSE, half_lidar), places(POSE, other), grid)
    assert motion is not None
    assert motion.ahead == 0.0
    assert abs(motion.turn) > math.radians(80.0)


def test_a_sensor_that_sees_nothing_leads_to_no_request(hall_plan):
    lidar = Lidar(beams=60, range_max=0.2)
    poses = [SE2(4.0, 3.0, 1.0), SE2(3.0, 3.0, -1.0)]
    assert deciding_motion(seen(hall_plan, poses[0], lidar), places(*poses), hall_plan) is None


def test_one_place_that_is_left_needs_a_second_look(hall_plan):
    pose = SE2(4.0, 3.0, 1.0)
    scan = seen(hall_plan, pose, Lidar(beams=60))
    words, motion = advise(scan, places(pose), 1, hall_plan)
    assert words == ""
    assert motion is not None
    assert motion.ahead == 0.0
    assert motion.turn > SECOND_LOOK_RAD


def test_rivals_without_a_deciding_motion_are_called_identical(three_rooms):
    scan = seen(three_rooms, POSE, Lidar(beams=180))
    rooms = places(*(SE2(8.0 * i, 0.0, 0.0) @ POSE for i in range(3)))
    words, motion = advise(scan, rooms, 3, three_rooms)
    assert words == "3 places look identical to this sensor; no motion of up to 3 m would decide"
    assert motion is None
