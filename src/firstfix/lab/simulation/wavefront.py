"""What it costs to walk from one cell to every other, over cells that are not equally good."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel

_DIAGONAL = np.float32(1.4142135)
_LENGTHS = np.array(  # of a step to each neighbour; staying is none
    [[_DIAGONAL, 1.0, _DIAGONAL], [1.0, np.inf, 1.0], [_DIAGONAL, 1.0, _DIAGONAL]], np.float32
)


def walking_costs(weights: NDArray[np.float32], row: int, column: int) -> NDArray[np.float32]:
    """Find the cheapest 8-connected path from one cell to every other.

    Sweeps over the whole map until no cost decreases. This needs no queue, and about as many sweeps
    as the longest path has bends.

    Parameters
    ----------
    weights : ndarray of float32, shape (height, width)
        Cost of a step into each cell, per cell of length; inf for obstacles.
    row, column : int
        The start.

    Returns
    -------
    ndarray of float32, shape (height, width)
        Cost of the cheapest path; inf where there is none.
    """
    # A rim of walls: kernels need not ask for the border.
    padded = np.pad(weights, 1, constant_values=np.inf)
    costs = np.full(padded.shape, np.inf, np.float32)
    costs[row + 1, column + 1] = 0.0
    _sweep_until_still(padded, costs)
    return costs[1:-1, 1:-1]


@kernel
def _sweep_until_still(weights: NDArray[np.float32], costs: NDArray[np.float32]) -> None:
    height, width = weights.shape
    changed = True
    while changed:
        changed = False
        for r in range(1, height - 1):
            for c in range(1, width - 1):
                if _improve(weights, costs, r, c, -1):
                    changed = True
        for r in range(height - 2, 0, -1):
            for c in range(width - 2, 0, -1):
                if _improve(weights, costs, r, c, 1):
                    changed = True


@kernel
def _improve(
    weights: NDArray[np.float32], costs: NDArray[np.float32], r: int, c: int, before: int
) -> bool:
    """Enter a cell from the cheapest of the four neighbours that a sweep has just passed."""
    weight = weights[r, c]
    if weight == np.inf:
        return False
    straight = min(costs[r + before, c], costs[r, c + before])
    across = min(costs[r + before, c - 1], costs[r + before, c + 1])
    cost = min(straight + weight, across + _DIAGONAL * weight)
    if cost < costs[r, c]:
        costs[r, c] = cost
        return True
    return False


def way_back(
    costs: NDArray[np.float32], weights: NDArray[np.float32], row: int, column: int
) -> NDArray[np.int64]:
    """Follow the cheapest path from a reachable cell back to the start of `walking_costs`.

    Returns
    -------
    ndarray of int64, shape (n, 2)
        Rows and columns from the cell to the start, both included.
    """
    padded = np.pad(costs, 1, constant_values=np.inf)
    way = [(row, column)]
    while costs[row, column] > 0.0:
        around = padded[row : row + 3, column : column + 3] + weights[row, column] * _LENGTHS
        step_row, step_column = divmod(int(np.argmin(around)), 3)
        row, column = row + step_row - 1, column + step_column - 1
        way.append((row, column))
    return np.array(way)
