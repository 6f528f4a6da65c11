"""Many steps of the filter: it follows the robot, and its covariance matches its errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import FilterState, start, step
from firstfix.amcl.initial import around_pose
from firstfix.amcl.motion import propagate
from firstfix.amcl.particles import equal_weights
from firstfix.amcl.sensor import build_sensor
from firstfix.core.angles import angle_error, wrap
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar

LIDAR = Lidar(beams=60)
NEAR = np.diag([0.01, 0.01, 0.003])
MIDDLE = SE2(3.8, 3.1, 0.0)  # 1.7 m around it are free
# Chi square of three degrees of freedom: below it in 99.7 % of all cases, as 3 sigma are of one.
THREE_SIGMA = 14.16


@pytest.fixture
def drive(never):
    """Give a function that drives about the middle with the odometry noise of the settings."""

    def drive(
        grid: OccupancyGrid, config: AmclConfig, seed: int, steps: int = 20
    ) -> list[tuple[SE2, FilterState]]:
        world, rng = np.random.default_rng(1000 + seed), np.random.default_rng(seed)
        truth = SE2(MIDDLE.x, MIDDLE.y, world.uniform(-3.0, 3.0))
        first = SE2.from_array(world.multivariate_normal(truth.as_array(), NEAR))
        state = start(around_pose(first, NEAR, config.max_particles, rng))
        sensor = build_sensor(grid, config)
        trace = []
        for _ in range(steps):
            home = math.atan2(MIDDLE.y - truth.y, MIDDLE.x - truth.x)
            away = truth.distance_to(MIDDLE) > 0.4
            turn = (
                float(np.clip(wrap(home - truth.yaw), -0.6, 0.6))
                if away
                else world.uniform(-0.3, 0.3)
            )
            increment = SE2(0.15 * math.cos(turn / 2), 0.15 * math.sin(turn / 2), turn)
            moved = propagate(equal_weights(truth.as_array()[None]), increment, config, world)
            truth = SE2.from_array(moved.poses()[0])
            assert truth.distance_to(MIDDLE) < 1.7  # or it may have driven through a wall
            scan = LIDAR.scan(grid, truth, world)
            state = step(state, increment, scan, sensor, rng, config, never)
            trace.append((truth, state))
        return trace

    return drive


def squared_error(truth: SE2, state: FilterState) -> float:
    """Normalised by the covariance of the estimate (NEES), of three degrees of freedom."""
    off = state.estimate.pose.as_array() - truth.as_array()
    off[2] = wrap(off[2])
    return float(off @ np.linalg.solve(state.estimate.covariance, off))


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [0.2, 0.05])
def test_the_truth_is_within_three_sigma_of_the_estimate(room, alpha, fixed, drive):
    alphas = {f"alpha{k}": alpha for k in range(1, 5)}
    config = fixed(400, **alphas)
    traces = [drive(room, config, seed) for seed in range(50)]
    errors = np.array([squared_error(*now) for trace in traces for now in trace])
    assert (errors < THREE_SIGMA).mean() >= 0.95
    # The covariance is not merely large.
    sigmas = [np.sqrt(np.diag(s.estimate.covariance)) for trace in traces for _, s in trace[5:]]
    assert np.median(sigmas, axis=0)[:2].max() < 0.15
    assert np.median(sigmas, axis=0)[2] < math.radians(5.0)


def test_the_estimate_follows_the_robot(room, fixed, drive):
    traces = [drive(room, fixed(400), seed) for seed in range(10)]
    off = [t.distance_to(s.estimate.pose) for trace in traces for t, s in trace]
    turned = [angle_error(t.yaw, s.estimate.pose.yaw) for trace in traces for t, s in trace]
    assert np.median(off) < 0.06
    assert max(off) < 0.5
    assert np.median(turned) < math.radians(1.5)
