"""One step of the filter, and some: weights, repeatability, odd scans and maps."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from firstfix.amcl.clusters import find_clusters
from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
from firstfix.amcl.filter import FilterState, start, step
from firstfix.amcl.initial import around_pose, over_free_space
from firstfix.amcl.particles import equal_weights
from firstfix.amcl.recovery import WeightHistory
from firstfix.amcl.sensor import build_sensor
from firstfix.core.angles import angle_error
from firstfix.core.grid import FREE, OCCUPIED, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2

NEAR = np.diag([0.01, 0.01, 0.003])
MIDDLE = SE2(3.8, 3.1, 0.0)  # 1.7 m around it are free
AHEAD = SE2(0.25, 0.0, 0.1)


def scan_of_range(reading: float) -> LaserScan:
    return LaserScan(np.full(60, reading, np.float32), -3.0, 0.1, 0.1, 8.0)


@pytest.mark.parametrize("model", SensorModel)
@pytest.mark.parametrize("motion", MotionModel)
def test_after_every_step_there_is_a_belief(room, model, motion, never, observe, assert_is_belief):
    config = AmclConfig(
        min_particles=50,
        max_particles=600,
        laser_model_type=model,
        robot_model_type=motion,
        do_beamskip=True,
        resample_interval=2,
    )
    sensor, rng = build_sensor(room, config), np.random.default_rng(0)
    state = start(over_free_space(room, 600, rng))
    pose = MIDDLE
    for k in range(6):
        state = step(state, AHEAD, observe(room, pose, k), sensor, rng, config, never)
        assert_is_belief(state, config)
        assert state.updates == k + 1
        if k % 2 == 1:
            assert np.ptp(state.particles.weight) == 0.0
        elif motion is not MotionModel.STATIONARY:
            assert np.ptp(state.particles.weight) > 0.0
        pose = pose @ AHEAD


@pytest.mark.parametrize("model", SensorModel)
@pytest.mark.parametrize("reading", [math.nan, math.inf, 0.0, 7.9])
def test_uninformative_and_invalid_scans_leave_a_belief(
    room, model, reading, fixed, assert_is_belief, inject_free
):
    config = fixed(100, laser_model_type=model, recovery_alpha_slow=0.01, recovery_alpha_fast=0.5)
    sensor, rng = build_sensor(room, config), np.random.default_rng(0)
    state = start(over_free_space(room, 100, rng))
    for _ in range(4):
        state = step(state, AHEAD, scan_of_range(reading), sensor, rng, config, inject_free(room))
        assert_is_belief(state, config)


@pytest.mark.parametrize("reading", [math.nan, 0.0])
def test_an_uninformative_scan_changes_neither_weights_nor_history(room, reading, never, fixed):
    config = fixed(100, recovery_alpha_slow=0.01, recovery_alpha_fast=0.5, resample_interval=10)
    before = replace(
        start(
            over_free_space(room, 100, np.random.default_rng(1)).reweighed(
                np.random.default_rng(2).random(100)
            )
        ),
        history=WeightHistory(0.4, 0.3),
    )
    sensor = build_sensor(room, config)
    rng = np.random.default_rng(3)
    after = step(before, AHEAD, scan_of_range(reading), sensor, rng, config, never)
    np.testing.assert_allclose(after.particles.weight, before.particles.weight)
    assert after.history == before.history


@pytest.mark.parametrize("model", SensorModel)
@pytest.mark.parametrize("shape", [(1, 1), (3, 5)])
def test_a_map_smaller_than_the_beams_reach_is_a_map(model, shape, never, fixed, assert_is_belief):
    cells = np.full(shape, FREE, np.int8)
    cells[-1, -1] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, SE2(2.0, 1.0, 0.5))
    config = fixed(40, laser_model_type=model)
    rng = np.random.default_rng(0)
    state = start(around_pose(SE2(2.0, 1.0, 0.0), np.eye(3), 40, rng))
    for _ in range(3):
        state = step(
            state, AHEAD, scan_of_range(3.0), build_sensor(grid, config), rng, config, never
        )
        assert_is_belief(state, config)


@pytest.mark.parametrize("model", SensorModel)
@pytest.mark.parametrize("x", [-30.0, 1e5, 1e12])
def test_particles_outside_the_map_are_a_belief(
    room, model, x, never, fixed, observe, assert_is_belief
):
    config = fixed(60, laser_model_type=model)
    rng = np.random.default_rng(0)
    state = start(around_pose(SE2(x, -x, 1.0), np.eye(3), 60, rng))
    for _ in range(3):
        scan = observe(room, MIDDLE)
        state = step(state, AHEAD, scan, build_sensor(room, config), rng, config, never)
        assert_is_belief(state, config)
    assert state.estimate.pose.x == pytest.approx(x, abs=10.0)


@pytest.mark.parametrize("model", SensorModel)
def test_one_particle_is_a_belief(room, model, never, fixed, observe, assert_is_belief):
    config = fixed(1, laser_model_type=model)
    rng = np.random.default_rng(0)
    state = start(around_pose(MIDDLE, NEAR, 1, rng))
    for increment in (AHEAD, SE2.identity(), AHEAD):
        scan = observe(room, MIDDLE)
        state = step(state, increment, scan, build_sensor(room, config), rng, config, never)
        assert_is_belief(state, config)
        assert state.elsewhere == 0.0


def test_the_estimate_is_the_heaviest_place(room):
    rng = np.random.default_rng(0)
    poses = np.concatenate(
        [around_pose(SE2(x, 3.0, 0.0), NEAR, n, rng).poses() for x, n in ((1.0, 30), (6.0, 70))]
    )
    state = start(equal_weights(poses))
    assert state.updates == 0
    assert state.history == WeightHistory()
    assert state.estimate.mass == pytest.approx(0.7, abs=0.05)
    assert state.estimate.pose.x == pytest.approx(6.0, abs=0.1)
    assert state.elsewhere == pytest.approx(1.0 - state.estimate.mass)


def test_masses_are_of_the_belief_after_the_scan(room, never, fixed, observe):
    """Not of the sharper one that estimates the mode."""
    config = fixed(500, resample_interval=5)
    rng = np.random.default_rng(0)
    state = start(over_free_space(room, 500, rng))
    state = step(
        state, AHEAD, observe(room, MIDDLE), build_sensor(room, config), rng, config, never
    )
    again = find_clusters(state.particles, state.particles.weight)
    assert [c.mass for c in state.clusters] == [c.mass for c in again]
    assert state.estimate.pose != again[0].pose


@pytest.mark.parametrize("model", SensorModel)
def test_one_seed_is_one_result_with_any_number_of_threads(room, model, observe, inject_free):
    """All share one sensor model, as the robots of one building do."""
    config = AmclConfig(
        min_particles=100,
        max_particles=800,
        laser_model_type=model,
        recovery_alpha_slow=0.01,
        recovery_alpha_fast=0.5,
    )
    sensor = build_sensor(room, config)
    scans = [observe(room, MIDDLE, k) for k in range(5)]

    def follow(seed: int) -> list[FilterState]:
        rng = np.random.default_rng(seed)
        states = [start(over_free_space(room, 800, rng))]
        for scan in scans:
            states.append(step(states[-1], AHEAD, scan, sensor, rng, config, inject_free(room)))
        return states

    alone = [follow(seed) for seed in range(4)]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(follow, [0, 1, 2, 3, 0, 1, 2, 3]))
    for one, other in zip(alone + alone, together, strict=True):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a.particles.poses(), b.particles.poses())
            np.testing.assert_array_equal(a.particles.weight, b.particles.weight)
            assert a.history == b.history
            assert [c.pose for c in a.clusters] == [c.pose for c in b.clusters]
            for p, q in zip(a.clusters, b.clusters, strict=True):
                np.testing.assert_array_equal(p.covariance, q.covariance)
    assert not np.array_equal(alone[0][-1].particles.poses(), alone[1][-1].particles.poses())


@pytest.mark.parametrize("move", [SE2(3.0, -40.0, 0.0), SE2(-7.0, 5.0, 2.3)], ids=str)
@pytest.mark.parametrize("model", SensorModel)
def test_moving_map_and_belief_together_moves_the_answer(room, move, model, never, fixed, observe):
    """Where a beam ends near the side of a cell, float32 may round to the other: so not exactly."""
    config = fixed(500, laser_model_type=model)
    there = OccupancyGrid(room.cells, room.resolution, move @ room.T_map_grid)
    belief = around_pose(MIDDLE, NEAR, 500, np.random.default_rng(0)).poses()
    moved = np.column_stack([move.apply(belief[:, :2]), belief[:, 2] + move.yaw])
    scan = observe(room, MIDDLE @ AHEAD)
    here, away = (
        step(
            start(equal_weights(poses)),
            AHEAD,
            scan,
            build_sensor(grid, config),
            np.random.default_rng(1),
            config,
            never,
        )
        for poses, grid in ((belief, room), (moved, there))
    )
    expected = move @ here.estimate.pose
    assert away.estimate.pose.distance_to(expected) < 1e-4
    assert angle_error(away.estimate.pose.yaw, expected.yaw) < 1e-4
    turned = move.rotation_jacobian() @ here.estimate.covariance @ move.rotation_jacobian().T
    np.testing.assert_allclose(away.estimate.covariance, turned, atol=1e-5)


def test_resampling_comes_when_it_is_due(room, never, fixed, observe):
    config = fixed(200, resample_interval=3)
    sensor, rng = build_sensor(room, config), np.random.default_rng(0)
    state = start(around_pose(MIDDLE, NEAR, 200, rng))
    equal = []
    for _ in range(6):
        state = step(state, SE2.identity(), observe(room, MIDDLE), sensor, rng, config, never)
        equal.append(bool(np.ptp(state.particles.weight) == 0.0))
    assert equal == [False, False, True, False, False, True]


@pytest.mark.parametrize("spread", [1e-4, 0.5])
def test_selective_resampling_waits_until_few_particles_carry_the_belief(
    room, spread, never, fixed, observe
):
    config = fixed(200, selective_resampling=True)
    sensor, rng = build_sensor(room, config), np.random.default_rng(0)
    state = start(around_pose(MIDDLE, np.diag([1.0, 1.0, 0.1]) * spread**2, 200, rng))
    before = state.particles.poses()
    silent = replace(config, alpha1=0.0, alpha2=0.0, alpha3=0.0, alpha4=0.0)
    turn = SE2(0.0, 0.0, math.radians(1.0))
    scan = observe(room, MIDDLE @ turn)
    state = step(state, turn, scan, sensor, rng, silent, never)
    kept = len(np.unique(state.particles.x)) == len(before)
    assert kept == (spread < 0.01)
    assert (np.ptp(state.particles.weight) > 0.0) == kept


def test_what_never_moves_does_not_become_sure_by_odometry_that_drifts(room, never, fixed, observe):
    config = fixed(200, robot_model_type=MotionModel.STATIONARY)
    sensor, rng = build_sensor(room, config), np.random.default_rng(0)
    state = start(around_pose(MIDDLE, NEAR, 200, rng))
    for k in range(60):
        state = step(state, AHEAD, observe(room, MIDDLE, k), sensor, rng, config, never)
    assert len(np.unique(state.particles.x)) > 20
    assert state.estimate.covariance[0, 0] > 1e-5
