"""Which poses are one place: the best of each stays and keeps the oldest name."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.global_localization.places import SEPARATION_M, SEPARATION_RAD


def merge(
    poses: NDArray[np.float64],
    log_weights: NDArray[np.float64],
    ids: NDArray[np.int64],
    resolution: float,
    most: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Choose the best pose of each place, best first.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad).
    log_weights : ndarray, shape (n,)
        Higher is better; of equal ones the earlier.
    ids : ndarray of int64, shape (n,)
        Names; smaller is older.
    resolution : float
        Side of a cell, m.
    most : int
        Number of places to stop at.

    Returns
    -------
    kept : ndarray of int64, shape (m,)
        Indices of the chosen poses.
    names : ndarray of int64, shape (m,)
        The oldest id among the poses of each place.
    """
    order = np.argsort(-log_weights, kind="stable")
    return _merge(poses, order, ids, SEPARATION_M / resolution, SEPARATION_RAD, most)


@njit(cache=True, nogil=True)
def _merge(
    poses: NDArray[np.float64],
    order: NDArray[np.int64],
    ids: NDArray[np.int64],
    near_cells: float,
    near_rad: float,
    most: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    kept = np.empty(min(most, order.shape[0]), np.int64)
    names = np.empty_like(kept)
    n = 0
    for i in order:
        taken = False
        for j in range(n):
            turn = abs(poses[i, 2] - poses[kept[j], 2]) % FULL_TURN
            if min(turn, FULL_TURN - turn) <= near_rad:
                dx, dy = poses[i, 0] - poses[kept[j], 0], poses[i, 1] - poses[kept[j], 1]
                if dx * dx + dy * dy <= near_cells * near_cells:
                    names[j] = min(names[j], ids[i])
                    taken = True
                    break
        if not taken and n < kept.shape[0]:
            kept[n], names[n] = i, ids[i]
            n += 1
    return kept[:n], names[:n]
