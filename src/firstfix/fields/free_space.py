"""Where a robot can be, thinned out to one position per block of cells."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


def free_positions(
    free: NDArray[np.bool_], stride: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Choose one position in every block of cells that holds a free cell.

    Blocks are ``stride`` x ``stride`` cells, the first at cell (0, 0), the last cut by the edge of
    the map. The position is the middle of the block if the cell there is free (of an even block:
    the cell above and right of the middle), else the centre of the free cell nearest to it, the
    lower, then the left one of equals. So it never lies in a wall, and the block is the floor of
    position / stride.

    Parameters
    ----------
    free : ndarray of bool, shape (height, width)
        Where a robot can be.
    stride : int
        Side of a block, cells.

    Returns
    -------
    columns, rows : ndarray, shape (n,)
        Cell coordinates x and y with fractions, block by block along the rows of blocks.
    """
    if stride < 1:
        raise ValueError(f"stride must be at least 1 cell, not {stride}")
    height, width = free.shape
    most = -(-height // stride) * -(-width // stride)
    columns, rows = np.empty(most), np.empty(most)
    count = _choose(np.ascontiguousarray(free), stride, columns, rows)
    return columns[:count].copy(), rows[:count].copy()


@njit(cache=True, nogil=True)
def _choose(
    free: NDArray[np.bool_], stride: int, columns: NDArray[np.float64], rows: NDArray[np.float64]
) -> int:
    height, width = free.shape
    count = 0
    for bottom in range(0, height, stride):
        for left in range(0, width, stride):
            r, c = bottom + stride // 2, left + stride // 2
            if r < height and c < width and free[r, c]:
                columns[count], rows[count] = left + stride / 2, bottom + stride / 2
                count += 1
                continue
            r, c = _nearest_free(free, bottom, left, stride)
            if r >= 0:
                columns[count], rows[count] = c + 0.5, r + 0.5
                count += 1
    return count


@njit(cache=True, nogil=True)
def _nearest_free(free: NDArray[np.bool_], bottom: int, left: int, stride: int) -> tuple[int, int]:
    """Find the free cell of a block that is nearest to its middle; (-1, -1) if none is free."""
    best, row, column = 2 * stride * stride, -1, -1
    for r in range(bottom, min(bottom + stride, free.shape[0])):
        for c in range(left, min(left + stride, free.shape[1])):
            # Twice the way from centre to middle is a whole number.
            up, right = 2 * (r - bottom) + 1 - stride, 2 * (c - left) + 1 - stride
            if free[r, c] and up * up + right * right < best:
                best, row, column = up * up + right * right, r, c
    return row, column
