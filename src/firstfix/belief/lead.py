"""Whether the best place is ahead of all others by more than one thing.

Views of one drive are not independent: a cupboard that was moved is seen in all of them, and speaks
in all of them for the place that happens to have one there. However many views agree, a place that
is ahead by one such thing only is not certain, unless hardly anything has been moved there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from firstfix.belief.config import BeliefConfig
from firstfix.belief.evidence import FLOOR, log_likelihoods
from firstfix.belief.joint import counted_since, odometry_logs, power_of
from firstfix.belief.planar import compose
from firstfix.belief.tracks import BEAMS, Tracks
from firstfix.belief.view import Observation
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.verify import beam_costs

# A thing is what lies in a square of this side: cells are shifted by a third of it.
_THING_M = 1.5
_CELLS = 3

# Without the thing the place must still be twenty times as likely as each other one, nats.
_LEAST_LEAD = 3.0

# What a beam costs where nothing has been moved, and little noise and few people are about. On
# floors 3400 to 3423 and 3632 to 3695, all wrong places but one that had nearly all of the
# probability cost more.
_UNCHANGED_COST = 0.2

# Places, the best one included, that are compared.
_COMPARED = 64


def leads(
    tracks: Tracks, window: Sequence[Observation], fields: MapFields, config: BeliefConfig
) -> bool:
    """Tell whether the first place may be sure although the building may have changed.

    Parameters
    ----------
    tracks : Tracks
        Most likely first; at least one.
    window : sequence of Observation
        The views, oldest first.
    fields : MapFields
        The prepared map.
    config : BeliefConfig
        Settings.

    Returns
    -------
    bool
        True if nearly all that it has seen is as the map has it, or if it is ahead by more than one
        thing: `lead`.
    """
    costs = tracks.costs[0, counted_since(tracks, window, config)[0] :]
    typical = float(np.exp(np.log(costs + FLOOR).mean())) - FLOOR
    return typical <= _UNCHANGED_COST or lead(tracks, window, fields, config) >= _LEAST_LEAD


def lead(
    tracks: Tracks, window: Sequence[Observation], fields: MapFields, config: BeliefConfig
) -> float:
    """Return how far the first place is ahead of the others, with one thing left out for each.

    Arguments as in `leads`.

    Returns
    -------
    float
        The least difference of log-likelihoods, each without the thing that speaks most against the
        other place: in its map, where its beams end or should have ended. Infinite without others.
    """
    tracks = tracks.take(np.arange(min(len(tracks), _COMPARED)))
    if len(tracks) < 2:
        return float("inf")
    costs, causes = _by_beam(tracks, window, fields)
    since = counted_since(tracks, window, config)
    power = power_of(window) / len(window)
    strains = odometry_logs(tracks.strains)
    return min(
        _ahead(costs[[0, rival]], causes[rival], strains[[0, rival]], power, first)
        for rival, first in enumerate(np.maximum(since, since[0]).tolist())
        if rival > 0
    )


def _by_beam(
    tracks: Tracks, window: Sequence[Observation], fields: MapFields
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what each beam costs, (n, v, beams), and where its cause is, (n, v, beams, 2), m."""
    most = max(len(seen.beams.thinned(BEAMS)) for seen in window)
    costs = np.zeros((len(tracks), len(window), most))
    causes = np.zeros((*costs.shape, 2))
    resolution = fields.grid.resolution
    for v, seen in enumerate(window):
        beams = seen.beams.thinned(BEAMS)
        lasers = compose(tracks.poses[:, v], seen.sensor.T_base_laser)
        costs[:, v, : len(beams)], away = beam_costs(lasers, beams, fields)
        headings = lasers[:, 2:] + beams.bearings
        c, s = np.cos(lasers[:, 2:]), np.sin(lasers[:, 2:])
        x, y = beams.starts.T
        at = causes[:, v, : len(beams)]
        at[..., 0] = resolution * lasers[:, :1] + c * x - s * y + away * np.cos(headings)
        at[..., 1] = resolution * lasers[:, 1:2] + s * x + c * y + away * np.sin(headings)
        causes[:, v, len(beams) :] = at[:, :1]
    return costs, causes


def _ahead(
    costs: NDArray[np.float64],
    causes: NDArray[np.float64],
    strains: NDArray[np.float64],
    power: float,
    first: int,
) -> float:
    """Return how far a place is ahead of another, (2, v, beams), without one thing."""
    costs, causes, strains = costs[:, first:], causes[first:], strains[:, first:]
    totals = costs.sum(axis=2)
    against = costs[1] - costs[0]
    spared = np.where(_thing(causes, against / (totals[1] + FLOOR)[:, None]), against, 0.0)
    totals[1] -= np.minimum(spared.sum(axis=1), totals[1])
    logs = (log_likelihoods(totals, power) + strains).sum(axis=1)
    return float(logs[0] - logs[1])


def _thing(causes: NDArray[np.float64], against: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which beams, (v, beams), are caused in the square that speaks most against a place."""
    cells = np.floor(causes / (_THING_M / _CELLS)).astype(np.int64)
    cells -= cells.min(axis=(0, 1)) - (_CELLS - 1)
    sums = np.zeros(cells.max(axis=(0, 1)) + _CELLS)
    np.add.at(sums, (cells[..., 0], cells[..., 1]), against)
    squares = sliding_window_view(sums, (_CELLS, _CELLS)).sum(axis=(2, 3))
    corner = np.array(np.unravel_index(squares.argmax(), squares.shape))
    past: NDArray[np.bool_] = (cells >= corner) & (cells < corner + _CELLS)
    return past[..., 0] & past[..., 1]
