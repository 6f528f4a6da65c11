"""The joint log-likelihoods of places over the views that are kept."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.config import BeliefConfig
from firstfix.belief.evidence import exponent, log_likelihoods, novelty
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Observation

# Wheels slip once in twenty views; how far does not matter then.
SLIP_LOG = math.log(0.05)

# Log-probability that the robot was carried since its older views: as that of a wrong hint.
CARRIED_LOG = math.log(0.001)


def power_of(window: Sequence[Observation]) -> float:
    """Return the exponent of the power law for the views of a window."""
    return exponent(float(novelty(window).sum()), len(window[-1].beams))


def joint_log_likelihoods(
    tracks: Tracks, window: Sequence[Observation], config: BeliefConfig
) -> NDArray[np.float64]:
    """Weigh tracks by all views, up to a constant.

    A place that does not explain the older views may be one to which the robot was carried. Until
    then it was at the place that explains them best. So a kidnap costs a fixed probability, however
    long the memory is.

    Parameters
    ----------
    tracks : Tracks
        Over all views of the window.
    window : sequence of Observation
        The views, oldest first; those before the latest `config.window` are older views.
    config : BeliefConfig
        Settings.

    Returns
    -------
    ndarray, shape (n,)
        Log-likelihoods.
    """
    by_view = log_likelihoods(tracks.costs, power_of(window) / len(window))
    by_view += odometry_logs(tracks.strains)
    stayed: NDArray[np.float64] = by_view.sum(axis=1)
    older = len(window) - config.window
    if older <= 0 or len(tracks) == 0:
        return stayed
    before = float(by_view[:, :older].sum(axis=1).max())
    carried = by_view[:, older:].sum(axis=1) + before + CARRIED_LOG
    logs: NDArray[np.float64] = np.maximum(stayed, carried)
    return logs


def odometry_logs(strains: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the log-likelihoods of adjustments from their strains, same shape."""
    logs: NDArray[np.float64] = -np.minimum(strains, -SLIP_LOG)
    return logs
