"""Ray casting: what an ideal sensor would measure in the map.

Positions are continuous cell coordinates (x = column, y = row, in cells; a cell is the floor of
both), directions are those of the grid (counter-clockwise from +x), lengths are cells. A ray ends
where it enters the first occupied cell. Unknown cells and the world outside the map are
transparent.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.kernel_cache import kernel, part

# Stands for 1/0 in the direction a ray does not move: times 0 it is 0 where infinity were NaN,
# times the side of any map it is still finite.
_NEVER = 1e290

# A leap lands only farther than this from the nearest grid line, else the walk takes one step: far
# above the rounding of a coordinate in the largest map (1e-7 cells), far below a cell.
_NEAR_LINE = 1e-5


def expected_ranges(
    grid: OccupancyGrid,
    T_map_laser: SE2,
    bearings: NDArray[np.float64],
    range_max: float,
) -> NDArray[np.float64]:
    """Predict what an ideal LIDAR measures at a pose.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    T_map_laser : SE2
        Pose of the sensor.
    bearings : ndarray, shape (n,)
        Directions of the beams in the sensor frame, rad.
    range_max : float
        Reach of the sensor, m.

    Returns
    -------
    ndarray, shape (n,)
        Ranges, m; 0 inside a wall, inf where nothing is nearer than ``range_max``.
    """
    T_grid_laser = grid.T_map_grid.inverse() @ T_map_laser
    return grid.resolution * cast_rays(
        grid.occupied,
        T_grid_laser.x / grid.resolution,
        T_grid_laser.y / grid.resolution,
        T_grid_laser.yaw + bearings,
        range_max / grid.resolution,
    )


@kernel
def cast_rays(
    occupied: NDArray[np.bool_],
    x: float,
    y: float,
    headings: NDArray[np.float64],
    max_range_cells: float,
) -> NDArray[np.float64]:
    """Cast rays from one position; inf where `cast_ray` would return its maximum."""
    ranges = np.empty(headings.size, np.float64)
    for i in range(headings.size):
        length = cast_ray(occupied, x, y, headings[i], max_range_cells)
        ranges[i] = length if length < max_range_cells else np.inf
    return ranges


@kernel
def cast_ray(
    occupied: NDArray[np.bool_], x: float, y: float, heading: float, max_range_cells: float
) -> float:
    """Walk along a ray from cell to cell until a wall.

    Amanatides & Woo, "A fast voxel traversal algorithm for ray tracing" (1987). A ray that meets
    the corner of four cells exactly goes on into the vertical neighbour first.

    Parameters
    ----------
    occupied : ndarray of bool, shape (height, width)
        Where a wall is.
    x, y : float
        Start, cells.
    heading : float
        Direction, rad.
    max_range_cells : float
        Where to stop, cells.

    Returns
    -------
    float
        Distance to the side through which the ray enters the first occupied cell, cells; 0 if it
        starts in one; ``max_range_cells`` if it leaves the map, starts outside or meets nothing
        nearer.
    """
    dx, dy = math.cos(heading), math.sin(heading)
    step_x, line_x, per_x = _towards(dx)
    step_y, line_y, per_y = _towards(dy)
    height, width = occupied.shape
    column, row = math.floor(x), math.floor(y)
    length = 0.0
    while length < max_range_cells and 0 <= column < width and 0 <= row < height:
        if occupied[row, column]:
            return length
        # Computed anew, not accumulated: the length at a crossing does not depend on earlier steps.
        length_x = (column + line_x - x) * per_x
        length_y = (row + line_y - y) * per_y
        if length_x < length_y:
            length = length_x
            column += step_x
        else:
            length = length_y
            row += step_y
    return max_range_cells


@kernel
def cast_ray_leaping(
    clearance: NDArray[np.uint8], x: float, y: float, dx: float, dy: float, max_range_cells: float
) -> float:
    """Cast a ray by leaps across empty squares: the result of `cast_ray`, to the last bit.

    With clearance n, the square of 2n - 1 cells around a cell is free: the walk goes on where the
    ray leaves that square. With n = 1 this is one step of `cast_ray`.

    Parameters
    ----------
    clearance : ndarray of uint8, shape (height, width)
        From `chessboard_clearance`.
    x, y : float
        Start, cells.
    dx, dy : float
        Direction, a unit vector.
    max_range_cells : float
        Where to stop, cells.

    Returns
    -------
    float
        As `cast_ray` returns.
    """
    return cast_ray_onward(clearance, x, y, dx, dy, 0.0, max_range_cells)


@kernel
def cast_ray_onward(
    clearance: NDArray[np.uint8],
    x: float,
    y: float,
    dx: float,
    dy: float,
    free_to: float,
    max_range_cells: float,
) -> float:
    """Cast a ray that is known to be free up to some length, cells: as `cast_ray_leaping`."""
    step_x, line_x, per_x = _towards(dx)
    step_y, line_y, per_y = _towards(dy)
    height, width = clearance.shape
    column, row = math.floor(x + dx * free_to), math.floor(y + dy * free_to)
    length = free_to
    while length < max_range_cells and 0 <= column < width and 0 <= row < height:
        n = int(clearance[row, column])
        if n == 0:
            return length
        if n > 1:
            length_x = (column + step_x * (n - 1) + line_x - x) * per_x
            length_y = (row + step_y * (n - 1) + line_y - y) * per_y
            if length_x < length_y:
                along = y + dy * length_x
                if _is_inside_cell(along):
                    length, column, row = length_x, column + step_x * n, math.floor(along)
                    continue
            else:
                along = x + dx * length_y
                if _is_inside_cell(along):
                    length, column, row = length_y, math.floor(along), row + step_y * n
                    continue
        length_x = (column + line_x - x) * per_x
        length_y = (row + line_y - y) * per_y
        if length_x < length_y:
            length, column = length_x, column + step_x
        else:
            length, row = length_y, row + step_y
    return max_range_cells


@part
def _is_inside_cell(along: float) -> bool:
    """Return whether a coordinate lies so far inside a cell that rounding cannot move it out."""
    return abs(along - math.floor(along + 0.5)) > _NEAR_LINE


@kernel
def _towards(d: float) -> tuple[int, int, float]:
    """Step to the next cell, grid line ahead of a cell's lower side, and length of ray per cell."""
    if abs(d) < 1.0 / _NEVER:
        return 1, 1, _NEVER
    return (1, 1, 1.0 / d) if d > 0.0 else (-1, 0, 1.0 / d)
