"""Places of many maps for several scans: the belief of each map, weighed by all views."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.belief import NEWS_M, NEWS_RAD, Belief, begin, update
from firstfix.belief.config import BeliefConfig
from firstfix.belief.enter import shortlist_of
from firstfix.belief.evidence import WRONG_MAP_COST, log_likelihoods
from firstfix.belief.hints import hint_logs
from firstfix.belief.joint import joint_log_likelihoods, power_of
from firstfix.belief.planar import compose
from firstfix.belief.prior import FLOOR
from firstfix.belief.several import distinct_views
from firstfix.belief.view import View
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.lead import part_costs
from firstfix.global_localization.look import look_into
from firstfix.global_localization.prior import DEEPER
from firstfix.global_localization.search import Candidates
from firstfix.global_localization.sensors import joint_beams, see_enough
from firstfix.site.maps import Maps, PreparedMap
from firstfix.site.places import SitePlace
from firstfix.site.query import SitePrior, SiteQuery
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
    views = views_of(query)
    found = (
        _found_together(query, views, [maps(map_id).fields for map_id in map_ids])
        if are_seen_together(query)
        else [(None,) * len(views)] * len(map_ids)
    )
    histories = [
        _history(query, views, maps(map_id), of_map)
        for map_id, of_map in zip(map_ids, found, strict=True)
    ]
    totals = np.logaddexp.reduce([history.totals for history in histories], axis=0)
    return tuple(place for history in histories for place in history.places), totals


def are_seen_together(query: SiteQuery) -> bool:
    """Tell whether each view is looked for in all maps together.

    A sensor that sees little fits everywhere: then each map is searched by itself.
    """
    return all(see_enough(view.scans) for view in views_of(query))


def _found_together(
    query: SiteQuery, views: Sequence[View], maps: Sequence[MapFields]
) -> list[tuple[Candidates | None, ...]]:
    """Return, for each map, where each view may have been taken."""
    config = BeliefConfig()
    deeper = 1 if query.prior is None else DEEPER
    looks: list[Sequence[Candidates | None]] = []
    is_first = True
    for view in views:
        _, beams = joint_beams(view.scans)
        if int(np.count_nonzero(beams.hit)) < FEWEST_HITS:  # nothing enters a belief by it
            looks.append([None] * len(maps))
            continue
        looks.append(look_into(beams, maps, deeper * shortlist_of(config, is_first=is_first)))
        is_first = False
    return list(zip(*looks, strict=True))


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


def _history(
    query: SiteQuery,
    views: Sequence[View],
    prepared: PreparedMap,
    found: Sequence[Candidates | None],
) -> MapHistory:
    map_id = prepared.entry.id
    before = known_of(map_id, query.prior)
    belief = begin(prepared.fields, query.prior_in(map_id))
    steps: list[dict[int, float]] = []
    for view, candidates in zip(views, found, strict=True):
        belief = update(belief, view, candidates)
        steps.append(
            dict(zip(belief.tracks.ids.tolist(), (logs_of(belief) + before).tolist(), strict=True))
        )
    totals = np.array(
        [np.logaddexp.reduce([*logs.values()]) if logs else -np.inf for logs in steps]
    )
    names = belief.tracks.ids.tolist()
    past = [tuple(logs.get(name, -math.inf) for logs in steps) for name in names]
    return MapHistory(described(belief, prepared, before, past), totals)


def described(
    belief: Belief, prepared: PreparedMap, before: float, past: Sequence[tuple[float, ...]]
) -> list[SitePlace]:
    """Describe the places that a belief lists.

    Parameters
    ----------
    belief : Belief
        Of one map.
    prepared : PreparedMap
        The map.
    before : float
        What was known of the map: a log-likelihood up to 0.
    past : sequence of tuple of float
        `SitePlace.steps` of each place.
    """
    if not belief.window:
        return []
    alone = joint_logs(belief)
    hinted = hint_logs(belief.tracks.now, belief.window[-1], belief.hints, prepared.fields.grid)
    parts = _parts_of_best(belief)
    return [
        as_place(
            hypothesis,
            prepared,
            float(alone[i]),
            float(hinted[i]) + before,
            past[i],
            float(belief.tracks.costs[i, -1]),
            parts if i == 0 else (),
        )
        for i, hypothesis in enumerate(belief.places)
    ]


def _parts_of_best(belief: Belief) -> tuple[float, ...]:
    """Return what each part of each view costs at the best place of a map."""
    if len(belief.tracks) == 0:
        return ()
    parts = []
    for pose, seen in zip(belief.tracks.poses[0], belief.window, strict=True):
        at = compose(pose[None], seen.sensor.T_base_laser)
        parts += part_costs(at, seen.beams, belief.fields)[0].tolist()
    return tuple(parts)


def logs_of(belief: Belief) -> NDArray[np.float64]:
    """Return log-posteriors of a belief's places, shape (n,); a wrong map has 0."""
    if not belief.window:
        return np.empty(0)
    hints = hint_logs(belief.tracks.now, belief.window[-1], belief.hints, belief.fields.grid)
    return joint_logs(belief) + hints


def known_of(map_id: str, prior: SitePrior | None) -> float:
    """Return what a prior says of a map as a whole: a log-likelihood up to 0."""
    return 0.0 if prior is None or map_id in prior else FLOOR


def joint_logs(belief: Belief) -> NDArray[np.float64]:
    """Return log-likelihoods of a belief's places by its views, shape (n,); a wrong map has 0."""
    nowhere = log_likelihoods(np.array([WRONG_MAP_COST]), power_of(belief.window))
    logs = joint_log_likelihoods(belief.tracks, belief.window, belief.config)
    joint: NDArray[np.float64] = logs - nowhere
    return joint
