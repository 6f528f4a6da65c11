"""The joint log-likelihoods of places over the views that are kept."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.config import BeliefConfig
from firstfix.belief.evidence import exponent, log_likelihoods, novelty
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Link, Observation

# Wheels slip once in twenty views; how far does not matter then.
SLIP_LOG = math.log(0.05)

# Log-probability that the robot was carried since its older views: as that of a wrong hint.
CARRIED_LOG = math.log(0.001)
# If each scan goes on from the one before, it was carried unseen: hardly one kidnap in a hundred.
_UNSEEN_LOG = math.log(0.01)
# What CARRIED_LOG is before a view that does not go on from the one before.
BROKEN_LOG = math.log(0.05)

# If places where the robot has been all the time have less probability, it was carried.
_LEAST_STAYED = 0.05


def power_of(window: Sequence[Observation]) -> float:
    """Return the exponent of the power law for the views of a window."""
    return exponent(float(novelty(window).sum()), len(window[-1].beams))


def joint_log_likelihoods(
    tracks: Tracks, window: Sequence[Observation], config: BeliefConfig
) -> NDArray[np.float64]:
    """Weigh tracks by all views, up to a constant.

    A place that does not explain the older views may be one to which the robot was carried. Until
    then it was at the place that explains them best. So a kidnap costs a fixed probability, however
    long the memory is; a smaller one at a view that does not go on from the one before.

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
    by_view = _by_view(tracks, window)
    logs: NDArray[np.float64] = by_view.sum(axis=1)
    if len(tracks) == 0:
        return logs
    for first, carried_log in _changes(window, config):
        logs = np.maximum(logs, _carried_since(by_view, first) + carried_log)
    return logs


def counted_since(
    tracks: Tracks, window: Sequence[Observation], config: BeliefConfig
) -> NDArray[np.int64]:
    """Return the first view that counts for each track, shape (n,): 0 if it may have stayed.

    Parameters
    ----------
    tracks : Tracks
        Over all views of the window; at least one.
    window : sequence of Observation
        The views, oldest first.
    config : BeliefConfig
        Settings.
    """
    by_view = _by_view(tracks, window)
    changes = _changes(window, config)
    carried = [_carried_since(by_view, first) + carried_log for first, carried_log in changes]
    likeliest = np.argmax([by_view.sum(axis=1), *carried], axis=0)
    since: NDArray[np.int64] = np.array([0, *(first for first, _ in changes)])[likeliest]
    return since


def carried_at(
    tracks: Tracks,
    probabilities: NDArray[np.float64],
    window: Sequence[Observation],
) -> int:
    """Return the first view since the robot was carried away; 0 if it may have stayed.

    Parameters
    ----------
    tracks : Tracks
        Over all views of the window.
    probabilities : ndarray, shape (n,)
        Of the tracks.
    window : sequence of Observation
        The views, oldest first.
    """
    first = last_break(window)
    if first == 0 or len(tracks) == 0:
        return 0
    by_view = _by_view(tracks, window)
    has_stayed = by_view.sum(axis=1) >= _carried_since(by_view, first) + BROKEN_LOG
    stayed = float(probabilities[has_stayed].sum())
    return first if stayed < _LEAST_STAYED * float(probabilities.sum()) else 0


def last_break(window: Sequence[Observation]) -> int:
    """Return the newest view that does not go on from the one before; 0 if there is none."""
    return max((i for i, seen in enumerate(window) if seen.link is Link.BROKEN), default=0)


def _changes(window: Sequence[Observation], config: BeliefConfig) -> list[tuple[int, float]]:
    """Return the views before which the robot may have been carried, and how likely it was."""
    older = len(window) - config.window
    goes_on = all(seen.link is Link.GOES_ON for seen in window[max(0, older) :])
    unseen_log = CARRIED_LOG + (_UNSEEN_LOG if goes_on else 0.0)
    changes = [(older, unseen_log)] if older > 0 else []
    broken = [i for i, seen in enumerate(window) if i > 0 and seen.link is Link.BROKEN]
    return changes + [(i, BROKEN_LOG) for i in broken]


def _by_view(tracks: Tracks, window: Sequence[Observation]) -> NDArray[np.float64]:
    by_view = log_likelihoods(tracks.costs, power_of(window) / len(window))
    by_view += odometry_logs(tracks.strains)
    return by_view


def _carried_since(by_view: NDArray[np.float64], first: int) -> NDArray[np.float64]:
    before = float(by_view[:, :first].sum(axis=1).max())
    carried: NDArray[np.float64] = by_view[:, first:].sum(axis=1) + before
    return carried


def odometry_logs(strains: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the log-likelihoods of adjustments from their strains, same shape."""
    logs: NDArray[np.float64] = -np.minimum(strains, -SLIP_LOG)
    return logs
