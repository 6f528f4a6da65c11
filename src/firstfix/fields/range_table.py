"""Expected ranges at every search position, in all directions.

Turning the robot shifts its row of the table: all headings of a position are compared with a scan
by contiguous byte operations, walls and all.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.fields.kernel_cache import kernel
from firstfix.fields.raycast import cast_ray_leaping
from firstfix.fields.search_grid import SearchGrid

DIRECTIONS = 128
"""Directions, and headings of the search: 2.8 degrees, four 32-byte vectors."""

UNIT_M = 0.1
"""Metres per count of the table."""

REACH_M = 25.0
"""Range at which the table saturates, m."""

FARTHEST = round(REACH_M / UNIT_M)


def build_range_table(
    clearance: NDArray[np.uint8], resolution: float, positions: SearchGrid
) -> NDArray[np.uint8]:
    """Cast rays from every position of a search grid.

    Parameters
    ----------
    clearance : ndarray of uint8, shape (height, width)
        Of the map, from `clearance.chessboard_clearance`; unknown space is transparent.
    resolution : float
        Side of a cell, m.
    positions : SearchGrid
        Where to cast from.

    Returns
    -------
    ndarray of uint8, shape (n_positions, 2 * DIRECTIONS)
        Ranges in counts of `UNIT_M`, counter-clockwise from the grid's x axis; written twice, so
        that every heading is one slice.
    """
    table = np.empty((len(positions), 2 * DIRECTIONS), np.uint8)
    x, y = positions.centres(np.arange(len(positions)))
    headings = np.arange(DIRECTIONS) * (FULL_TURN / DIRECTIONS)
    _fill(clearance, x, y, np.cos(headings), np.sin(headings), resolution / UNIT_M, table)
    return table


@kernel
def _fill(
    clearance: NDArray[np.uint8],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    dx: NDArray[np.float64],
    dy: NDArray[np.float64],
    counts_per_cell: float,
    table: NDArray[np.uint8],
) -> None:
    reach = FARTHEST / counts_per_cell
    for k in range(x.shape[0]):
        for i in range(DIRECTIONS):
            cells = cast_ray_leaping(clearance, x[k], y[k], dx[i], dy[i], reach)
            count = np.uint8(min(FARTHEST, math.floor(cells * counts_per_cell + 0.5)))
            table[k, i] = count
            table[k, i + DIRECTIONS] = count
