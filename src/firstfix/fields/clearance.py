"""How large an empty square surrounds every cell: what lets a ray leap."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

MAX_CLEARANCE = 255
"""Largest clearance reported, cells."""


def chessboard_clearance(occupied: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Measure the 8-connected distance of every cell to the nearest wall.

    All cells less than n columns and less than n rows away from a cell with clearance n are not
    occupied. Along walls, which buildings are made of, this square reaches farther than the disc of
    the Euclidean distance less two half diagonals: 8.3 steps a ray instead of 12.7 on willow.

    Parameters
    ----------
    occupied : ndarray of bool, shape (height, width)
        Where a wall is.

    Returns
    -------
    ndarray of uint8, shape (height, width)
        Distance, cells, at most `MAX_CLEARANCE`; 0 in a wall.
    """
    clearance = np.empty(occupied.shape, np.uint8)
    _sweep(np.ascontiguousarray(occupied), clearance)
    return clearance


@njit(cache=True, nogil=True)
def _sweep(occupied: NDArray[np.bool_], clearance: NDArray[np.uint8]) -> None:
    """Two sweeps of Rosenfeld & Pfaltz (1968), each cell from four of its neighbours."""
    height, width = occupied.shape
    # One cell of "nothing known" on both sides stands for the world outside.
    before = np.full(width + 2, np.uint8(MAX_CLEARANCE))
    nearest = np.empty(width, np.uint8)
    for r in range(height):
        wall, row = occupied[r], clearance[r]
        _nearest_of_three(before, nearest)
        beside = MAX_CLEARANCE
        for c in range(width):
            beside = 0 if wall[c] else min(int(nearest[c]), beside, MAX_CLEARANCE - 1) + 1
            row[c] = beside
        for c in range(width):  # a slice would compile NumPy's broadcasting: seconds
            before[c + 1] = row[c]
    before[:] = MAX_CLEARANCE
    for r in range(height - 1, -1, -1):
        row = clearance[r]
        _nearest_of_three(before, nearest)
        beside = MAX_CLEARANCE
        for c in range(width - 1, -1, -1):
            beside = min(int(row[c]), min(int(nearest[c]), beside) + 1)
            row[c] = beside
        for c in range(width):  # a slice would compile NumPy's broadcasting: seconds
            before[c + 1] = row[c]


@njit(cache=True, nogil=True)
def _nearest_of_three(before: NDArray[np.uint8], nearest: NDArray[np.uint8]) -> None:
    """Write the minimum of the three neighbours in the row before, for every column."""
    n = nearest.size
    left, middle, right = before[:n], before[1 : n + 1], before[2:]
    for c in range(n):
        nearest[c] = min(left[c], middle[c], right[c])
