"""Chains of rigid motions for many poses at once, in cells of the grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import wrap
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2


def in_cells(transform: SE2, resolution: float) -> NDArray[np.float64]:
    """Return x, y (cells), yaw (rad) of a transform, shape (3,)."""
    return transform.as_array() / [resolution, resolution, 1.0]


def compose(poses: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Chain every pose with one transform: ``T_grid_b = T_grid_a @ T_a_b``.

    Parameters
    ----------
    poses : ndarray, shape (..., 3)
        x, y (cells), heading (rad).
    step : ndarray, shape (3,)
        The same, in the frame of each pose.

    Returns
    -------
    ndarray, shape (..., 3)
        The chained poses.
    """
    c, s = np.cos(poses[..., 2]), np.sin(poses[..., 2])
    x = poses[..., 0] + c * step[0] - s * step[1]
    y = poses[..., 1] + s * step[0] + c * step[1]
    return np.stack([x, y, poses[..., 2] + step[2]], axis=-1)


def inverse(step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the transform of the opposite direction, shape (3,)."""
    c, s = np.cos(step[2]), np.sin(step[2])
    return np.array([-(c * step[0] + s * step[1]), s * step[0] - c * step[1], -step[2]])


def between(start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``T_start_end`` of two poses in one frame, shape (3,)."""
    return compose(inverse(start), end)


def to_map(poses: NDArray[np.float64], grid: OccupancyGrid) -> NDArray[np.float64]:
    """Bring poses in cells, shape (n, 3), to x (m), y (m), yaw (rad) in the map frame."""
    yaw: NDArray[np.float64] = wrap(poses[:, 2] + grid.T_map_grid.yaw)
    return np.column_stack([grid.to_map(poses[:, :2]), yaw])
