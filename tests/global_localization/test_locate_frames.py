"""Where the map lies and where the sensor sits moves the answer, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from firstfix.core.angles import FULL_TURN, angle_error
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import identical_rooms, random_free_pose

LIDAR = Lidar(beams=360, sigma_m=0.01)


@pytest.mark.parametrize("origin", [SE2(12.5, -7.25, 0.0), SE2(-3.0, 40.0, 1.0), SE2(0, 0, 3.14)])
@pytest.mark.parametrize("method", [Method.FAST, Method.PAPER])
def test_where_the_map_lies_moves_the_answer_and_nothing_else(origin, method):
    grid = identical_rooms(1)
    moved = OccupancyGrid(grid.cells, grid.resolution, origin @ grid.T_map_grid)
    rng = np.random.default_rng(3)
    scan = LIDAR.scan(grid, random_free_pose(grid, rng), rng)
    here = ScanMatcher(grid, method=method).locate(scan)
    there = ScanMatcher(moved, method=method).locate(scan)
    assert (here.verdict, here.reason, here.search) == (there.verdict, there.reason, there.search)
    R = origin.rotation_jacobian()
    for a, b in zip(here.hypotheses, there.hypotheses, strict=True):
        expected = origin @ a.pose
        assert expected.distance_to(b.pose) < 1e-9
        assert angle_error(expected.yaw, b.pose.yaw) < 1e-9
        np.testing.assert_allclose(R @ a.covariance @ R.T, b.covariance, rtol=1e-6, atol=1e-12)
        assert (a.score, a.probability, a.evidence) == (b.score, b.probability, b.evidence)


@pytest.mark.parametrize("method", [Method.FAST, Method.PAPER])
def test_where_the_sensor_sits_moves_the_base_and_nothing_else(method, with_pose):
    grid = identical_rooms(1)
    rng = np.random.default_rng(4)
    scan = LIDAR.scan(grid, random_free_pose(grid, rng), rng)
    T_base_laser = SE2(0.3, -0.2, 2.2)
    matcher = ScanMatcher(grid, method=method)
    laser, base = (matcher.locate(s) for s in (scan, with_pose(scan, T_base_laser=T_base_laser)))
    assert laser.verdict is base.verdict
    for a, b in zip(laser.hypotheses, base.hypotheses, strict=True):
        on_robot = b.pose @ T_base_laser
        assert a.pose.distance_to(on_robot) < 1e-9
        assert angle_error(a.pose.yaw, on_robot.yaw) < 1e-9
        assert (a.score, a.probability, a.evidence) == (b.score, b.probability, b.evidence)


def test_upside_down_with_mirrored_bearings_is_the_same_scan(office_locator, content_of, with_pose):
    rng = np.random.default_rng(5)
    grid = office_locator.fields.grid
    scan = LIDAR.scan(grid, random_free_pose(grid, rng), rng)
    hanging = with_pose(
        scan,
        angle_min=-scan.angle_min,
        angle_increment=-scan.angle_increment,
        mounting=Mounting.UPSIDE_DOWN,
    )
    assert content_of(office_locator.locate(hanging)) == content_of(office_locator.locate(scan))


@pytest.mark.parametrize("mounting", Mounting)
def test_a_sensor_anywhere_on_the_robot(mounting, office_locator, found):
    grid = office_locator.fields.grid
    lidar = Lidar(sigma_m=0.01, T_base_laser=SE2(0.2, -0.1, 2.0), mounting=mounting)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(grid, rng, clearance_m=0.5)
        assert found(office_locator.locate(lidar.scan(grid, truth, rng)), truth, 0.05, 0.5)


def test_bearings_from_0_to_a_full_turn_are_as_good_as_from_minus_half(
    office_locator, found, with_pose
):
    rng = np.random.default_rng(6)
    grid = office_locator.fields.grid
    truth = random_free_pose(grid, rng)
    scan = LIDAR.scan(grid, truth, rng)
    rolled = with_pose(scan, ranges=np.roll(scan.ranges, -180), angle_min=0.0)
    turned = with_pose(scan, angle_min=scan.angle_min + FULL_TURN)
    for same in (rolled, turned):
        assert found(office_locator.locate(same), truth, 0.05, 0.5)
