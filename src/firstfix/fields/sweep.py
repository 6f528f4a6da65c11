"""Expected ranges of all cells in one direction, by one sweep over the map.

The range of a cell is that of the next cell along the ray and one step more: Danielsson's idea for
distances (1980), along one direction. A row of cells is a few vectors, so that a range costs 0.12
ns where a ray costs 100. All rays of a sweep follow one digital line. Each is the ray of a place up
to half a cell beside the middle of its cell, and its length is exact to one row.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.fields.kernel_cache import kernel

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


@dataclass(frozen=True, eq=False, slots=True)
class Line:
    """The digital line of one direction in a map whose rows it crosses one by one.

    Parameters
    ----------
    index : int
        Of the direction.
    direction : tuple of float
        Unit vector along x and y.
    step : int
        From the row that is swept before to the next one: from the far end to the sensor.
    columns : ndarray of int64, shape (height + 2,)
        Column of the line in every row, and in one more before and after.
    turns : ndarray of uint16, shape (height,)
        1 where the line goes to its next column within the row, 0 behind its edge or never.
    per_row : float
        Length of the ray for each row, cells.
    """

    index: int
    direction: tuple[float, float]
    step: int
    columns: NDArray[np.int64]
    turns: NDArray[np.uint16]
    per_row: float


def lines(
    directions: int,
    height: int,
    upright: bool,  # noqa: FBT001 - no option: the map lies or stands
    offset: float = 0.0,
) -> list[Line]:
    """Return the lines of those of all directions that cross rows, or columns, one by one.

    Parameters
    ----------
    directions : int
        Evenly spaced from the x axis, counter-clockwise.
    height : int
        Number of rows; of columns if the map lies on its side.
    upright : bool
        Whether rows are crossed.
    offset : float
        By which all lines are moved along the rows, cells.
    """
    found = []
    headings = np.arange(directions) * (FULL_TURN / directions)
    vectors = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    for i, (dx, dy) in enumerate(vectors.tolist()):
        if (abs(dy) >= abs(dx)) is not upright:
            continue
        along, across = (dy, dx) if upright else (dx, dy)
        step, slope = (-1 if along > 0.0 else 1), across / along
        exact = np.arange(-1, height + 1) * slope + (offset + 0.5)
        columns = np.floor(exact).astype(np.int64)
        turns = (np.floor(exact - 0.5 * step * slope) != columns)[1:-1].astype(np.uint16)
        found.append(Line(i, (dx, dy), step, columns, turns, 1.0 / abs(along)))
    return found


def free_cells(occupied: NDArray[np.bool_], upright: bool) -> NDArray[np.uint8]:  # noqa: FBT001 - as above
    """Return 1 where no wall is, on its side if asked, with a free margin of one cell."""
    walls = np.ascontiguousarray(occupied if upright else occupied.T)
    return np.pad(~walls, 1, constant_values=True).view(np.uint8)


def in_threads(
    function: Callable[[_Item], _Result], items: Sequence[_Item]
) -> Iterator[tuple[_Item, _Result]]:
    """Call a function, which releases the GIL, for each item on all cores; results in order."""
    allowed = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else ()
    cores = len(allowed) or os.cpu_count() or 1
    with ThreadPoolExecutor(cores) as pool:
        for first in range(0, len(items), cores):  # few results wait at a time
            some = items[first : first + cores]
            yield from zip(some, pool.map(function, some), strict=True)


@kernel
def next_row(
    after: NDArray[np.uint16],
    free: NDArray[np.uint8],
    beside: NDArray[np.uint8],
    shift: int,
    turn: np.uint16,
    far: np.uint16,
    row: NDArray[np.uint16],
) -> None:
    """Count the steps to the wall from every cell of a row.

    A row is two steps. 2 n means that the wall begins at the edge of the n-th row, which is n - 1/2
    rows away; 2 n + 1 that it is met from the side within that row.

    Parameters
    ----------
    after : ndarray of uint16, shape (width + 2,)
        Those of the row before in the sweep, which are replaced; with a margin of one cell.
    free, beside : ndarray of uint8
        The row, and the cell through which the line goes from each of its cells to the row before.
    shift : int
        Where the line begins in ``after``.
    turn : int
        1 where ``beside`` is in this row, 0 where it is in the row before.
    far : int
        Most steps.
    row : ndarray of uint16, shape (width,)
        The result; 0 in a wall.
    """
    ahead, one, first = after[shift:], np.uint16(1), np.uint16(np.uint16(2) - turn)
    # Unsigned indices cannot count from the end of an array: LLVM can vectorise the loop.
    for c in range(np.uint64(row.shape[0])):
        onward = max(np.uint16(ahead[c] + turn), one)
        count = min(np.uint16(np.uint16(onward * beside[c]) + first), far)
        row[c] = np.uint16(count * free[c])
    for c in range(np.uint64(row.shape[0])):
        after[c + np.uint64(1)] = row[c]
