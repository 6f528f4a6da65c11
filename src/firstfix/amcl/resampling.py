"""Resampling: draws in proportion to weight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel


def systematic(weight: NDArray[np.float64], n: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw by one comb of n equally spaced teeth, in one pass: O(m + n).

    Thrun, Burgard & Fox, "Probabilistic Robotics" (2005), table 4.4.

    Parameters
    ----------
    weight : ndarray, shape (m,)
        Weights, at least one positive; they need not sum to one.
    n : int
        Number of draws.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    ndarray of int64, shape (n,)
        Indices in ascending order; each i ``n * weight[i]`` times on average, and never off by one
        or more.
    """
    return _comb(weight, n, rng.random())


@kernel
def _comb(weight: NDArray[np.float64], n: int, offset: float) -> NDArray[np.int64]:
    drawn = np.empty(n, np.int64)
    # Rounding may leave the last teeth above the sum: they fall to the last that weighs anything.
    last = weight.shape[0] - 1
    while last > 0 and weight[last] <= 0.0:
        last -= 1
    step = weight.sum() / n
    i, edge = 0, weight[0]
    for k in range(n):
        tooth = (k + offset) * step
        while edge <= tooth and i < last:
            i += 1
            edge += weight[i]
        drawn[k] = i
    return drawn
