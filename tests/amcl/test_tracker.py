"""Following: when to update, where the robot is in between, and what standing still does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import start, step
from firstfix.amcl.initial import around_pose
from firstfix.amcl.sensor import build_sensor
from firstfix.amcl.tracker import Track, Tracker
from firstfix.core.angles import angle_error, wrap
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar

LIDAR = Lidar(beams=60)
POSE = SE2(3.8, 3.1, 0.4)
ODOM = SE2(-7.0, 2.0, 2.9)  # of no meaning to the map
NEAR = np.diag([0.01, 0.01, 0.003])
CONFIG = AmclConfig(min_particles=300, max_particles=300)


def never(scan, n, rng):
    raise AssertionError("nothing is to be injected")


def tracker_of(grid: OccupancyGrid, config: AmclConfig = CONFIG) -> Tracker:
    return Tracker(build_sensor(grid, config), config, never)


def observe(grid: OccupancyGrid, pose: SE2, seed: int = 0) -> LaserScan:
    return LIDAR.scan(grid, pose, np.random.default_rng(seed))


def begun(grid: OccupancyGrid, rng: np.random.Generator, config: AmclConfig = CONFIG) -> Track:
    belief = around_pose(POSE, NEAR, config.max_particles, rng)
    return tracker_of(grid, config).begin(belief, ODOM, observe(grid, POSE), rng)


def test_a_track_begins_with_one_update(room):
    track = begun(room, np.random.default_rng(0))
    assert track.state.updates == 1
    assert track.T_odom_base == ODOM
    assert track.state.estimate.pose.distance_to(POSE) < 0.15


@pytest.mark.parametrize(
    ("moved", "updates"),
    [
        (SE2.identity(), 0),
        (SE2(0.24, 0.0, 0.0), 0),
        (SE2(0.26, 0.0, 0.0), 1),
        (SE2(-0.26, 0.0, 0.0), 1),
        (SE2(0.15, -0.15, 0.0), 0),
        (SE2(0.18, -0.18, 0.0), 1),
        (SE2(0.0, 0.0, 0.19), 0),
        (SE2(0.0, 0.0, 0.21), 1),
        (SE2(0.0, 0.0, -0.21), 1),
        (SE2(0.24, 0.0, -0.19), 0),
        (SE2(0.0, 0.0, math.pi), 1),
    ],
)
def test_a_scan_is_taken_in_when_the_robot_has_moved_enough(room, moved, updates):
    rng = np.random.default_rng(0)
    track = begun(room, rng)
    after = tracker_of(room).follow(track, ODOM @ moved, observe(room, POSE @ moved), rng)
    assert after.state.updates == 1 + updates
    assert (after is track) == (updates == 0)
    if updates:
        assert after.T_odom_base == ODOM @ moved


def test_small_motions_add_up(room):
    """The increment is counted from the last update, not from the last scan."""
    rng = np.random.default_rng(0)
    track, updates = begun(room, rng), []
    for k in range(1, 9):
        T_odom_base = ODOM @ SE2(0.1 * k, 0.0, 0.0)
        scan = observe(room, POSE @ SE2(0.1 * k, 0.0, 0.0))
        track = tracker_of(room).follow(track, T_odom_base, scan, rng)
        updates.append(track.state.updates - 1)
    assert updates == [0, 0, 1, 1, 1, 2, 2, 2]
    assert track.state.estimate.pose.distance_to(POSE @ SE2(0.6, 0.0, 0.0)) < 0.15


def test_where_updates_are_asked_for_at_every_scan_there_is_one(room):
    config = AmclConfig(update_min_d=0.0, min_particles=50, max_particles=50)
    rng = np.random.default_rng(0)
    track = begun(room, rng, config)
    after = tracker_of(room, config).follow(track, ODOM, observe(room, POSE), rng)
    assert after.state.updates == 2


@pytest.mark.parametrize("moved", [SE2(0.3, 0.0, 0.0), SE2(-0.3, 0.1, 0.5)])
def test_drift_and_odometry_are_the_pose(room, moved):
    rng = np.random.default_rng(0)
    track = begun(room, rng)
    scan = observe(room, POSE @ moved)
    for now in (track, tracker_of(room).follow(track, ODOM @ moved, scan, rng)):
        pose = now.T_map_odom @ now.T_odom_base
        assert pose.distance_to(now.state.estimate.pose) < 1e-9
        assert angle_error(pose.yaw, now.state.estimate.pose.yaw) < 1e-9
    # Between two updates odometry carries the robot on from there.
    onwards = track.T_map_odom @ (ODOM @ moved)
    expected = track.state.estimate.pose @ moved
    assert onwards.distance_to(expected) < 1e-9


def test_an_update_is_a_step_by_what_odometry_moved(room):
    config, sensor = CONFIG, build_sensor(room, CONFIG)
    track = begun(room, np.random.default_rng(0))
    moved = SE2(0.4, -0.1, 0.3)
    scan = observe(room, POSE @ moved)
    after = Tracker(sensor, config, never).update(
        track, ODOM @ moved, scan, np.random.default_rng(1)
    )
    increment = ODOM.inverse() @ (ODOM @ moved)
    twin = step(track.state, increment, scan, sensor, np.random.default_rng(1), config, never)
    np.testing.assert_array_equal(after.state.particles.poses(), twin.particles.poses())
    assert after.state.estimate.pose.distance_to(POSE @ moved) < 0.15


def test_the_frame_of_odometry_means_nothing(room):
    """Up to rounding: the increment is the same, wherever odometry began."""
    moved, poses = SE2(0.4, -0.1, 0.3), []
    for T_odom_base in (ODOM, SE2(500.0, 300.0, -1.0)):
        rng = np.random.default_rng(0)
        belief = around_pose(POSE, NEAR, 300, rng)
        tracker = tracker_of(room)
        track = tracker.begin(belief, T_odom_base, observe(room, POSE), rng)
        track = tracker.follow(track, T_odom_base @ moved, observe(room, POSE @ moved), rng)
        poses.append(track.state.estimate.pose)
    assert poses[0].distance_to(poses[1]) < 1e-3


@pytest.mark.parametrize("seed", range(6))
def test_standing_still_does_not_make_sure(room, seed):
    """200 scans of the same walls contain little more than one."""
    rng = np.random.default_rng(seed)
    truth = SE2.from_array(rng.multivariate_normal(POSE.as_array(), NEAR))
    tracker = tracker_of(room)
    belief = around_pose(POSE, NEAR, 300, rng)
    track = tracker.begin(belief, ODOM, observe(room, truth, seed), rng)
    errors = []
    for k in range(200):
        track = tracker.update(track, ODOM, observe(room, truth, 1000 * seed + k), rng)
        estimate = track.state.estimate
        off = estimate.pose.as_array() - truth.as_array()
        off[2] = wrap(off[2])
        errors.append(off @ np.linalg.solve(estimate.covariance, off))
        sigma = np.sqrt(np.diag(estimate.covariance))
        assert sigma[:2].min() > 0.01
        assert sigma[2] > math.radians(0.5)
        assert len(np.unique(track.state.particles.x)) > 50
    assert (np.array(errors) < 14.16).mean() >= 0.95
    assert track.state.estimate.pose.distance_to(truth) < 0.1


def test_steps_that_scans_have_confirmed_spread_the_particles_half_as_much(room):
    """The noise of the odometry is halved if every step since the last update is confirmed."""
    blind = LaserScan(np.full(60, np.nan, np.float32), -math.pi, math.tau / 60, 0.1, 12.0)
    at_one_place = around_pose(POSE, np.diag([1e-12] * 3), 300, np.random.default_rng(0))
    tracker, spreads = tracker_of(room), []
    for before, now in ((4, 4), (4, 5), (None, None), (None, 4), (4, None)):
        rng = np.random.default_rng(1)
        track = Track(start(at_one_place), ODOM, before)
        after = tracker.follow(track, ODOM @ SE2(0.4, 0.0, 0.0), blind, rng, now)
        assert after.unconfirmed == now
        spreads.append(np.hypot(np.std(after.state.particles.x), np.std(after.state.particles.y)))
    confirmed, *others = spreads
    assert confirmed == pytest.approx(0.5 * others[0], rel=0.1)
    assert others == pytest.approx([others[0]] * 4)
