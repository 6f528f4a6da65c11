"""A belief that stops explaining the scans: new particles, from where one likes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import FilterState, start, step
from firstfix.amcl.initial import around_pose, free_poses
from firstfix.amcl.recovery import WeightHistory
from firstfix.amcl.sensor import build_sensor
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2

NEAR = np.diag([0.01, 0.01, 0.003])
MIDDLE = SE2(3.8, 3.1, 0.0)  # 1.7 m around it are free
ON = {"recovery_alpha_slow": 0.01, "recovery_alpha_fast": 0.5}
ELSEWHERE = SE2(6.8, 1.4, 2.0)


@pytest.fixture
def converged(observe, inject_free):
    """Give the belief of a robot that has stood in the middle for a while."""

    def converged(grid: OccupancyGrid, config: AmclConfig, seed: int = 0) -> FilterState:
        sensor, rng = build_sensor(grid, config), np.random.default_rng(seed)
        quiet = replace(config, recovery_alpha_slow=0.01, recovery_alpha_fast=0.01)
        state = start(around_pose(MIDDLE, NEAR, config.max_particles, rng))
        scan = observe(grid, MIDDLE)
        for _ in range(4):
            state = step(state, SE2.identity(), scan, sensor, rng, quiet, inject_free(grid))
        return replace(state, history=WeightHistory(0.4, 0.4))

    return converged


def test_without_recovery_nothing_is_ever_injected(room, never, fixed, observe, converged):
    config = fixed(200)
    state, sensor = converged(room, config), build_sensor(room, config)
    rng = np.random.default_rng(1)
    for _ in range(5):
        scan = observe(room, ELSEWHERE)
        state = step(state, SE2.identity(), scan, sensor, rng, config, never)
    assert state.particles.x.max() < 5.0


def test_a_scan_that_stops_fitting_brings_new_particles(
    room, fixed, observe, assert_is_belief, converged
):
    config = fixed(200, **ON)
    before, asked = converged(room, config), []
    marked = np.array([6.0, 2.0, 1.0])

    def inject(scans, n, rng):
        asked.append((scans, n))
        return np.tile(marked, (n, 1))

    scan = observe(room, ELSEWHERE)
    rng = np.random.default_rng(1)
    sensor = build_sensor(room, config)
    after = step(before, SE2.identity(), scan, sensor, rng, config, inject)
    ((given, n),) = asked
    assert given == (scan,)
    assert 0.1 * 200 < n < 200
    injected = (after.particles.poses() == marked).all(axis=1)
    assert injected.sum() == n
    assert len(after.particles) == 200
    assert after.history == WeightHistory()  # or it would go on until all is chance
    assert_is_belief(after, config)
    # The estimate precedes injection: injected particles do not change it.
    assert after.estimate.pose.distance_to(MIDDLE) < 0.5


def test_the_number_injected_follows_from_the_averages(room, never, fixed, observe, converged):
    config = fixed(1000, **ON)
    before = replace(converged(room, config), history=WeightHistory(0.5, 0.5))
    scan, sensor = observe(room, ELSEWHERE), build_sensor(room, config)
    seen = step(
        before,
        SE2.identity(),
        scan,
        sensor,
        np.random.default_rng(1),
        replace(config, resample_interval=1000),
        never,
    )
    asked = []

    def inject(scans, n, rng):
        asked.append(n)
        return free_poses(room, n, rng)

    step(before, SE2.identity(), scan, sensor, np.random.default_rng(1), config, inject)
    assert asked == [round(1000 * (1.0 - seen.history.fast / seen.history.slow))]


@pytest.mark.parametrize("offered", [0, 3, 5000])
def test_injection_may_give_fewer_or_more_than_asked(
    room, offered, observe, assert_is_belief, converged
):
    config = AmclConfig(min_particles=50, max_particles=300, **ON)
    before = converged(room, config)

    def inject(scans, n, rng):
        return np.tile([6.0, 2.0, 1.0], (offered, 1))

    scan, rng = observe(room, ELSEWHERE), np.random.default_rng(1)
    sensor = build_sensor(room, config)
    after = step(before, SE2.identity(), scan, sensor, rng, config, inject)
    assert_is_belief(after, config)
    injected = (after.particles.x == 6.0).sum()
    assert injected == min(offered, len(after.particles))


@pytest.mark.parametrize("seed", range(5))
def test_a_kidnapped_robot_is_found_at_the_injected_poses(room, seed, fixed, observe, converged):
    config = fixed(300, **ON)
    state, sensor = converged(room, config, seed), build_sensor(room, config)
    rng = np.random.default_rng(seed)

    def inject(scans, n, rng):
        return np.tile(ELSEWHERE.as_array(), (n, 1))

    for k in range(3):
        scan = observe(room, ELSEWHERE, k)
        state = step(state, SE2.identity(), scan, sensor, rng, config, inject)
    assert state.estimate.pose.distance_to(ELSEWHERE) < 0.1
    assert state.estimate.mass > 0.9


@pytest.mark.parametrize("seed", range(5))
def test_a_kidnapped_robot_is_found_by_chance(room, seed, fixed, observe, inject_free, converged):
    # So many, drawn so often, that no seed of 40 has missed.
    config = fixed(4000, recovery_alpha_slow=0.01, recovery_alpha_fast=0.9)
    state, sensor = converged(room, config, seed), build_sensor(room, config)
    rng = np.random.default_rng(seed)
    truth, increment = ELSEWHERE, SE2(0.0, 0.0, 0.3)
    found = []
    for k in range(40):
        truth = truth @ increment
        scan = observe(room, truth, k)
        state = step(state, increment, scan, sensor, rng, config, inject_free(room))
        found.append(state.estimate.pose.distance_to(truth) < 0.2)
    assert not found[0]
    assert all(found[-5:])
