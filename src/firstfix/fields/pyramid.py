"""Lower bounds of a field over blocks of positions, for a search that may not miss the best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def min_pyramid(
    field: NDArray[np.uint8], levels: int, outside: int
) -> tuple[NDArray[np.uint8], ...]:
    """Pool the minimum of a field over windows of growing size, at full resolution.

    Cell (r, c) of level k is the minimum of ``field[r : r + 2**k, c : c + 2**k]``: no shift of
    (r, c) by less than ``2**k`` cells up and right finds less. Hess, Kohler, Rapp & Andor,
    "Real-time loop closure in 2D LIDAR SLAM" (2016), eq. 16, with the sign of a cost.

    Parameters
    ----------
    field : ndarray of uint8, shape (height, width)
        Cost of a cell.
    levels : int
        Number of levels, at least 1.
    outside : int
        Cost of every cell beyond the upper and right edge.

    Returns
    -------
    tuple of ndarray of uint8, each of shape (height, width)
        Levels 0 (``field`` itself) to ``levels - 1``.
    """
    if levels < 1:
        raise ValueError(f"levels must be at least 1, not {levels}")
    pyramid = [field]
    for k in range(levels - 1):
        pyramid.append(_pool(pyramid[-1], 1 << k, np.uint8(outside)))
    return tuple(pyramid)


def _pool(finer: NDArray[np.uint8], step: int, outside: np.uint8) -> NDArray[np.uint8]:
    """Join each window with those one step right, above, and both: twice the side."""
    wide = np.minimum(finer, outside)
    np.minimum(finer[:, :-step], finer[:, step:], out=wide[:, :-step])
    coarser = np.minimum(wide, outside)
    np.minimum(wide[:-step], wide[step:], out=coarser[:-step])
    return coarser
