"""How far every cell is from the nearest wall: Manhattan, Euclidean, or Euclidean up to a limit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.fields import distance_kernels

SATURATED = distance_kernels.SATURATED
"""Manhattan distance of a cell that is farther from every wall than uint16 can hold."""

MAX_LIMIT = 181
"""Largest limit of the truncated transform: twice its square still fits uint16."""


def manhattan_distance(occupied: NDArray[np.bool_]) -> NDArray[np.uint16]:
    """Measure the 4-connected distance of every cell to the nearest wall.

    This is the *pointscore* of the paper (Fig. 10), in four sweeps instead of a queue.

    Parameters
    ----------
    occupied : ndarray of bool, shape (height, width)
        Where a wall is.

    Returns
    -------
    ndarray of uint16, shape (height, width)
        Distance, cells; `SATURATED` where it is larger than 65534 or there is no wall at all.
    """
    distance = np.empty(occupied.shape, np.uint16)
    distance_kernels.manhattan(np.ascontiguousarray(occupied), distance)
    return distance


def euclidean_distance(occupied: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Measure the straight distance of every cell centre to that of the nearest wall cell.

    Exact, in linear time: Meijster, Roerdink & Hesselink, "A general algorithm for computing
    distance transforms in linear time" (2000).

    Parameters
    ----------
    occupied : ndarray of bool, shape (height, width)
        Where a wall is.

    Returns
    -------
    ndarray of float32, shape (height, width)
        Distance, cells; inf everywhere if there is no wall.
    """
    distance = np.empty(occupied.shape, np.float32)
    # The column distances share the memory of the result.
    distance_kernels.euclidean(np.ascontiguousarray(occupied), distance.view(np.int32), distance)
    return distance


def truncated_squares(occupied: NDArray[np.bool_], limit: int) -> NDArray[np.uint16]:
    """Measure the squared Euclidean distance to the nearest wall where it is below a limit.

    Exact below the limit. The squares are integers: any function of the distance (a score, a
    likelihood) is a table of ``limit**2 + 1`` entries away, ``table[squares]``.

    Parameters
    ----------
    occupied : ndarray of bool, shape (height, width)
        Where a wall is.
    limit : int
        Distance at which the result saturates, cells, 1 to `MAX_LIMIT`.

    Returns
    -------
    ndarray of uint16, shape (height, width)
        Squared distance, cells², at most ``limit**2``.
    """
    if not 1 <= limit <= MAX_LIMIT:
        raise ValueError(f"limit must be 1 to {MAX_LIMIT} cells, not {limit}")
    squares = np.empty(occupied.shape, np.uint16)
    near = np.full(occupied.shape[1], limit, np.uint16)
    padded = np.full(occupied.shape[1] + 2 * limit, limit**2, np.uint16)
    distance_kernels.truncated(np.ascontiguousarray(occupied), limit, near, padded, squares)
    return squares
