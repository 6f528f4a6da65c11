"""The truncated distance field that end points are scored on."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel
from firstfix.fields.phased_field import PhasedField, lay_out

UNIT_M = 0.05
"""What one count of the field stands for, m."""

LIMIT_M = 0.5
"""Distance at which the field saturates, m: farther end points are outliers."""

LIMIT = round(LIMIT_M / UNIT_M)


def build_endpoint_field(
    squares: NDArray[np.uint16], resolution: float, stride: int, reach_m: float
) -> PhasedField:
    """Lay out the truncated distance field of a map, at half the spacing of the positions.

    The coarser field costs less accuracy than the positions themselves, and stays in the
    processor's second cache.

    Parameters
    ----------
    squares : ndarray of uint16, shape (height, width)
        Squared distance to the nearest wall, cells², truncated at `LIMIT_M` or later.
    resolution : float
        Side of a cell, m.
    stride : int
        Side of a block, cells: 1 or even.
    reach_m : float
        Longest beam that will be read, m.

    Returns
    -------
    PhasedField
        Distances of uint8 in counts of `UNIT_M`, at most `LIMIT`; `LIMIT` outside the map.
    """
    distance_m = np.sqrt(np.arange(int(squares.max(initial=0)) + 1)) * resolution
    table = np.minimum(distance_m / UNIT_M, LIMIT).astype(np.float32)
    side = max(1, stride // 2)
    phases = stride // side
    margin = math.ceil(reach_m / resolution / stride) + 1
    height, width = squares.shape
    pooled = np.empty((-(-height // side), -(-width // side)), np.uint8)
    _pool(squares, table, side, np.empty(width), np.empty(pooled.shape[1]), pooled)
    pooled = np.pad(pooled, margin * phases, constant_values=LIMIT)
    return lay_out(pooled, side, phases, margin)


@kernel
def _pool(
    squares: NDArray[np.uint16],
    table: NDArray[np.float32],
    side: int,
    totals: NDArray[np.float64],
    sums: NDArray[np.float64],
    pooled: NDArray[np.uint8],
) -> None:
    """Write the mean distance of every block; totals and sums are rows to work in."""
    height, width = squares.shape
    for row in range(pooled.shape[0]):
        for x in range(width):
            totals[x] = 0.0
        first, end = row * side, min(height, (row + 1) * side)
        for y in range(first, end):
            line = squares[y]
            for x in range(width):
                totals[x] += table[line[x]]
        for column in range(pooled.shape[1]):
            sums[column] = 0.0
        for step in range(side):
            for column in range((width - step + side - 1) // side):
                sums[column] += totals[column * side + step]
        out, cells = pooled[row], np.float64((end - first) * side)
        for column in range(width // side):
            out[column] = np.uint8(np.int32(sums[column] / cells + 0.5))
        if width % side > 0:
            cells = np.float64((end - first) * (width % side))
            out[width // side] = np.uint8(np.int32(sums[width // side] / cells + 0.5))
