"""Scans of a robot that moves while its laser turns, straightened by its odometry."""

import dataclasses
import math

import numpy as np
import pytest

from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.sweep import sweep
from firstfix.localizer.config import LocalizerConfig, ScansConfig
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.odometry_buffer import OdometryBuffer
from firstfix.localizer.outputs import TrackedPose

LIDAR = Lidar(beams=180, sigma_m=0.0)
START = SE2(3.0, 2.5, 0.4)


def at(stamp: float) -> SE2:
    """Drive at up to 1 m/s and turn at up to 60 degrees a second."""
    return START @ SE2(math.sin(stamp), 0.0, math.radians(60.0) * math.sin(stamp))


def median_error(grid, config: ScansConfig) -> float:
    localizer = Localizer(LocalizerConfig(scans=config))
    localizer.handle(NewMap(0.0, grid))
    rng, floor, errors = np.random.default_rng(0), Floor(grid), []
    for k in range(-3, 12):
        stamp = 10.0 + k / 10
        for part in (0.0, 0.05, 0.1):
            T_odom_base = START.inverse() @ at(stamp - 10.0 + part)
            localizer.handle(Odometry(stamp + part, T_odom_base))
        begun, ended = at(stamp - 10.0), at(stamp - 9.9)
        scan = sweep(LIDAR, floor, begun, rng, stamp=stamp, T_map_base_after=ended)
        scan = dataclasses.replace(scan, time_increment=0.1 / len(scan))
        poses = [o for o in localizer.handle(scan) if isinstance(o, TrackedPose)]
        errors += [pose.T_map_base.distance_to(begun) for pose in poses]
    assert len(errors) > 8
    return float(np.median(errors))


def test_straightening_removes_the_error_of_the_motion(hall_plan):
    on, off = (median_error(hall_plan, ScansConfig(deskew=deskew)) for deskew in (True, False))
    assert on < 0.01
    assert off > 2.0 * on


def test_a_scan_of_a_robot_at_rest_stays_as_it_is(in_hall):
    scan = dataclasses.replace(in_hall.scan(), stamp=in_hall.stamp + 0.1, time_increment=1e-4)
    in_hall.pass_time(0.2)
    in_hall.send(Odometry(in_hall.stamp, in_hall.T_odom_base))
    in_hall.send(scan)
    assert in_hall.localizer.view.scans[0] is scan


def buffer(*stamps: float) -> OdometryBuffer:
    made = OdometryBuffer()
    for stamp in stamps:
        made.add(Odometry(stamp, SE2(stamp, 0.0, 0.0)))
    return made


@pytest.mark.parametrize(
    ("stamp", "duration", "moved"),
    [(0.1, 0.2, 0.2), (0.9, 0.2, 0.2), (0.9, 0.4, None), (-0.1, 0.2, None), (2.0, 0.1, None)],
)
def test_motion_is_known_within_odometry_and_a_little_beyond(stamp, duration, moved):
    motion = buffer(0.0, 0.25, 0.5, 0.75, 1.0).motion(stamp, duration)
    if moved is None:
        assert motion is None
    else:
        assert motion.x == pytest.approx(moved)
