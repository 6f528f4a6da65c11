"""What views say together, and how much of it is new."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.view import Observation
from firstfix.core.angles import angle_error

# The power law of docs/decisions/0005 on the cost at each view. The exponents of all views sum to
# one that grows with the number of independent views, slowly: what is wrong in the map is wrong in
# several views. All of these are chosen by leaving out one of nine buildings at a time, over four
# sensors, with the mean cost of all views; docs/decisions/0020 says what the product changes.
EXPONENT = 12.0
EXPONENT_GROWTH = 0.5
FLOOR = 0.3
BEAMS_FOR_EXPONENT = 30

# Mean cost at which the best place of a wrong map begins to be as good as the right one.
WRONG_MAP_COST = 2.3

# A view is new in full if it was taken this far from every later one, or turned by a field of view
# (by a radian if that is narrower).
NEW_M = 2.0
NEW_LEAST_RAD = 1.0


def novelty(window: Sequence[Observation]) -> NDArray[np.float64]:
    """Return how much of each view is new, shape (v,): 1 for the newest, 0 to 1 for the others.

    Parameters
    ----------
    window : sequence of Observation
        Oldest first.
    """
    odometry = np.array([seen.odometry for seen in window])
    apart = odometry[:, None] - odometry[None]
    path = np.hypot(apart[..., 0], apart[..., 1]) * window[-1].resolution
    turn = angle_error(odometry[:, None, 2], odometry[None, :, 2])
    wide = max(NEW_LEAST_RAD, window[-1].field_of_view)
    new = np.maximum(path / NEW_M, turn / wide)
    new[np.tril_indices(len(window))] = 1.0
    least: NDArray[np.float64] = new.min(axis=1)
    return least


def exponent(views: float, beams: int) -> float:
    """Return the exponent of the power law.

    Parameters
    ----------
    views : float
        Number of independent views, at least 1.
    beams : int
        Number of beams of a view.
    """
    growth = 1.0 + EXPONENT_GROWTH * math.log2(views)
    return EXPONENT * growth * min(1.0, beams / BEAMS_FOR_EXPONENT)


def shares(logs: NDArray[np.float64], power: float) -> tuple[NDArray[np.float64], float]:
    """Return the probability of each place, shape (n,), and of a place that is not listed.

    Parameters
    ----------
    logs : ndarray, shape (n,)
        Log-likelihoods of separate places, priors included.
    power : float
        The exponent behind them.
    """
    all_logs = np.append(logs, log_likelihoods(np.array([WRONG_MAP_COST]), power))
    likelihoods = np.exp(all_logs - all_logs.max())
    likelihoods /= likelihoods.sum()
    return likelihoods[:-1], float(likelihoods[-1])


def log_likelihoods(mean_costs: NDArray[np.float64], power: float) -> NDArray[np.float64]:
    """Turn mean costs of a beam into log-likelihoods, up to a constant; the same shape."""
    logs: NDArray[np.float64] = -power * np.log(mean_costs + FLOOR)
    return logs
