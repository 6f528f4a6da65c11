"""The beam model: equal to the textbook's mixture over rays cast one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from firstfix.amcl.beam_selection import select_beams
from firstfix.amcl.config import AmclConfig, SensorModel
from firstfix.amcl.particles import Particles, equal_weights
from firstfix.amcl.ray_model import RayModel
from firstfix.core.angles import wrap
from firstfix.core.grid import OCCUPIED, OccupancyGrid
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.lab.simulation.lidar import Lidar

BEAM = AmclConfig(laser_model_type=SensorModel.BEAM)
PLACE = SE2(0.4, -0.3, 2.0)


def scan_of(n: int, seed: int = 0, **rest: object) -> LaserScan:
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0.1, 6.0, n).astype(np.float32)
    ranges[::7] = math.inf
    ranges[5::9] = math.nan
    return LaserScan(ranges, -2.0, 4.0 / n, 0.05, 5.0, **rest)


def somewhere(n: int, seed: int = 0) -> Particles:
    """Poses in the room, in its walls, and outside the map."""
    rng = np.random.default_rng(seed)
    return equal_weights(rng.uniform([-3.0, -3.0, -4.0], [11.0, 9.0, 4.0], (n, 3)))


def textbook(measured: float, expected: float, range_max: float, config: AmclConfig) -> float:
    """Table 6.1, without normalisers, as in Nav2."""
    p = config.z_hit * math.exp(-((measured - expected) ** 2) / (2.0 * config.sigma_hit**2))
    if measured < expected:
        p += config.z_short * config.lambda_short * math.exp(-config.lambda_short * measured)
    if measured == range_max:
        p += config.z_max
    if measured < range_max:
        p += config.z_rand / range_max
    return p


def brute_force(
    particles: Particles, scan: LaserScan, grid: OccupancyGrid, config: AmclConfig
) -> tuple[NDArray[np.float64], int]:
    """Look at the scan itself: this twin shares no line with `select_beams`, either."""
    reach = min(scan.range_max, config.laser_max_range)
    valid = scan.hit | scan.no_return
    logs = np.zeros(len(particles))
    for k, pose in enumerate(particles.poses()):
        T_map_laser = SE2.from_array(pose) @ scan.T_base_laser
        cast = np.minimum(expected_ranges(grid, T_map_laser, scan.bearings, reach), reach)
        for measured, expected in zip(scan.ranges[valid].tolist(), cast[valid], strict=True):
            logs[k] += math.log(textbook(min(measured, reach), expected, reach, config))
    return logs, int(valid.sum())


@pytest.mark.parametrize("mounting", Mounting)
@pytest.mark.parametrize("place", [SE2.identity(), PLACE], ids=str)
def test_logs_are_those_of_the_textbook(room, mounting, place):
    scan = scan_of(40, T_base_laser=place, mounting=mounting)
    logs, used = RayModel(room, BEAM).log_likelihood(somewhere(100), select_beams(scan, BEAM))
    expected, expected_used = brute_force(somewhere(100), scan, room, BEAM)
    assert used == expected_used
    np.testing.assert_allclose(logs, expected, rtol=1e-6)
    assert np.ptp(expected) > 1.0


def test_other_parameters_of_the_mixture(room):
    config = AmclConfig(
        laser_model_type=SensorModel.BEAM,
        z_hit=0.8,
        z_short=0.4,
        z_max=0.2,
        z_rand=0.1,
        sigma_hit=0.4,
        lambda_short=1.5,
        laser_max_range=4.0,
    )
    scan = scan_of(40, 1)
    logs, _ = RayModel(room, config).log_likelihood(somewhere(60, 1), select_beams(scan, config))
    np.testing.assert_allclose(
        logs, brute_force(somewhere(60, 1), scan, room, config)[0], rtol=1e-6
    )


@pytest.mark.parametrize("move", [SE2(0.0, 0.0, 2.0), SE2(40.0, -7.0, 0.0), SE2(-9.0, 80.0, -1.1)])
def test_moving_map_and_particles_together_changes_nothing(room, move):
    there = OccupancyGrid(room.cells, room.resolution, move @ room.T_map_grid)
    poses = somewhere(200, 2).poses()
    moved = np.column_stack([move.apply(poses[:, :2]), wrap(poses[:, 2] + move.yaw)])
    beams = select_beams(scan_of(40, 2, T_base_laser=PLACE), BEAM)
    logs, _ = RayModel(room, BEAM).log_likelihood(equal_weights(poses), beams)
    moved_logs, _ = RayModel(there, BEAM).log_likelihood(equal_weights(moved), beams)
    # A ray past the very corner of a cell may turn out either way; of 8000, at most one does.
    same = np.isclose(moved_logs, logs, rtol=1e-6)
    assert same.mean() >= 0.99


@pytest.mark.parametrize("seed", range(5))
def test_no_pose_explains_a_scan_better_than_the_true_one(room, seed):
    rng = np.random.default_rng(seed)
    truth = SE2(rng.uniform(3.3, 5.3), rng.uniform(1.6, 5.5), rng.uniform(-3.0, 3.0))
    scan = Lidar(beams=60, sigma_m=0.0, T_base_laser=PLACE).scan(room, truth, rng)
    poses = np.vstack([truth.as_array(), somewhere(300, seed).poses()])
    logs, _ = RayModel(room, BEAM).log_likelihood(equal_weights(poses), select_beams(scan, BEAM))
    assert logs[1:].max() < logs[0]


def one_beam(measured: float, **settings: float) -> float:
    """Log-likelihood of a beam along x, 3 m before a wall, of a sensor that sees 5 m."""
    cells = np.zeros((10, 60), np.int8)
    cells[:, 40:] = OCCUPIED
    config = AmclConfig(laser_model_type=SensorModel.BEAM, **settings)
    scan = LaserScan(np.array([measured], np.float32), 0.0, 0.1, 0.05, 5.0)
    logs, _ = RayModel(OccupancyGrid(cells, 0.1), config).log_likelihood(
        equal_weights(np.array([[1.0, 0.55, 0.0]])), select_beams(scan, config)
    )
    return float(logs[0])


def test_each_part_of_the_mixture_has_its_place():
    hit, short, beyond, nothing = (one_beam(r) for r in (3.0, 1.0, 4.0, math.inf))
    anyway = 0.5 / 5.0
    assert hit == pytest.approx(math.log(0.5 + anyway))
    assert short == pytest.approx(math.log(anyway + 0.05 * 0.1 * math.exp(-0.1)))
    assert beyond == pytest.approx(math.log(anyway + 0.5 * math.exp(-0.5 * 5.0**2)))
    assert nothing == pytest.approx(math.log(0.05 + 0.5 * math.exp(-0.5 * 10.0**2)))


def test_what_cannot_be_is_only_very_unlikely():
    assert one_beam(math.inf, z_max=0.0, sigma_hit=0.01) == pytest.approx(math.log(1e-9))


def test_where_nothing_is_in_reach_no_return_is_what_was_expected(room):
    away = equal_weights(np.array([[100.0, 100.0, 1.0]]))
    scan = LaserScan(np.full(20, math.inf, np.float32), -1.0, 0.1, 0.05, 5.0)
    logs, used = RayModel(room, BEAM).log_likelihood(away, select_beams(scan, BEAM))
    assert used == 20
    assert logs[0] == pytest.approx(20 * math.log(0.5 + 0.05))


def test_a_scan_without_valid_reading_is_uninformative(room):
    scan = LaserScan(np.full(20, math.nan, np.float32), -1.0, 0.1, 0.05, 5.0)
    logs, used = RayModel(room, BEAM).log_likelihood(somewhere(20), select_beams(scan, BEAM))
    assert used == 0
    assert not logs.any()


def test_a_sensor_without_limit_can_be_used(room):
    """Its no return is an infinite range, and so may be the expected one: their difference."""
    config = AmclConfig(laser_model_type=SensorModel.BEAM, laser_max_range=-1.0)
    ranges = np.array([1.0, math.inf, 2.0], np.float32)
    scan = LaserScan(ranges, -1.0, 0.1, 0.05, math.inf)
    logs, _ = RayModel(room, config).log_likelihood(somewhere(50), select_beams(scan, config))
    assert np.isfinite(logs).all()
