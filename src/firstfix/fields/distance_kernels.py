"""The sweeps of the distance transforms over rows and columns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel, part

SATURATED = 65535

# More than any side of a map, and counting on from it for any side stays within int32.
_FAR = 1 << 30

# Cells of a row that are finished together: small enough to stop early, 8 AVX2 registers long.
_CHUNK = 128

# LLVM vectorises the sweeps over columns only if each loop is this plain: rows taken out as
# one-dimensional views, one array written a loop, every sum cast back to its own width.
# That is ten times as fast as the same sweeps written as one loop.


@kernel
def manhattan(occupied: NDArray[np.bool_], distance: NDArray[np.uint16]) -> None:
    """Write the pointscore: down, then up, right and left in each row."""
    height, width = occupied.shape
    top, one = np.uint16(SATURATED - 1), np.uint16(1)
    near = np.full(width, np.uint16(SATURATED))
    for r in range(height):
        wall, row = occupied[r], distance[r]
        for c in range(width):
            step = np.uint16(min(near[c], top) + one)
            near[c] = np.uint16(0) if wall[c] else step
        for c in range(width):
            row[c] = near[c]
    near[:] = SATURATED
    for r in range(height - 1, -1, -1):
        row = distance[r]
        for c in range(width):
            near[c] = min(row[c], np.uint16(min(near[c], top) + one))
        beside = (
            SATURATED  # a wide integer: it never exceeds its neighbour in the row by more than one
        )
        for c in range(width):
            beside = min(int(near[c]), beside + 1)
            row[c] = beside
        for c in range(width - 1, -1, -1):
            beside = min(int(row[c]), beside + 1)
            row[c] = beside


@kernel
def euclidean(
    occupied: NDArray[np.bool_], column: NDArray[np.int32], distance: NDArray[np.float32]
) -> None:
    """Write the distance; ``column`` may share its memory (rows are read first)."""
    height, width = occupied.shape
    one = np.int32(1)
    near = np.full(width, np.int32(_FAR))
    for r in range(height):
        wall, row = occupied[r], column[r]
        for c in range(width):
            near[c] = np.int32(0) if wall[c] else np.int32(near[c] + one)
        for c in range(width):
            row[c] = near[c]
    near[:] = _FAR
    sites, starts = np.empty(width, np.int64), np.empty(width, np.int64)
    squares = np.empty(width, np.float64)
    for r in range(height - 1, -1, -1):
        row, out = column[r], distance[r]
        for c in range(width):
            near[c] = min(row[c], np.int32(near[c] + one))
        count = _lower_envelope(near, sites, starts)
        _squares_of_envelope(near, sites[:count], starts[:count], squares)
        for c in range(width):
            out[c] = np.sqrt(squares[c])


@kernel
def _lower_envelope(
    near: NDArray[np.int32], sites: NDArray[np.int64], starts: NDArray[np.int64]
) -> int:
    """Find the columns u that are nearest to some column of the row, and where each begins."""
    width = near.size
    last = -1
    for u in range(width):
        g = np.int64(near[u])
        if g >= _FAR:
            continue
        while last >= 0:
            v, t = sites[last], starts[last]
            if (t - v) ** 2 + np.int64(near[v]) ** 2 <= (t - u) ** 2 + g * g:
                break
            last -= 1
        begin = np.int64(0)
        if last >= 0:
            v = sites[last]
            # Integers far below 2**53 (sides up to 10**7): the floor of the quotient is exact.
            rise = np.float64(u * u - v * v + g * g - np.int64(near[v]) ** 2)
            begin = np.int64(np.floor(rise / np.float64(2 * (u - v)))) + 1
        if begin < width:
            last += 1
            sites[last], starts[last] = u, begin
    return last + 1


@kernel
def _squares_of_envelope(
    near: NDArray[np.int32],
    sites: NDArray[np.int64],
    starts: NDArray[np.int64],
    squares: NDArray[np.float64],
) -> None:
    end = squares.size
    for k in range(sites.size - 1, -1, -1):
        v = sites[k]
        across = np.float64(near[v]) ** 2
        for c in range(starts[k], end):
            squares[c] = np.float64(c - v) ** 2 + across
        end = starts[k]
    squares[:end] = np.inf  # the map has no wall


@kernel
def truncated(
    occupied: NDArray[np.bool_],
    limit: int,
    near: NDArray[np.uint16],
    padded: NDArray[np.uint16],
    squares: NDArray[np.uint16],
) -> None:
    """Write the squared distance, at most ``limit`` squared.

    ``near`` is a row of the limit. ``padded`` is a row of its square with a margin of the limit on
    both sides, so that the inner loop needs no checks at the edges.
    """
    height, width = occupied.shape
    top, one = np.uint16(limit), np.uint16(1)
    for r in range(height):
        wall, row = occupied[r], squares[r]
        for c in range(width):
            step = min(top, np.uint16(near[c] + one))
            near[c] = np.uint16(0) if wall[c] else step
        for c in range(width):
            row[c] = near[c]
    for c in range(width):
        near[c] = top
    for r in range(height - 1, -1, -1):
        row, inner = squares[r], padded[limit : limit + width]
        for c in range(width):
            near[c] = min(row[c], np.uint16(near[c] + one))
        for c in range(width):
            inner[c] = near[c] * near[c]
        for begin in range(0, width, _CHUNK):
            best = row[begin : begin + _CHUNK]
            _look_outward(padded[begin : begin + best.size + 2 * limit], limit, best)


@part
def _look_outward(window: NDArray[np.uint16], limit: int, best: NDArray[np.uint16]) -> None:
    """Compare with columns ever farther away until none can be nearer; window = best + margins."""
    n = best.size
    for c in range(n):
        best[c] = window[limit + c]
    lowest = np.uint16(limit * limit)
    for c in range(window.size):
        lowest = min(lowest, window[c])
    for k in range(1, limit):
        away = np.uint16(k * k)
        if k % 4 == 1:
            highest = np.uint16(0)
            for c in range(n):
                highest = max(highest, best[c])
            if highest <= away + lowest:
                return
        left, right = window[limit - k : limit - k + n], window[limit + k : limit + k + n]
        for c in range(n):
            best[c] = min(best[c], np.uint16(min(left[c], right[c]) + away))
