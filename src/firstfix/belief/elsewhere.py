"""How much of the probability belongs to places of the map that are not held."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.config import BeliefConfig
from firstfix.belief.evidence import FLOOR, WRONG_MAP_COST, novelty
from firstfix.belief.joint import last_break
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Observation
from firstfix.global_localization.places import distinct_places

# A logistic regression of "the best place is wrong" on what views say of it, rounded. Chosen on
# floors 1000 to 1011 and nine real buildings, one left out at a time; judged on others
# (docs/decisions/0032).
#
# Before any view the odds that the best place is a wrong one are as the area that a sensor covers
# is to this: wrong answers to single scans grow so, from 0.3 % at 201 m² to 5 % at 13 m².
_EVEN_M2 = 150.0
# What a view speaks for the best place if no more than two other places fit it as well, nats; and
# how much more if these fit worse, for each unit of the logarithm of their costs.
_NEW_VIEW = 2.0
_GAIN_EXPONENT = 3.0
# One view of something that has changed, however much, speaks against a place by one nat.
_LEAST_GAIN = -1.0

# The place of each view's own search with which the best place is compared.
_RIVAL = 3


def rival_cost(entering: Tracks, resolution: float) -> float:
    """Return the cost of the third best place of a view's own search; infinite if there is none.

    Parameters
    ----------
    entering : Tracks
        The places that the search proposes, over one view.
    resolution : float
        Side of a cell, m.
    """
    costs = entering.costs[:, 0]
    best = distinct_places(entering.now, costs, resolution, _RIVAL)
    return float(costs[best[-1]]) if len(best) == _RIVAL else math.inf


def missed_log_odds(tracks: Tracks, window: Sequence[Observation], config: BeliefConfig) -> float:
    """Return the log-odds that the robot is at a place that is not held, against the best place.

    The true place may never have been proposed, or it was dropped because something stands in its
    view. Then the best place is one of many that explain a part of the views by chance. It is a
    better one than those only if it explains every view about as well as the best places of that
    view's own search do: a place that was right all the time does. Where a view fits everywhere, as
    that of a wall, this says little; a camera that turns along a wall sees nothing new.

    Parameters
    ----------
    tracks : Tracks
        Most likely first; at least one.
    window : sequence of Observation
        The views, oldest first, each with its `rival_cost`.
    config : BeliefConfig
        Settings.
    """
    rivals = np.minimum([seen.rival_cost for seen in window], WRONG_MAP_COST)
    gains = np.log((rivals + FLOOR) / (tracks.costs[0] + FLOOR))
    gains = _NEW_VIEW + _GAIN_EXPONENT * np.maximum(gains, _LEAST_GAIN)
    gains *= novelty(window)
    # A robot that was carried has been elsewhere: older views do not count against its new place.
    older = max(0, len(window) - config.window, last_break(window))
    evidence = max(0.0, float(gains[:older].sum())) + float(gains[older:].sum())
    return math.log(_EVEN_M2 / max(1.0, window[-1].covered_m2)) - evidence


def with_missed(listed: NDArray[np.float64], log_odds: float) -> tuple[NDArray[np.float64], float]:
    """Make room for places that are not held.

    Parameters
    ----------
    listed : ndarray, shape (n,)
        Probabilities of the places, most likely first, if all that explain the views were held.
    log_odds : float
        Of a place that is not held, against the first.

    Returns
    -------
    probabilities : ndarray, shape (n,)
        Of the places.
    missed : float
        Of all places that are not held.
    """
    weight = float(listed[0]) * math.exp(log_odds)
    return listed / (1.0 + weight), weight / (1.0 + weight)
