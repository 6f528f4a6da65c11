"""What a map shows around a place, and whether two maps show the same there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields

RADIUS_M = 25.0
"""Half the side of the square that is compared, m."""

STEP_M = 0.25
"""Distance of the samples, m."""

UNKNOWN, FREE, WALL = 0, 1, 2

# Least share of the walls of each map that the other has, too, where it knows the place. Floors of
# one building share up to 86 %, a map and its edited or extended copy at least 92 % (0021).
_SAME_SHARE = 0.92
# Floors of one building share at least 73 %.
_ALIKE_SHARE = 0.7
# Fewer walls than these, or less common ground, prove nothing.
_FEWEST_WALLS = 100
_COMMON_SHARE = 0.5


def surroundings(fields: MapFields, T_map_base: SE2) -> NDArray[np.uint8]:
    """Sample a map on a square around a place, in the frame of the robot.

    Parameters
    ----------
    fields : MapFields
        The prepared map.
    T_map_base : SE2
        The place.

    Returns
    -------
    ndarray of uint8, shape (n, n)
        `UNKNOWN`, `FREE` or `WALL`.
    """
    grid = fields.grid
    axis = np.arange(-RADIUS_M, RADIUS_M, STEP_M) + 0.5 * STEP_M
    x, y = np.meshgrid(axis, axis)
    columns, rows = np.moveaxis(
        np.floor(grid.to_cells(T_map_base.apply(np.stack([x, y], axis=-1)))).astype(np.int64), -1, 0
    )
    inside = (columns >= 0) & (columns < grid.width) & (rows >= 0) & (rows < grid.height)
    sampled = np.full(x.shape, UNKNOWN, np.uint8)
    cell = rows[inside], columns[inside]
    # A wall may be one cell thick: it counts where it is within half a diagonal.
    near = fields.distances[fields.squares[cell]] * grid.resolution <= STEP_M * np.sqrt(0.5)
    sampled[inside] = np.where(near, WALL, np.where(fields.unknown[cell], UNKNOWN, FREE))
    return sampled


def show_the_same(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> bool:
    """Tell whether two maps show the same around a place.

    Parameters
    ----------
    a, b : ndarray of uint8, shape (n, n)
        From `surroundings`, of one place in two maps.
    """
    return _common_walls(a, b) >= _SAME_SHARE


def are_alike(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> bool:
    """Tell whether two maps show nearly the same around a place, as floors of one building do.

    Parameters
    ----------
    a, b : ndarray of uint8, shape (n, n)
        From `surroundings`, of one place in two maps.
    """
    return _common_walls(a, b) >= _ALIKE_SHARE


def _common_walls(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    """Return the share of the walls of each map that the other has, too: the smaller of the two."""
    known = (a != UNKNOWN) & (b != UNKNOWN)
    smaller = min(np.count_nonzero(a), np.count_nonzero(b))
    if np.count_nonzero(known) < _COMMON_SHARE * smaller:
        return 0.0
    return min(_share_of_walls(one, other, known) for one, other in ((a, b), (b, a)))


def _share_of_walls(
    one: NDArray[np.uint8], other: NDArray[np.uint8], known: NDArray[np.bool_]
) -> float:
    """Return the share of the walls of one map beside which the other has one; 0 for too few."""
    walls = (one == WALL) & known
    count = np.count_nonzero(walls)
    if count < _FEWEST_WALLS:
        return 0.0
    padded = np.pad(other == WALL, 1)
    n, m = other.shape
    beside = np.zeros(other.shape, np.bool_)
    for dy in range(3):
        for dx in range(3):
            beside |= padded[dy : dy + n, dx : dx + m]
    return float(np.count_nonzero(walls & beside) / count)
