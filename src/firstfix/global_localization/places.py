"""Places: poses that count as one, and the selection of distinct ones."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN, angle_error
from firstfix.core.se2 import SE2
from firstfix.fields.kernel_cache import kernel

SAME_PLACE_M = 0.5
"""Two poses are one place up to this distance, m, and `SAME_PLACE_RAD`."""

SAME_PLACE_RAD = math.radians(20.0)
"""Two poses are one place up to this difference of heading, rad, and `SAME_PLACE_M`."""


def is_same_place(a: SE2, b: SE2) -> bool:
    """Return whether two poses of the base are one place."""
    near = a.distance_to(b) <= SAME_PLACE_M
    return near and bool(angle_error(a.yaw, b.yaw) <= SAME_PLACE_RAD)


def distinct_places(
    poses: NDArray[np.float64],
    scores: NDArray[np.float64] | NDArray[np.int64],
    resolution: float,
    most: int,
) -> NDArray[np.int64]:
    """Choose the best pose of each place, best first.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad).
    scores : ndarray, shape (n,)
        Lower is better; of equal ones the earlier.
    resolution : float
        Side of a cell, m.
    most : int
        Number of places to stop at.

    Returns
    -------
    ndarray of int64, shape (m,)
        Indices of the chosen poses.
    """
    order = np.argsort(scores, kind="stable")
    kept = np.empty(min(most, len(order)), np.int64)
    n = _suppress(poses, order, SAME_PLACE_M / resolution, SAME_PLACE_RAD, kept)
    return kept[:n]


@kernel
def _suppress(
    poses: NDArray[np.float64],
    order: NDArray[np.int64],
    near_cells: float,
    near_rad: float,
    kept: NDArray[np.int64],
) -> int:
    """Write the indices of the poses kept, and return how many these are."""
    n = 0
    for o in range(order.shape[0]):
        if n == kept.shape[0]:
            break
        i = order[o]
        taken = False
        for k in range(n):
            j = kept[k]
            turn = abs(poses[i, 2] - poses[j, 2])
            if turn >= FULL_TURN:  # rare, and a remainder takes as long as the rest of the loop
                turn %= FULL_TURN
            if min(turn, FULL_TURN - turn) <= near_rad:
                dx, dy = poses[i, 0] - poses[j, 0], poses[i, 1] - poses[j, 1]
                if dx * dx + dy * dy <= near_cells * near_cells:
                    taken = True
                    break
        if not taken:
            kept[n] = i
            n += 1
    return n
