"""What is found in cells of the grid becomes the robot's pose in the map."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.angles import wrap
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.frames import to_cells, to_map

metres = st.floats(-50.0, 50.0)
poses = st.builds(SE2, metres, metres, st.floats(-4.0, 4.0))
resolutions = st.sampled_from([0.01, 0.05, 0.25])
in_cells = st.tuples(st.floats(0.0, 500.0), st.floats(0.0, 500.0), st.floats(-7.0, 7.0))


def grid_at(T_map_grid: SE2, resolution: float) -> OccupancyGrid:
    return OccupancyGrid(np.zeros((4, 4), np.int8), resolution, T_map_grid)


def scan_from(T_base_laser: SE2) -> LaserScan:
    return LaserScan(np.ones(3, np.float32), 0.0, 0.1, 0.1, 5.0, T_base_laser=T_base_laser)


def spd(seed: int) -> np.ndarray:
    A = np.random.default_rng(seed).standard_normal((3, 3))
    return A @ A.T + 0.1 * np.eye(3)


@given(poses, poses, in_cells, resolutions)
def test_the_sensor_stands_where_it_was_found(T_map_grid, T_base_laser, pose, resolution):
    grid = grid_at(T_map_grid, resolution)
    T_map_base, _ = to_map(grid, scan_from(T_base_laser), np.array(pose), np.eye(3))
    T_map_laser = T_map_base @ T_base_laser
    np.testing.assert_allclose(
        grid.to_cells(np.array([T_map_laser.x, T_map_laser.y])), pose[:2], atol=1e-6
    )
    assert abs(wrap(T_map_laser.yaw - T_map_grid.yaw - pose[2])) < 1e-9


@given(poses, poses, in_cells, resolutions)
def test_into_cells_is_the_way_back(T_map_grid, T_base_laser, pose, resolution):
    grid, scan = grid_at(T_map_grid, resolution), scan_from(T_base_laser)
    T_map_base, _ = to_map(grid, scan, np.array(pose), np.eye(3))
    back = to_cells(grid, scan, T_map_base)
    np.testing.assert_allclose(back[:2], pose[:2], atol=1e-6)
    assert abs(wrap(back[2] - pose[2])) < 1e-9


@given(poses, poses, poses, resolutions)
def test_out_of_cells_is_the_way_back(T_map_grid, T_base_laser, T_map_base, resolution):
    grid, scan = grid_at(T_map_grid, resolution), scan_from(T_base_laser)
    back, _ = to_map(grid, scan, to_cells(grid, scan, T_map_base), np.eye(3))
    assert back.distance_to(T_map_base) < 1e-9
    assert abs(wrap(back.yaw - T_map_base.yaw)) < 1e-9


@given(poses, poses, in_cells, resolutions, st.integers(0, 1000))
def test_the_covariance_moves_as_small_errors_do(T_map_grid, T_base_laser, pose, resolution, seed):
    grid, scan, covariance = grid_at(T_map_grid, resolution), scan_from(T_base_laser), spd(seed)
    _, moved = to_map(grid, scan, np.array(pose), covariance)
    J = np.empty((3, 3))
    h = 1e-5
    for i in range(3):
        ends = []
        for sign in (-1.0, 1.0):
            shifted = np.array(pose)
            shifted[i] += sign * h
            ends.append(to_map(grid, scan, shifted, covariance)[0].as_array())
        difference = ends[1] - ends[0]
        difference[2] = wrap(float(difference[2]))
        J[:, i] = difference / (2 * h)
    expected = J @ covariance @ J.T
    np.testing.assert_allclose(moved, expected, atol=1e-5 * max(1.0, np.abs(expected).max()))
    np.testing.assert_allclose(moved, moved.T, atol=1e-9 * np.abs(moved).max())


def test_a_pose_is_made_of_plain_numbers():
    pose, _ = to_map(grid_at(SE2(1, 2, 3), 0.1), scan_from(SE2.identity()), np.ones(3), np.eye(3))
    assert [type(number) for number in (pose.x, pose.y, pose.yaw)] == [float] * 3


def test_a_drawn_case():
    """Cells of 0.1 m; the map lies turned by 90 degrees at (1, 2), the sensor sits 0.5 m ahead."""
    grid = grid_at(SE2(1.0, 2.0, math.pi / 2), 0.1)
    covariance = np.diag([4.0, 1.0, 0.01])
    T_map_base, moved = to_map(
        grid, scan_from(SE2(0.5, 0.0, 0.0)), np.array([30.0, 10.0, 0.0]), covariance
    )
    # The sensor is at (0, 5) in the map and looks along +y; the base is half a metre behind it.
    np.testing.assert_allclose(T_map_base.as_array(), [0.0, 4.5, math.pi / 2], atol=1e-12)
    # Grid x is map y; half a metre of lever turns 0.1 rad of heading into 0.05 m across.
    np.testing.assert_allclose(np.diag(moved), [0.01 + 0.25 * 0.01, 0.04, 0.01], atol=1e-12)
