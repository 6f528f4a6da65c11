"""One step of the filter, and many: weights, repeatability, honesty, recovery."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from firstfix.amcl.clusters import find_clusters
from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
from firstfix.amcl.filter import FilterState, start, step
from firstfix.amcl.initial import around_pose, free_poses, over_free_space
from firstfix.amcl.motion import propagate
from firstfix.amcl.particles import equal_weights
from firstfix.amcl.recovery import WeightHistory
from firstfix.amcl.sensor import build_sensor
from firstfix.core.angles import angle_error, wrap
from firstfix.core.grid import FREE, OCCUPIED, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.sim.lidar import Lidar

LIDAR = Lidar(beams=60)
NEAR = np.diag([0.01, 0.01, 0.003])
MIDDLE = SE2(3.8, 3.1, 0.0)  # 1.7 m around it are free
AHEAD = SE2(0.25, 0.0, 0.1)
# Chi square of three degrees of freedom: below it in 99.7 % of all cases, as 3 sigma are of one.
THREE_SIGMA = 14.16


def never(scan: LaserScan, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    raise AssertionError("nothing is to be injected")


def fixed(n: int, **settings: object) -> AmclConfig:
    return AmclConfig(min_particles=n, max_particles=n, **settings)


def looking(grid: OccupancyGrid, pose: SE2, seed: int = 0) -> LaserScan:
    return LIDAR.scan(grid, pose, np.random.default_rng(seed))


def says(reading: float) -> LaserScan:
    return LaserScan(np.full(60, reading, np.float32), -3.0, 0.1, 0.1, 8.0)


def assert_is_belief(state: FilterState, config: AmclConfig) -> None:
    assert state.particles.weight.sum() == pytest.approx(1.0, abs=1e-12)
    assert state.particles.weight.min() >= 0.0
    assert config.min_particles <= len(state.particles) <= config.max_particles
    assert np.isfinite(state.particles.poses()).all()
    assert (np.abs(state.particles.yaw) <= math.pi).all()
    assert sum(c.mass for c in state.clusters) <= 1.0 + 1e-12
    for cluster in state.clusters:
        assert np.isfinite(cluster.covariance).all()


def drive(
    grid: OccupancyGrid, config: AmclConfig, seed: int, steps: int = 20
) -> list[tuple[SE2, FilterState]]:
    """Drive about the middle of the room; odometry is as wrong as the filter is told."""
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
            float(np.clip(wrap(home - truth.yaw), -0.6, 0.6)) if away else world.uniform(-0.3, 0.3)
        )
        increment = SE2(0.15 * math.cos(turn / 2), 0.15 * math.sin(turn / 2), turn)
        moved = propagate(equal_weights(truth.as_array()[None]), increment, config, world)
        truth = SE2.from_array(moved.poses()[0])
        assert truth.distance_to(MIDDLE) < 1.7  # or it may have driven through a wall
        scan = LIDAR.scan(grid, truth, world)
        state = step(state, increment, scan, sensor, rng, config, never)
        trace.append((truth, state))
    return trace


def squared_error(truth: SE2, state: FilterState) -> float:
    """Normalised by the covariance of the estimate (NEES), of three degrees of freedom."""
    off = state.estimate.pose.as_array() - truth.as_array()
    off[2] = wrap(off[2])
    return float(off @ np.linalg.solve(state.estimate.covariance, off))


@pytest.mark.parametrize("alpha", [0.2, 0.05])
def test_the_truth_is_within_three_sigma_of_the_estimate(room, alpha):
    alphas = {f"alpha{k}": alpha for k in range(1, 5)}
    config = fixed(400, **alphas)
    traces = [drive(room, config, seed) for seed in range(50)]
    errors = np.array([squared_error(*now) for trace in traces for now in trace])
    assert (errors < THREE_SIGMA).mean() >= 0.95
    # Nor is that so because it claims to know nothing.
    sigmas = [np.sqrt(np.diag(s.estimate.covariance)) for trace in traces for _, s in trace[5:]]
    assert np.median(sigmas, axis=0)[:2].max() < 0.15
    assert np.median(sigmas, axis=0)[2] < math.radians(5.0)


def test_the_estimate_follows_the_robot(room):
    traces = [drive(room, fixed(400), seed) for seed in range(10)]
    off = [t.distance_to(s.estimate.pose) for trace in traces for t, s in trace]
    turned = [angle_error(t.yaw, s.estimate.pose.yaw) for trace in traces for t, s in trace]
    assert np.median(off) < 0.06
    assert max(off) < 0.5
    assert np.median(turned) < math.radians(1.5)


@pytest.mark.parametrize("model", SensorModel)
@pytest.mark.parametrize("motion", MotionModel)
def test_after_every_step_there_is_a_belief(room, model, motion):
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
        state = step(state, AHEAD, looking(room, pose, k), sensor, rng, config, never)
        assert_is_belief(state, config)
        assert state.updates == k + 1
        if k % 2 == 1:
            assert np.ptp(state.particles.weight) == 0.0
        elif motion is not MotionModel.STATIONARY:
            assert np.ptp(state.particles.weight) > 0.0
        pose = pose @ AHEAD


@pytest.mark.parametrize("model", SensorModel)
@pytest.mark.parametrize("reading", [math.nan, math.inf, 0.0, 7.9])
def test_scans_that_say_nothing_or_nonsense_leave_a_belief(room, model, reading):
    config = fixed(100, laser_model_type=model, recovery_alpha_slow=0.01, recovery_alpha_fast=0.5)
    sensor, rng = build_sensor(room, config), np.random.default_rng(0)
    state = start(over_free_space(room, 100, rng))
    for _ in range(4):
        state = step(state, AHEAD, says(reading), sensor, rng, config, inject_free(room))
        assert_is_belief(state, config)


@pytest.mark.parametrize("reading", [math.nan, 0.0])
def test_a_scan_that_says_nothing_changes_neither_weights_nor_history(room, reading):
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
    after = step(before, AHEAD, says(reading), sensor, rng, config, never)
    np.testing.assert_allclose(after.particles.weight, before.particles.weight)
    assert after.history == before.history


@pytest.mark.parametrize("model", SensorModel)
@pytest.mark.parametrize("shape", [(1, 1), (3, 5)])
def test_a_map_smaller_than_the_beams_reach_is_a_map(model, shape):
    cells = np.full(shape, FREE, np.int8)
    cells[-1, -1] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, SE2(2.0, 1.0, 0.5))
    config = fixed(40, laser_model_type=model)
    rng = np.random.default_rng(0)
    state = start(around_pose(SE2(2.0, 1.0, 0.0), np.eye(3), 40, rng))
    for _ in range(3):
        state = step(state, AHEAD, says(3.0), build_sensor(grid, config), rng, config, never)
        assert_is_belief(state, config)


@pytest.mark.parametrize("model", SensorModel)
@pytest.mark.parametrize("x", [-30.0, 1e5, 1e12])
def test_particles_outside_the_map_are_a_belief(room, model, x):
    config = fixed(60, laser_model_type=model)
    rng = np.random.default_rng(0)
    state = start(around_pose(SE2(x, -x, 1.0), np.eye(3), 60, rng))
    for _ in range(3):
        scan = looking(room, MIDDLE)
        state = step(state, AHEAD, scan, build_sensor(room, config), rng, config, never)
        assert_is_belief(state, config)
    assert state.estimate.pose.x == pytest.approx(x, abs=10.0)


@pytest.mark.parametrize("model", SensorModel)
def test_one_particle_is_a_belief(room, model):
    config = fixed(1, laser_model_type=model)
    rng = np.random.default_rng(0)
    state = start(around_pose(MIDDLE, NEAR, 1, rng))
    for increment in (AHEAD, SE2.identity(), AHEAD):
        scan = looking(room, MIDDLE)
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


def test_masses_are_of_the_belief_after_the_scan(room):
    """Not of the sharper one in which the peak is looked for."""
    config = fixed(500, resample_interval=5)
    rng = np.random.default_rng(0)
    state = start(over_free_space(room, 500, rng))
    state = step(
        state, AHEAD, looking(room, MIDDLE), build_sensor(room, config), rng, config, never
    )
    again = find_clusters(state.particles, state.particles.weight)
    assert [c.mass for c in state.clusters] == [c.mass for c in again]
    assert state.estimate.pose != again[0].pose


@pytest.mark.parametrize("model", SensorModel)
def test_one_seed_is_one_result_with_any_number_of_threads(room, model):
    """All share one sensor model, as the robots of one building do."""
    config = AmclConfig(
        min_particles=100,
        max_particles=800,
        laser_model_type=model,
        recovery_alpha_slow=0.01,
        recovery_alpha_fast=0.5,
    )
    sensor = build_sensor(room, config)
    scans = [looking(room, MIDDLE, k) for k in range(5)]

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
def test_moving_map_and_belief_together_moves_the_answer(room, move, model):
    """Where a beam ends near the side of a cell, float32 may round to the other: so not exactly."""
    config = fixed(500, laser_model_type=model)
    there = OccupancyGrid(room.cells, room.resolution, move @ room.T_map_grid)
    belief = around_pose(MIDDLE, NEAR, 500, np.random.default_rng(0)).poses()
    moved = np.column_stack([move.apply(belief[:, :2]), belief[:, 2] + move.yaw])
    scan = looking(room, MIDDLE @ AHEAD)
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


def test_resampling_comes_when_it_is_due(room):
    config = fixed(200, resample_interval=3)
    sensor, rng = build_sensor(room, config), np.random.default_rng(0)
    state = start(around_pose(MIDDLE, NEAR, 200, rng))
    equal = []
    for _ in range(6):
        state = step(state, SE2.identity(), looking(room, MIDDLE), sensor, rng, config, never)
        equal.append(bool(np.ptp(state.particles.weight) == 0.0))
    assert equal == [False, False, True, False, False, True]


@pytest.mark.parametrize("spread", [1e-4, 0.5])
def test_selective_resampling_waits_until_few_particles_carry_the_belief(room, spread):
    config = fixed(200, selective_resampling=True)
    sensor, rng = build_sensor(room, config), np.random.default_rng(0)
    state = start(around_pose(MIDDLE, np.diag([1.0, 1.0, 0.1]) * spread**2, 200, rng))
    before = state.particles.poses()
    silent = replace(config, alpha1=0.0, alpha2=0.0, alpha3=0.0, alpha4=0.0)
    turn = SE2(0.0, 0.0, math.radians(1.0))
    scan = looking(room, MIDDLE @ turn)
    state = step(state, turn, scan, sensor, rng, silent, never)
    kept = len(np.unique(state.particles.x)) == len(before)
    assert kept == (spread < 0.01)
    assert (np.ptp(state.particles.weight) > 0.0) == kept


def test_what_never_moves_does_not_become_sure_by_odometry_that_drifts(room):
    config = fixed(200, robot_model_type=MotionModel.STATIONARY)
    sensor, rng = build_sensor(room, config), np.random.default_rng(0)
    state = start(around_pose(MIDDLE, NEAR, 200, rng))
    for k in range(60):
        state = step(state, AHEAD, looking(room, MIDDLE, k), sensor, rng, config, never)
    assert len(np.unique(state.particles.x)) > 20
    assert state.estimate.covariance[0, 0] > 1e-5


# ---- recovery


def inject_free(grid: OccupancyGrid):
    return lambda scan, n, rng: free_poses(grid, n, rng)


ON = {"recovery_alpha_slow": 0.01, "recovery_alpha_fast": 0.5}
ELSEWHERE = SE2(6.8, 1.4, 2.0)


def well_known(grid: OccupancyGrid, config: AmclConfig, seed: int = 0) -> FilterState:
    """The belief of a robot that has stood in the middle for a while."""
    sensor, rng = build_sensor(grid, config), np.random.default_rng(seed)
    quiet = replace(config, recovery_alpha_slow=0.01, recovery_alpha_fast=0.01)
    state = start(around_pose(MIDDLE, NEAR, config.max_particles, rng))
    scan = looking(grid, MIDDLE)
    for _ in range(4):
        state = step(state, SE2.identity(), scan, sensor, rng, quiet, inject_free(grid))
    return replace(state, history=WeightHistory(0.4, 0.4))


def test_without_recovery_nothing_is_ever_injected(room):
    config = fixed(200)
    state, sensor = well_known(room, config), build_sensor(room, config)
    rng = np.random.default_rng(1)
    for _ in range(5):
        scan = looking(room, ELSEWHERE)
        state = step(state, SE2.identity(), scan, sensor, rng, config, never)
    assert state.particles.x.max() < 5.0


def test_a_scan_that_stops_fitting_brings_new_particles(room):
    config = fixed(200, **ON)
    before, asked = well_known(room, config), []
    marked = np.array([6.0, 2.0, 1.0])

    def inject(scan, n, rng):
        asked.append((scan, n))
        return np.tile(marked, (n, 1))

    scan = looking(room, ELSEWHERE)
    rng = np.random.default_rng(1)
    sensor = build_sensor(room, config)
    after = step(before, SE2.identity(), scan, sensor, rng, config, inject)
    ((told, n),) = asked
    assert told is scan
    assert 0.1 * 200 < n < 200
    injected = (after.particles.poses() == marked).all(axis=1)
    assert injected.sum() == n
    assert len(after.particles) == 200
    assert after.history == WeightHistory()  # or it would go on until all is chance
    assert_is_belief(after, config)
    # The estimate is that of before: chance has no say in where the robot is.
    assert after.estimate.pose.distance_to(MIDDLE) < 0.5


def test_how_many_come_is_what_the_averages_say(room):
    config = fixed(1000, **ON)
    before = replace(well_known(room, config), history=WeightHistory(0.5, 0.5))
    scan, sensor = looking(room, ELSEWHERE), build_sensor(room, config)
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

    def inject(scan, n, rng):
        asked.append(n)
        return free_poses(room, n, rng)

    step(before, SE2.identity(), scan, sensor, np.random.default_rng(1), config, inject)
    assert asked == [round(1000 * (1.0 - seen.history.fast / seen.history.slow))]


@pytest.mark.parametrize("offered", [0, 3, 5000])
def test_injection_may_give_fewer_or_more_than_asked(room, offered):
    config = AmclConfig(min_particles=50, max_particles=300, **ON)
    before = well_known(room, config)

    def inject(scan, n, rng):
        return np.tile([6.0, 2.0, 1.0], (offered, 1))

    scan, rng = looking(room, ELSEWHERE), np.random.default_rng(1)
    sensor = build_sensor(room, config)
    after = step(before, SE2.identity(), scan, sensor, rng, config, inject)
    assert_is_belief(after, config)
    injected = (after.particles.x == 6.0).sum()
    assert injected == min(offered, len(after.particles))


@pytest.mark.parametrize("seed", range(5))
def test_a_kidnapped_robot_is_found_where_the_injection_says(room, seed):
    config = fixed(300, **ON)
    state, sensor = well_known(room, config, seed), build_sensor(room, config)
    rng = np.random.default_rng(seed)

    def inject(scan, n, rng):
        return np.tile(ELSEWHERE.as_array(), (n, 1))

    for k in range(3):
        scan = looking(room, ELSEWHERE, k)
        state = step(state, SE2.identity(), scan, sensor, rng, config, inject)
    assert state.estimate.pose.distance_to(ELSEWHERE) < 0.1
    assert state.estimate.mass > 0.9


@pytest.mark.parametrize("seed", range(5))
def test_a_kidnapped_robot_is_found_by_chance(room, seed):
    # So many, drawn so often, that no seed of 40 has missed.
    config = fixed(4000, recovery_alpha_slow=0.01, recovery_alpha_fast=0.9)
    state, sensor = well_known(room, config, seed), build_sensor(room, config)
    rng = np.random.default_rng(seed)
    truth, increment = ELSEWHERE, SE2(0.0, 0.0, 0.3)
    found = []
    for k in range(40):
        truth = truth @ increment
        scan = looking(room, truth, k)
        state = step(state, increment, scan, sensor, rng, config, inject_free(room))
        found.append(state.estimate.pose.distance_to(truth) < 0.2)
    assert not found[0]
    assert all(found[-5:])
