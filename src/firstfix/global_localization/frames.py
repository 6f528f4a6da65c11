"""From the sensor's pose in cells of the grid to the base's pose in the map, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import wrap
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2


def to_cells(grid: OccupancyGrid, scan: LaserScan, T_map_base: SE2) -> NDArray[np.float64]:
    """Convert the base's pose in the map to the sensor's pose in cells: the inverse of `to_map`.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        Has the sensor's pose on the base.
    T_map_base : SE2
        The robot's pose.

    Returns
    -------
    ndarray, shape (3,)
        x, y (cells), heading (rad) of the sensor in the grid.
    """
    T_grid_laser = grid.T_map_grid.inverse() @ T_map_base @ scan.T_base_laser
    return T_grid_laser.as_array() / [grid.resolution, grid.resolution, 1.0]


def bases_in_map(
    grid: OccupancyGrid, scan: LaserScan, poses: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Convert poses of the sensor in cells to poses of the base in the map; `to_map` for many.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        Has the sensor's pose on the base.
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad) of the sensor in the grid.

    Returns
    -------
    ndarray, shape (n, 3)
        x (m), y (m), yaw (rad) of the base in the map frame.
    """
    x, y = grid.to_map(poses[:, :2]).T
    yaw = poses[:, 2] + grid.T_map_grid.yaw
    T_laser_base = scan.T_base_laser.inverse()
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.column_stack(
        [
            x + cos * T_laser_base.x - sin * T_laser_base.y,
            y + sin * T_laser_base.x + cos * T_laser_base.y,
            wrap(yaw + T_laser_base.yaw),
        ]
    )


def to_map(
    grid: OccupancyGrid,
    scan: LaserScan,
    pose: NDArray[np.float64],
    covariance: NDArray[np.float64],
) -> tuple[SE2, NDArray[np.float64]]:
    """Convert the sensor's pose in cells to the base's pose in the map.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        Has the sensor's pose on the base.
    pose : ndarray, shape (3,)
        x, y (cells), heading (rad) of the sensor in the grid.
    covariance : ndarray, shape (3, 3)
        Of these three.

    Returns
    -------
    SE2
        ``T_map_base``.
    ndarray, shape (3, 3)
        Covariance of x (m), y (m), yaw (rad) in the map frame.
    """
    x, y, heading = pose.tolist()
    T_grid_laser = SE2(x * grid.resolution, y * grid.resolution, heading)
    T_map_laser = grid.T_map_grid @ T_grid_laser
    T_map_base = T_map_laser @ scan.T_base_laser.inverse()
    scale = np.diag([grid.resolution, grid.resolution, 1.0])
    # A heading error swings the base around the sensor.
    lever = np.eye(3)
    lever[:2, 2] = -(T_map_base.y - T_map_laser.y), T_map_base.x - T_map_laser.x
    J = lever @ grid.T_map_grid.rotation_jacobian() @ scale
    return T_map_base, J @ covariance @ J.T
