"""Places of many maps for several scans: the belief of each map, weighed by all views."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.belief import Belief, begin, brings_news, update
from firstfix.belief.evidence import (
    ODOMETRY_WEIGHT,
    WRONG_MAP_COST,
    exponent,
    log_likelihoods,
    novelty,
)
from firstfix.belief.hints import hint_logs
from firstfix.belief.prior import FLOOR
from firstfix.belief.several import distinct_views
from firstfix.site.maps import PreparedMap
from firstfix.site.places import SitePlace
from firstfix.site.query import SiteQuery
from firstfix.site.search import Maps, as_place


def search_views(query: SiteQuery, map_ids: Sequence[str], maps: Maps) -> tuple[SitePlace, ...]:
    """Search several maps for several scans of a robot that moved.

    Parameters
    ----------
    query : SiteQuery
        Several views.
    map_ids : sequence of str
        The maps; all can be loaded.
    maps : callable
        Loads a map by its id.

    Returns
    -------
    tuple of SitePlace
        Those that the belief of each map lists.
    """
    return tuple(place for map_id in map_ids for place in _places(query, maps(map_id)))


def _places(query: SiteQuery, prepared: PreparedMap) -> list[SitePlace]:
    map_id = prepared.entry.id
    belief = begin(prepared.fields, query.prior_in(map_id))
    for view in distinct_views(query.scans, query.T_odom_base):
        if brings_news(belief, view.T_odom_base) or view.T_odom_base is query.T_odom_base[-1]:
            belief = update(belief, view)
    if not belief.window:
        return []
    logs = joint_logs(belief)
    if query.prior is not None and map_id not in query.prior:
        before = np.full(len(logs), FLOOR)
    else:
        before = hint_logs(belief.tracks.now, belief.window[-1], belief.hints, prepared.fields.grid)
    return [
        as_place(
            hypothesis,
            prepared,
            float(logs[i]),
            float(before[i]),
            tuple(belief.tracks.costs[i].tolist()),
        )
        for i, hypothesis in enumerate(belief.places)
    ]


def joint_logs(belief: Belief) -> NDArray[np.float64]:
    """Return log-likelihoods of a belief's places by its views, shape (n,); a wrong map has 0."""
    power = exponent(float(novelty(belief.window).sum()), len(belief.window[-1].beams))
    costs = np.append(belief.tracks.costs.mean(axis=1), WRONG_MAP_COST)
    logs = log_likelihoods(costs, power)
    strains = ODOMETRY_WEIGHT * belief.tracks.strains.sum(axis=1)
    joint: NDArray[np.float64] = logs[:-1] - logs[-1] - strains
    return joint
