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
from firstfix.belief.several import distinct_views
from firstfix.fields.map_fields import MapFields
from firstfix.io.maps.site_yaml import SiteMap
from firstfix.site.places import SitePlace
from firstfix.site.query import SiteQuery
from firstfix.site.search import Fields, as_place, prior_logs


def search_views(
    query: SiteQuery, entries: Sequence[SiteMap], fields: Fields
) -> tuple[SitePlace, ...]:
    """Search several maps for several scans of a robot that moved.

    Parameters
    ----------
    query : SiteQuery
        Several views.
    entries : sequence of SiteMap
        The maps; all can be loaded.
    fields : callable
        Loads a map by its id.

    Returns
    -------
    tuple of SitePlace
        Best first.
    """
    places = [place for entry in entries for place in _places(query, entry, fields(entry.id))]
    return tuple(sorted(places, key=lambda place: -place.log_likelihood))


def _places(query: SiteQuery, entry: SiteMap, fields: MapFields) -> list[SitePlace]:
    belief = begin(fields, query.prior_in(entry.id))
    for view in distinct_views(query.scans, query.T_odom_base):
        if brings_news(belief, view.T_odom_base) or view.T_odom_base is query.T_odom_base[-1]:
            belief = update(belief, view)
    if not belief.window:
        return []
    logs = joint_logs(belief)
    elsewhere = query.prior is not None and entry.id not in query.prior
    logs += prior_logs(query, entry.id, belief.poses) if elsewhere else 0.0
    return [
        as_place(hypothesis, entry, fields, float(logs[i]), tuple(belief.tracks.costs[i].tolist()))
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
