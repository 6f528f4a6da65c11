"""Tracks go on where the newest view's own search found a better pose within reach."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from firstfix.belief.adjust import slack_between, strains
from firstfix.belief.evidence import log_likelihoods
from firstfix.belief.joint import odometry_logs, power_of
from firstfix.belief.planar import between, compose
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Observation
from firstfix.core.angles import wrap
from firstfix.fields.map_fields import MapFields

# Odometry between two views is hardly ever farther off.
_REACH_M = 0.5
_REACH_RAD = math.radians(20.0)


def rejoin(
    tracks: Tracks, entering: Tracks, window: Sequence[Observation], fields: MapFields
) -> Tracks:
    """Move the newest poses of tracks to places that enter, where that makes them more likely.

    Adjustment from the predicted pose ends in the nearest minimum, which is a wrong one where
    odometry is far off, such as the heading of an old robot after a turn.

    Parameters
    ----------
    tracks : Tracks
        Followed to the newest view.
    entering : Tracks
        Places of the newest view's search, over this view only.
    window : sequence of Observation
        The views, oldest first.
    fields : MapFields
        The prepared map.

    Returns
    -------
    Tracks
        The same tracks.
    """
    if len(window) < 2 or len(tracks) == 0 or len(entering) == 0:
        return tracks
    predicted = compose(tracks.poses[:, -2], between(window[-2].odometry, window[-1].odometry))
    apart = predicted[:, None] - entering.now[None]
    near = np.hypot(apart[..., 0], apart[..., 1]) * fields.grid.resolution <= _REACH_M
    near &= np.abs(wrap(apart[..., 2])) <= _REACH_RAD
    track, place = np.nonzero(near)
    slack = slack_between(window[-2], window[-1])
    strain = strains(predicted[track], entering.now[place], slack)
    power, newest = power_of(window) / len(window), entering.costs[place, 0]
    gain = log_likelihoods(newest, power) - log_likelihoods(tracks.costs[track, -1], power)
    gain += odometry_logs(strain) - odometry_logs(tracks.strains[track, -1])
    # Of the places within reach of one track the best comes last, and stays.
    order = np.argsort(gain, kind="stable")
    order = order[gain[order] > 0.0]
    track = track[order]
    poses, costs, strained = tracks.poses.copy(), tracks.costs.copy(), tracks.strains.copy()
    careful = tracks.careful.copy()
    poses[track, -1], costs[track, -1] = entering.now[place[order]], newest[order]
    strained[track, -1], careful[track, -1] = strain[order], False
    return replace(tracks, poses=poses, costs=costs, strains=strained, careful=careful)
