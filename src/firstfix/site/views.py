"""Places of many maps for several scans: the belief of each map, weighed by all views."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.belief import NEWS_M, NEWS_RAD, Belief, begin, update
from firstfix.belief.evidence import WRONG_MAP_COST, log_likelihoods
from firstfix.belief.hints import hint_logs
from firstfix.belief.joint import joint_log_likelihoods, power_of
from firstfix.belief.prior import FLOOR
from firstfix.belief.several import distinct_views
from firstfix.belief.view import View
from firstfix.site.maps import Maps, PreparedMap
from firstfix.site.places import SitePlace
from firstfix.site.query import SiteQuery
from firstfix.site.search import as_place


@dataclass(frozen=True, eq=False)
class MapHistory:
    """The places of one map after the last view, and the evidence after each.

    Parameters
    ----------
    places : list of SitePlace
        Those that the belief lists.
    totals : ndarray, shape (steps,)
        Logarithm of the likelihood of all places of the map after each view.
    """

    places: list[SitePlace]
    totals: NDArray[np.float64]


def search_views(
    query: SiteQuery, map_ids: Sequence[str], maps: Maps
) -> tuple[tuple[SitePlace, ...], NDArray[np.float64]]:
    """Search several maps for several scans of a robot that moved.

    Parameters
    ----------
    query : SiteQuery
        Several views.
    map_ids : sequence of str
        The maps, at least one; all can be loaded.
    maps : callable
        Loads a map by its id.

    Returns
    -------
    places : tuple of SitePlace
        Those that the belief of each map lists.
    totals : ndarray, shape (steps,)
        Logarithm of the likelihood of all places of all maps after each view.
    """
    histories = [_history(query, maps(map_id)) for map_id in map_ids]
    totals = np.logaddexp.reduce([history.totals for history in histories], axis=0)
    return tuple(place for history in histories for place in history.places), totals


def views_of(query: SiteQuery) -> list[View]:
    """Return the views of a query that bring news, and the last one."""
    distinct = distinct_views(query.scans, query.T_odom_base)
    chosen: list[View] = []
    for view in distinct:
        if not chosen or view is distinct[-1] or has_moved(chosen[-1], view, NEWS_M, NEWS_RAD):
            chosen.append(view)
    return chosen


def has_moved(start: View, end: View, metres: float, radians: float) -> bool:
    """Tell whether the robot has moved or turned by so much between two views."""
    step = start.T_odom_base.inverse() @ end.T_odom_base
    return math.hypot(step.x, step.y) >= metres or abs(step.yaw) >= radians


def _history(query: SiteQuery, prepared: PreparedMap) -> MapHistory:
    map_id = prepared.entry.id
    is_named = query.prior is None or map_id in query.prior
    before = 0.0 if is_named else FLOOR
    belief = begin(prepared.fields, query.prior_in(map_id))
    steps: list[dict[int, float]] = []
    for view in views_of(query):
        belief = update(belief, view)
        steps.append(
            dict(zip(belief.tracks.ids.tolist(), (_logs(belief) + before).tolist(), strict=True))
        )
    totals = np.array(
        [np.logaddexp.reduce([*logs.values()]) if logs else -np.inf for logs in steps]
    )
    if not belief.window:
        return MapHistory([], totals)
    alone = joint_logs(belief)
    hinted = hint_logs(belief.tracks.now, belief.window[-1], belief.hints, prepared.fields.grid)
    places = [
        as_place(
            hypothesis,
            prepared,
            float(alone[i]),
            float(hinted[i]) + before,
            tuple(logs.get(int(belief.tracks.ids[i]), -math.inf) for logs in steps),
            float(belief.tracks.costs[i, -1]),
        )
        for i, hypothesis in enumerate(belief.places)
    ]
    return MapHistory(places, totals)


def _logs(belief: Belief) -> NDArray[np.float64]:
    if not belief.window:
        return np.empty(0)
    hints = hint_logs(belief.tracks.now, belief.window[-1], belief.hints, belief.fields.grid)
    return joint_logs(belief) + hints


def joint_logs(belief: Belief) -> NDArray[np.float64]:
    """Return log-likelihoods of a belief's places by its views, shape (n,); a wrong map has 0."""
    nowhere = log_likelihoods(np.array([WRONG_MAP_COST]), power_of(belief.window))
    logs = joint_log_likelihoods(belief.tracks, belief.window, belief.config)
    joint: NDArray[np.float64] = logs - nowhere
    return joint
