"""Scans of a moving sensor among people: each beam starts at the pose of its own time."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.kernel_cache import kernel
from firstfix.fields.raycast import cast_ray_leaping
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar

NOBODY: NDArray[np.float64] = np.empty((0, 3))
"""No circles."""


def sweep(
    lidar: Lidar,
    floor: Floor,
    T_map_base: SE2,
    rng: np.random.Generator,
    *,
    stamp: float = 0.0,
    circles: NDArray[np.float64] = NOBODY,
    T_map_base_after: SE2 | None = None,
) -> LaserScan:
    """Take one scan of walls, furniture and people.

    Parameters
    ----------
    lidar : Lidar
        The sensor.
    floor : Floor
        Walls and furniture.
    T_map_base : SE2
        Pose of the robot at the first beam.
    rng : numpy.random.Generator
        Source of noise and dropouts.
    stamp : float
        Time of the first beam, s.
    circles : ndarray, shape (n, 3)
        People: x, y in the map frame, radius; m.
    T_map_base_after : SE2 or None
        Pose of the robot one turn of the sensor later, if motion skews the scan.
    """
    resolution = floor.grid.resolution
    bearings = lidar.bearings
    x, y, yaw = _poses_of_beams(lidar, floor.T_grid_map, T_map_base, T_map_base_after)
    round_things = np.empty((len(circles), 3))
    round_things[:, :2] = floor.grid.to_cells(circles[:, :2])
    round_things[:, 2] = circles[:, 2] / resolution
    cells = _cast(
        floor.clearance,
        x / resolution,
        y / resolution,
        yaw + bearings,
        round_things,
        lidar.range_max / resolution,
    )
    return lidar.measure(resolution * cells, rng, stamp)


def _poses_of_beams(
    lidar: Lidar, T_grid_map: SE2, T_map_base: SE2, T_map_base_after: SE2 | None
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return x, y (m), yaw (rad) of the sensor in the grid's frame, each of shape (beams,)."""
    first = T_grid_map @ T_map_base @ lidar.T_base_laser
    last = first
    if T_map_base_after is not None:
        last = T_grid_map @ T_map_base_after @ lidar.T_base_laser
    share = np.arange(lidar.beams, dtype=np.float64) * (lidar.angle_increment / FULL_TURN)
    turn = (first.inverse() @ last).yaw
    return (
        first.x + share * (last.x - first.x),
        first.y + share * (last.y - first.y),
        first.yaw + share * turn,
    )


@kernel
def _cast(
    clearance: NDArray[np.uint8],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    headings: NDArray[np.float64],
    circles: NDArray[np.float64],
    max_range_cells: float,
) -> NDArray[np.float64]:
    """Return how far each beam goes, cells; inf where it meets nothing."""
    ranges = np.empty(headings.size, np.float64)
    for i in range(headings.size):
        dx, dy = math.cos(headings[i]), math.sin(headings[i])
        reach = cast_ray_leaping(clearance, x[i], y[i], dx, dy, max_range_cells)
        for j in range(circles.shape[0]):
            to_x, to_y, radius = circles[j, 0] - x[i], circles[j, 1] - y[i], circles[j, 2]
            along = to_x * dx + to_y * dy
            across = to_x * dy - to_y * dx
            half = radius * radius - across * across
            if half > 0.0 and along + radius > 0.0:
                # A sensor inside the circle measures 0.
                inside = to_x * to_x + to_y * to_y < radius * radius
                near = 0.0 if inside else along - math.sqrt(half)
                if 0.0 <= near < reach:
                    reach = near
        ranges[i] = reach if reach < max_range_cells else np.inf
    return ranges
