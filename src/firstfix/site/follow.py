"""The places of a robot in some maps, carried to its newest view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.belief import Belief, begin, update, with_prior
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Observation, View
from firstfix.site.maps import Maps, PreparedMap
from firstfix.site.places import SiteCandidates, SitePlace
from firstfix.site.site_belief import Followed, MapTracks, SiteBelief
from firstfix.site.views import described, known_of, logs_of

# Ids of the places of a map after a view, and the log-posterior of each.
Step = tuple[NDArray[np.int64], NDArray[np.float64]]


def follow(belief: SiteBelief, map_ids: Sequence[str], maps: Maps) -> Followed:
    """Weigh the places of some maps by the newest view, and let in those that it proposes.

    Parameters
    ----------
    belief : SiteBelief
        With the newest view. A map of which it has no place enters with what this view proposes,
        weighed by the views before, too. Without any place, all views propose.
    map_ids : sequence of str
        The maps, at least one; all can be loaded.
    maps : callable
        Loads a map by its id.
    """
    places: list[SitePlace] = []
    totals: list[NDArray[np.float64]] = []
    held: dict[str, MapTracks] = {}
    for map_id in map_ids:
        prepared, before = maps(map_id), known_of(map_id, belief.prior)
        carry = _weighed if belief.is_followed else _searched
        of_map, steps = carry(belief, prepared, before)
        totals.append(np.array([_total(logs) for _, logs in steps]))
        if not len(of_map.tracks):
            continue
        past = _past(of_map.tracks.ids, belief, map_id, steps)
        places += described(of_map, prepared, before, list(map(tuple, past.tolist())))
        rivals = tuple(seen.rival_cost for seen in of_map.window)
        held[map_id] = MapTracks(of_map.tracks, past, rivals, of_map.next_id)
    summed = np.logaddexp.reduce(totals, axis=0)
    return Followed(SiteCandidates(tuple(places), summed, tuple(map_ids)), held)


def _past(
    ids: NDArray[np.int64], belief: SiteBelief, map_id: str, steps: Sequence[Step]
) -> NDArray[np.float64]:
    """Return the log-posterior of each place after each view, shape (n, v)."""
    held = belief.maps.get(map_id)
    earlier = len(belief.views) - len(steps)
    past = np.full((len(ids), len(belief.views)), -np.inf)
    if held is not None:
        here, there = _common(ids, held.tracks.ids)
        past[here, :earlier] = held.past[there, :earlier]
    for i, (names, logs) in enumerate(steps):
        here, there = _common(ids, names)
        past[here, earlier + i] = logs[there]
    return past


def _common(
    ids: NDArray[np.int64], others: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    _, here, there = np.intersect1d(ids, others, assume_unique=True, return_indices=True)
    return here, there


def _empty(belief: SiteBelief, prepared: PreparedMap) -> Belief:
    known = None if belief.prior is None else belief.prior.get(prepared.entry.id)
    of_map = begin(prepared.fields)
    return of_map if known is None else with_prior(of_map, known, belief.T_odom_prior)


def _before(belief: SiteBelief, prepared: PreparedMap) -> Belief:
    """Return the belief over one map before the newest view."""
    resolution = prepared.fields.grid.resolution
    earlier = [*belief.views[:-1], *([belief.views[-1][:-1]] if belief.has_joined else [])]
    held = belief.maps.get(prepared.entry.id)
    if held is None:
        window = tuple(Observation(views, resolution) for views in earlier)
        return replace(_empty(belief, prepared), window=window, tracks=Tracks.none(len(window)))
    window = tuple(
        Observation(views, resolution, rival)
        for views, rival in zip(earlier, held.rivals, strict=True)
    )
    return replace(
        _empty(belief, prepared), window=window, tracks=held.tracks, next_id=held.next_id
    )


def _weighed(belief: SiteBelief, prepared: PreparedMap, before: float) -> tuple[Belief, list[Step]]:
    """Weigh the places of a map by the newest view."""
    of_map = _updated(_before(belief, prepared), belief.views[-1][-1])
    return of_map, [(of_map.tracks.ids, logs_of(of_map) + before)]


def _searched(
    belief: SiteBelief, prepared: PreparedMap, before: float
) -> tuple[Belief, list[Step]]:
    """Search a map for all views, one after the other."""
    of_map = _empty(belief, prepared)
    steps = []
    for group in belief.views:
        for view in group:
            of_map = _updated(of_map, view)
        steps.append((of_map.tracks.ids, logs_of(of_map) + before))
    return of_map, steps


def _updated(of_map: Belief, view: View) -> Belief:
    # Whether the robot was carried is decided for all maps together.
    return replace(update(of_map, view), misses=0)


def _total(logs: NDArray[np.float64]) -> float:
    return float(np.logaddexp.reduce(logs, initial=-np.inf))
