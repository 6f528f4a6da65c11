"""Places of many maps, refined and verified in one pool."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.prior import FLOOR
from firstfix.core.estimate import Hypothesis
from firstfix.core.scan import LaserScan
from firstfix.fields.cache import content_key
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS, Beams
from firstfix.global_localization.config import MAX_POSES
from firstfix.global_localization.frames import bases_in_map
from firstfix.global_localization.places import distinct_places
from firstfix.global_localization.prior import PlacePrior
from firstfix.global_localization.refine import refine_on_field, refine_on_rays
from firstfix.global_localization.search import search
from firstfix.global_localization.sensors import joint_beams
from firstfix.global_localization.verdict import WRONG_MAP_COST, log_likelihoods
from firstfix.global_localization.verify import verified_place, verify
from firstfix.io.maps.site_yaml import SiteMap
from firstfix.site.places import SitePlace
from firstfix.site.query import SiteQuery

# Places of one map that may enter the pool, places of the pool that are refined, those whose beams
# are all compared, and those refined on rays.
MAP_PLACES = 150
POOL = 1000
CAREFUL_PLACES = 64
LISTED_PLACES = 24
FIRST_BEAMS = 60

Fields = Callable[[str], MapFields]


@dataclass(frozen=True, eq=False)
class _Pool:
    """Poses of a sensor in several maps.

    Parameters
    ----------
    maps : ndarray of int64, shape (n,)
        Index of the map of each.
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad).
    costs : ndarray, shape (n,)
        Lower is better.
    """

    maps: NDArray[np.int64]
    poses: NDArray[np.float64]
    costs: NDArray[np.float64]

    def take(self, index: NDArray[np.int64]) -> _Pool:
        return _Pool(self.maps[index], self.poses[index], self.costs[index])

    def best(self, n: int) -> _Pool:
        return self.take(np.argsort(self.costs, kind="stable")[:n])


def search_one_look(
    query: SiteQuery, entries: Sequence[SiteMap], fields: Fields
) -> tuple[SitePlace, ...]:
    """Search several maps for one scan of each sensor.

    Parameters
    ----------
    query : SiteQuery
        One look.
    entries : sequence of SiteMap
        The maps; all can be loaded.
    fields : callable
        Loads a map by its id.

    Returns
    -------
    tuple of SitePlace
        At most `LISTED_PLACES`, best first; none if the scan has too few hits.
    """
    scan, beams = joint_beams(query.scans)
    if int(np.count_nonzero(beams.hit)) < FEWEST_HITS:
        return ()
    pool = _searched(query, entries, fields, scan, beams).best(POOL)
    pool = _weighed(pool, entries, fields, beams, FIRST_BEAMS, refine_on_field)
    pool = _distinct(pool, entries, fields, CAREFUL_PLACES)
    pool = _distinct(
        _weighed(pool, entries, fields, beams, None, None), entries, fields, LISTED_PLACES
    )
    places = [
        place
        for i in np.unique(pool.maps).tolist()
        for place in _described(
            query, entries[i], fields(entries[i].id), scan, beams, pool.poses[pool.maps == i]
        )
    ]
    return tuple(sorted(places, key=lambda place: -place.log_likelihood)[:LISTED_PLACES])


def _searched(
    query: SiteQuery,
    entries: Sequence[SiteMap],
    fields: Fields,
    scan: LaserScan,
    beams: Beams,
) -> _Pool:
    maps, poses, costs = [], [], []
    for i, entry in enumerate(entries):
        own = fields(entry.id)
        known = PlacePrior(query.prior_in(entry.id), own.grid, scan, len(beams))
        candidates, _ = search(beams, own, known.depth(MAP_PLACES), MAX_POSES)
        chosen = known.chosen(candidates.poses, MAP_PLACES)
        maps.append(np.full(len(chosen), i))
        poses.append(chosen)
        costs.append(candidates.scores[: len(chosen)])
    return _Pool(np.concatenate(maps), np.concatenate(poses), np.concatenate(costs))


def _weighed(
    pool: _Pool,
    entries: Sequence[SiteMap],
    fields: Fields,
    beams: Beams,
    used: int | None,
    refine: Callable[[NDArray[np.float64], Beams, MapFields], NDArray[np.float64]] | None,
) -> _Pool:
    """Refine the poses of a pool, and compare beams with the map at each."""
    poses, costs = pool.poses.copy(), pool.costs.copy()
    compared = beams if used is None else beams.thinned(used)
    for i in np.unique(pool.maps).tolist():
        own, here = fields(entries[i].id), pool.maps == i
        if refine is not None:
            poses[here] = refine(poses[here], beams, own)
        costs[here] = verify(poses[here], compared, own).scores
    return _Pool(pool.maps, poses, costs)


def _distinct(pool: _Pool, entries: Sequence[SiteMap], fields: Fields, most: int) -> _Pool:
    """Keep the best pose of each place, and the best places of all maps."""
    kept = []
    for i in np.unique(pool.maps).tolist():
        here = np.flatnonzero(pool.maps == i)
        resolution = fields(entries[i].id).grid.resolution
        kept.append(here[distinct_places(pool.poses[here], pool.costs[here], resolution, most)])
    return pool.take(np.concatenate(kept)).best(most)


def _described(
    query: SiteQuery,
    entry: SiteMap,
    fields: MapFields,
    scan: LaserScan,
    beams: Beams,
    poses: NDArray[np.float64],
) -> list[SitePlace]:
    """Refine the best poses of one map on rays, and describe them."""
    on_rays, covariances = refine_on_rays(poses, beams, fields)
    # Rays are more precise, but worse in a map with smeared walls: keep the better pose of the two.
    poses = np.concatenate([on_rays, poses])
    covariances = np.concatenate([covariances, covariances])
    verification = verify(poses, beams, fields)
    costs = verification.scores
    kept = distinct_places(poses, costs, fields.grid.resolution, LISTED_PLACES)
    logs = log_likelihoods(np.append(costs, WRONG_MAP_COST), len(beams))
    logs = (
        logs[:-1] - logs[-1] + prior_logs(query, entry.id, bases_in_map(fields.grid, scan, poses))
    )
    return [
        as_place(
            verified_place(fields.grid, scan, verification, i, covariances[i], 0.0),
            entry,
            fields,
            float(logs[i]),
            (float(costs[i]),),
        )
        for i in kept.tolist()
    ]


def prior_logs(query: SiteQuery, map_id: str, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what the prior says of poses in a map, shape (n,): log-likelihoods up to 0."""
    if query.prior is None:
        return np.zeros(len(poses))
    if map_id not in query.prior:
        return np.full(len(poses), FLOOR)
    prior = query.prior[map_id]
    return np.zeros(len(poses)) if prior is None else prior.log_likelihood(poses)


def as_place(
    hypothesis: Hypothesis,
    entry: SiteMap,
    fields: MapFields,
    log_likelihood: float,
    costs: tuple[float, ...],
) -> SitePlace:
    """Return a place of a map with what the verdict needs to know of the map."""
    pose = hypothesis.pose
    return SitePlace(
        hypothesis=replace(hypothesis, map_id=entry.id),
        log_likelihood=log_likelihood,
        costs=costs,
        T_site_base=None if entry.T_site_map is None else entry.T_site_map @ pose,
        content=content_key(fields.grid.cells, repr(fields.grid.resolution)),
        level=(entry.building, entry.floor),
    )
