"""Which poses are one place: the best of each stays, under the name that the place had."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.fields.kernel_cache import kernel
from firstfix.global_localization.places import SAME_PLACE_M, SAME_PLACE_RAD


def merge(
    poses: NDArray[np.float64],
    log_weights: NDArray[np.float64],
    ids: NDArray[np.int64],
    known: tuple[int, int],
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
        Names.
    known : tuple of int
        The favourite's id, or -1; and the first id that is new.
    resolution : float
        Side of a cell, m.
    most : int
        Number of places to stop at.

    Returns
    -------
    kept : ndarray of int64, shape (m,)
        Indices of the chosen poses.
    names : ndarray of int64, shape (m,)
        For each place the favourite's id if it is among its poses; else that of the best pose whose
        id is not new; else that of the best pose.
    """
    order = np.argsort(-log_weights, kind="stable")
    return _merge(poses, order, ids, known, SAME_PLACE_M / resolution, SAME_PLACE_RAD, most)


@kernel
def _merge(
    poses: NDArray[np.float64],
    order: NDArray[np.int64],
    ids: NDArray[np.int64],
    known: tuple[int, int],
    near_cells: float,
    near_rad: float,
    most: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    kept = np.empty(min(most, order.shape[0]), np.int64)
    names = np.empty_like(kept)
    n = 0
    favourite, first_new = known
    for i in order:
        taken = False
        for j in range(n):
            turn = abs(poses[i, 2] - poses[kept[j], 2])
            if turn >= FULL_TURN:  # rare, and a remainder takes longer than the rest of the loop
                turn %= FULL_TURN
            if min(turn, FULL_TURN - turn) <= near_rad:
                dx, dy = poses[i, 0] - poses[kept[j], 0], poses[i, 1] - poses[kept[j], 1]
                if dx * dx + dy * dy <= near_cells * near_cells:
                    if ids[i] == favourite or names[j] >= first_new > ids[i]:
                        names[j] = ids[i]
                    taken = True
                    break
        if not taken and n < kept.shape[0]:
            kept[n], names[n] = i, ids[i]
            n += 1
    return kept[:n], names[:n]
