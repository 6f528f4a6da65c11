"""A moment holds what came from one scan to the next."""

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry, Signal
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.rigs import RIGS, Rig, Shutter
from firstfix.lab.simulation.robot import Kobuki
from firstfix.lab.simulation.simulation import Disturbance, Simulation

START = SE2(4.0, 1.5, 0.3)


def simulation(grid: OccupancyGrid, shutter: Shutter = Shutter.AT_ONCE) -> Simulation:
    rig = Rig((Lidar(sigma_m=0.0),), shutter=shutter)
    return Simulation(Floor(grid), Kobuki(), rig, START, np.random.SeedSequence(1))


def turning(T_map_base: SE2) -> tuple[float, float]:
    return 0.3, 1.0


def test_odometry_and_signals_come_before_the_scan_of_their_stamp(hall_plan: OccupancyGrid) -> None:
    moments_of = simulation(hall_plan)
    moments_of.step("first", turning)
    moments_of.robot.lift()
    kinds = [type(event) for event in moments_of.step("second").events]
    assert kinds == [Signal, Signal, Odometry, LaserScan, Odometry, Odometry, Odometry, Odometry]


def test_two_sensors_report_at_the_stamp_of_one_odometry(hall_plan: OccupancyGrid) -> None:
    moments_of = simulation(hall_plan)
    moments_of.rig = RIGS["two-lasers"]
    moment = moments_of.step("drive", turning)
    assert [type(event) for event in moment.events[:3]] == [Odometry, LaserScan, LaserScan]
    assert [scan.stamp for scan in moment.scans] == [0.0, 0.0]
    assert [scan.T_base_laser for scan in moment.scans] == [
        lidar.T_base_laser for lidar in RIGS["two-lasers"].lidars
    ]


def test_truth_is_that_of_the_scan(hall_plan: OccupancyGrid) -> None:
    moments_of = simulation(hall_plan)
    for expected in (0.0, 0.1, 0.2):
        T_map_base = moments_of.robot.T_map_base
        moment = moments_of.step("drive", turning)
        assert moment.T_map_base == T_map_base
        assert moment.scan is not None
        assert moment.scan.stamp == moment.stamp == pytest.approx(expected)
    assert moments_of.robot.T_map_base.distance_to(START) > 0.0


def test_a_disturbance_is_reported_once(hall_plan: OccupancyGrid) -> None:
    moments_of = simulation(hall_plan)
    moments_of.disturbed(Disturbance.PUSHED)
    reported = [moments_of.step("stand").disturbance for _ in range(2)]
    assert reported == [Disturbance.PUSHED, None]


@pytest.mark.parametrize("command", [None, turning])
def test_only_motion_skews_a_scan(hall_plan: OccupancyGrid, command: object) -> None:
    scans = []
    for shutter in Shutter:
        moments_of = simulation(hall_plan, shutter)
        for _ in range(5):
            moment = moments_of.step("x", command) if command else moments_of.step("x")  # type: ignore[arg-type]
        assert moment.scan is not None
        scans.append(moment.scan.ranges)
    assert (scans[0] == scans[1]).all() == (command is None)


def test_what_goes_with_the_robot_is_seen_beside_it(hall_plan: OccupancyGrid) -> None:
    moments_of = simulation(hall_plan)
    scan = moments_of.step("carry", hands=np.array([[0.5, 0.0, 0.1]])).scan
    assert scan is not None
    assert scan.ranges[180] == pytest.approx(0.4, abs=1e-5)
