"""Expected ranges at every search position, in all directions.

Turning the robot shifts its row of the table: all headings of a position are compared with a scan
by contiguous byte operations, walls and all.

Two sweeps of the map replace most of the casting. Every ray passes between two lines that are half
a cell apart. What it touches, one of them touches in the same row of cells, so it is free as long
as both are. If both meet a wall at the edge of one row, so does the ray. Otherwise it is cast from
there. So the table is the same as if all rays were cast from their positions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel
from firstfix.fields.raycast import cast_ray_onward
from firstfix.fields.search_grid import SearchGrid
from firstfix.fields.sweep import Line, free_cells, in_threads, lines, next_row

DIRECTIONS = 128
"""Directions, and headings of the search: 2.8 degrees, four 32-byte vectors."""

UNIT_M = 0.1
"""Metres per count of the table."""

REACH_M = 25.0
"""Range at which the table saturates, m."""

FARTHEST = round(REACH_M / UNIT_M)

# Of the two lines, cells. Diagonals meet corners: none of the two does then.
_OFFSETS = (0.25, 0.75)


@dataclass(frozen=True, eq=False)
class _Rays:
    """What all directions that cross rows, or columns, have in common.

    Parameters
    ----------
    free : ndarray of uint8, shape (height + 2, width + 2)
        The map, on its side if columns are crossed.
    order : ndarray of int64, shape (n,)
        Positions by rows.
    starts : ndarray of int64, shape (height + 1,)
        Where each row begins in ``order``.
    columns : ndarray of uint32, shape (n,)
        Of the positions, by rows.
    """

    free: NDArray[np.uint8]
    order: NDArray[np.int64]
    starts: NDArray[np.int64]
    columns: NDArray[np.uint32]


def build_range_table(
    occupied: NDArray[np.bool_],
    clearance: NDArray[np.uint8],
    resolution: float,
    positions: SearchGrid,
) -> NDArray[np.uint8]:
    """Cast rays from every position of a search grid, on all cores.

    Parameters
    ----------
    occupied : ndarray of bool, shape (height, width)
        Walls; unknown space is transparent.
    clearance : ndarray of uint8, shape (height, width)
        Of the map, from `clearance.chessboard_clearance`.
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
    x, y = positions.centres(np.arange(len(positions)))
    counts_per_cell = resolution / UNIT_M
    table = np.empty((2, DIRECTIONS, len(positions)), np.uint8)
    for upright in (True, False):
        rays = _rays(occupied, x, y, upright)

        def ranges(both: Sequence[Line], rays: _Rays = rays) -> NDArray[np.uint8]:
            found = np.empty(len(x), np.uint8)
            steps = _count_steps(rays, both, FARTHEST / counts_per_cell)
            _fill(
                clearance, x, y, both[0].direction, both[0].per_row, steps, counts_per_cell, found
            )
            return found

        two = [lines(DIRECTIONS, len(rays.free) - 2, upright, offset) for offset in _OFFSETS]
        for both, found in in_threads(ranges, [*zip(*two, strict=True)]):
            table[:, both[0].index] = found
    return table.reshape(2 * DIRECTIONS, -1).T.copy()


def _rays(
    occupied: NDArray[np.bool_],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    upright: bool,  # noqa: FBT001 - no option: the map lies or stands
) -> _Rays:
    rows, columns = (n.astype(np.int64) for n in ((y, x) if upright else (x, y)))
    free, order = free_cells(occupied, upright), np.argsort(rows, kind="stable")
    starts = np.searchsorted(rows[order], np.arange(len(free) - 1))
    return _Rays(free, order, starts, columns[order].astype(np.uint32))


def _count_steps(rays: _Rays, both: Sequence[Line], reach: float) -> NDArray[np.uint16]:
    """Return the steps to the wall (`sweep.next_row`) along two lines beside each ray, (2, n)."""
    far = np.uint16(2 * math.ceil(reach / both[0].per_row) + 3)
    steps = np.empty((2, len(rays.order)), np.uint16)
    for line, of_line in zip(both, steps, strict=True):
        found = np.empty_like(of_line)
        _sweep(
            rays.free, line.columns, line.turns, line.step, far, rays.starts, rays.columns, found
        )
        of_line[rays.order] = found
    return steps


@kernel
def _sweep(  # noqa: PLR0913 - a kernel takes its arrays one by one
    free: NDArray[np.uint8],
    line: NDArray[np.int64],
    turns: NDArray[np.uint16],
    step: int,
    far: np.uint16,
    starts: NDArray[np.int64],
    columns: NDArray[np.uint32],
    found: NDArray[np.uint16],
) -> None:
    """Sweep from the far end, and keep the steps from the positions."""
    height, width = free.shape[0] - 2, free.shape[1] - 2
    row = np.empty(width, np.uint16)
    after = np.full(width + 2, far, np.uint16)
    for i in range(height):
        r = i if step > 0 else height - 1 - i
        shift = 1 + line[r + 1 - step] - line[r + 1]
        beside = free[r + 1, shift:] if turns[r] == 1 else free[r + 1 - step, 1:]
        next_row(after, free[r + 1, 1:], beside, shift, turns[r], far, row)
        for k in range(starts[r], starts[r + 1]):
            found[k] = row[columns[k]]


@kernel
def _fill(  # noqa: PLR0913 - as above
    clearance: NDArray[np.uint8],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    direction: tuple[float, float],
    per_row: float,
    steps: NDArray[np.uint16],
    counts_per_cell: float,
    found: NDArray[np.uint8],
) -> None:
    """Write the ranges in one direction; cast those that the lines leave open."""
    reach = FARTHEST / counts_per_cell
    dx, dy = direction
    for k in range(x.shape[0]):
        one, other = steps[0, k], steps[1, k]
        if one == other and one % 2 == 0:
            cells = (one - 1) * 0.5 * per_row
        else:
            # Up to the edge of the row that one of them ends in, but not onto it.
            free_to = max(0.0, (min(one, other) // 2 - 0.5001) * per_row)
            cells = cast_ray_onward(clearance, x[k], y[k], dx, dy, free_to, reach)
        found[k] = np.uint8(min(FARTHEST, math.floor(cells * counts_per_cell + 0.5)))
