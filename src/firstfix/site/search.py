"""Places of many maps for one scan, refined and verified in one pool."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.prior import FLOOR
from firstfix.core.estimate import Hypothesis
from firstfix.core.scan import LaserScan
from firstfix.global_localization.beams import FEWEST_HITS, Beams
from firstfix.global_localization.frames import bases_in_map
from firstfix.global_localization.lead import part_costs
from firstfix.global_localization.look import look_into
from firstfix.global_localization.places import distinct_places
from firstfix.global_localization.prior import DEEPER
from firstfix.global_localization.refine import refine_on_field, refine_on_rays
from firstfix.global_localization.sensors import joint_beams
from firstfix.global_localization.verdict import (
    WRONG_MAP_COST,
    exponent_of,
    log_likelihoods,
    with_prior,
)
from firstfix.global_localization.verify import verified_place, verify
from firstfix.site.maps import Maps, PreparedMap
from firstfix.site.places import SitePlace
from firstfix.site.query import SiteQuery

# Places that one map may bring into the pool; places of the pool that are refined; those of which
# all beams are compared; those that are refined on rays and listed.
MAP_PLACES = 150
POOL_PLACES = 1000
CAREFUL_PLACES = 128
LISTED_PLACES = 24
FIRST_BEAMS = 60


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
        By the scan alone; lower is better.
    logs : ndarray, shape (n,)
        What is known before the scan: log-likelihoods up to 0.
    """

    maps: NDArray[np.int64]
    poses: NDArray[np.float64]
    costs: NDArray[np.float64]
    logs: NDArray[np.float64]

    def take(self, index: NDArray[np.int64]) -> _Pool:
        return _Pool(self.maps[index], self.poses[index], self.costs[index], self.logs[index])

    def by_map(self) -> list[tuple[int, NDArray[np.int64]]]:
        """Return each map with the indices of its poses."""
        return [(i, np.flatnonzero(self.maps == i)) for i in np.unique(self.maps).tolist()]

    def best(self, n: int, exponent: float) -> _Pool:
        """Keep the n best poses by the scan, and the n best with what is known before."""
        kept = np.argsort(self.costs, kind="stable")[:n]
        if self.logs.any():
            weighed = with_prior(self.costs, self.logs, exponent)
            kept = np.union1d(kept, np.argsort(weighed, kind="stable")[:n])
        return self.take(kept)


def search_one_look(
    query: SiteQuery, map_ids: Sequence[str], maps: Maps
) -> tuple[tuple[SitePlace, ...], NDArray[np.float64]]:
    """Search several maps for one scan of each sensor.

    Parameters
    ----------
    query : SiteQuery
        One look.
    map_ids : sequence of str
        The maps; all can be loaded.
    maps : callable
        Loads a map by its id.

    Returns
    -------
    places : tuple of SitePlace
        The best of all maps; none if the scan has too few hits.
    totals : ndarray, shape (1,)
        Logarithm of the likelihood of all of them.
    """
    scan, beams = joint_beams(query.scans)
    if int(np.count_nonzero(beams.hit)) < FEWEST_HITS:
        return (), np.array([-np.inf])
    pool = _searched(query, map_ids, maps, scan, beams)
    pool = _refined(pool, map_ids, maps, beams)
    exponent = exponent_of(beams)
    pool = _distinct(pool, map_ids, maps, exponent, CAREFUL_PLACES)
    pool = _compared(pool, map_ids, maps, beams)
    pool = _distinct(pool, map_ids, maps, exponent, LISTED_PLACES)
    places = [
        place
        for i, here in pool.by_map()
        for place in _described(query, maps(map_ids[i]), scan, beams, pool.poses[here])
    ]
    return tuple(places), np.array([np.logaddexp.reduce([p.log_posterior for p in places])])


def _searched(
    query: SiteQuery, map_ids: Sequence[str], maps: Maps, scan: LaserScan, beams: Beams
) -> _Pool:
    """Search every map, and keep the best places of all."""
    found, exponent = [], exponent_of(beams)
    # What is near a prior may be far down the list.
    is_hinted = any(query.prior_in(map_id) is not None for map_id in map_ids)
    depth = MAP_PLACES * DEEPER if is_hinted else MAP_PLACES
    looks = look_into(beams, [maps(map_id).fields for map_id in map_ids], depth)
    for i, (map_id, candidates) in enumerate(zip(map_ids, looks, strict=True)):
        fields = maps(map_id).fields
        bases = bases_in_map(fields.grid, scan, candidates.poses)
        logs = prior_logs(query, map_id, bases)
        index = np.full(len(logs), i)
        of_map = _Pool(index, candidates.poses, candidates.scores, logs)
        found.append(of_map.best(MAP_PLACES, exponent))
    return _joined(found).best(POOL_PLACES, exponent)


def _joined(pools: Sequence[_Pool]) -> _Pool:
    return _Pool(
        np.concatenate([pool.maps for pool in pools]),
        np.concatenate([pool.poses for pool in pools]),
        np.concatenate([pool.costs for pool in pools]),
        np.concatenate([pool.logs for pool in pools]),
    )


def _refined(pool: _Pool, map_ids: Sequence[str], maps: Maps, beams: Beams) -> _Pool:
    """Move the poses of a pool to where beams end on walls, and compare some beams there."""
    poses, costs = pool.poses.copy(), pool.costs.copy()
    few = beams.thinned(FIRST_BEAMS)
    for i, here in pool.by_map():
        fields = maps(map_ids[i]).fields
        poses[here] = refine_on_field(poses[here], beams, fields)
        costs[here] = verify(poses[here], few, fields).scores
    return _Pool(pool.maps, poses, costs, pool.logs)


def _compared(pool: _Pool, map_ids: Sequence[str], maps: Maps, beams: Beams) -> _Pool:
    """Compare all beams at the poses of a pool."""
    costs = pool.costs.copy()
    for i, here in pool.by_map():
        costs[here] = verify(pool.poses[here], beams, maps(map_ids[i]).fields).scores
    return replace(pool, costs=costs)


def _distinct(pool: _Pool, map_ids: Sequence[str], maps: Maps, exponent: float, most: int) -> _Pool:
    """Keep the best pose of each place, and the best places of all maps."""
    kept = []
    for i, here in pool.by_map():
        resolution = maps(map_ids[i]).fields.grid.resolution
        weighed = with_prior(pool.costs[here], pool.logs[here], exponent)
        kept += [
            here[distinct_places(pool.poses[here], costs, resolution, most)]
            for costs in ((pool.costs[here], weighed) if pool.logs.any() else (weighed,))
        ]
    return pool.take(np.unique(np.concatenate(kept))).best(most, exponent)


def _described(
    query: SiteQuery,
    prepared: PreparedMap,
    scan: LaserScan,
    beams: Beams,
    poses: NDArray[np.float64],
) -> list[SitePlace]:
    """Refine the best poses of one map on rays, and describe them."""
    fields, map_id = prepared.fields, prepared.entry.id
    on_rays, covariances = refine_on_rays(poses, beams, fields)
    # Rays are more precise, but worse in a map with smeared walls: keep the better pose of the two.
    poses = np.concatenate([on_rays, poses])
    covariances = np.concatenate([covariances, covariances])
    verification = verify(poses, beams, fields)
    costs = verification.scores
    logs = log_likelihoods(np.append(costs, WRONG_MAP_COST), exponent_of(beams))
    before = prior_logs(query, map_id, bases_in_map(fields.grid, scan, poses))
    parts = part_costs(poses, beams, fields).tolist()
    return [
        as_place(
            verified_place(fields.grid, scan, verification, i, covariances[i], 0.0),
            prepared,
            float(logs[i] - logs[-1]),
            float(before[i]),
            (float(logs[i] - logs[-1] + before[i]),),
            float(costs[i]),
            tuple(parts[i]),
        )
        for i in distinct_places(poses, costs, fields.grid.resolution, LISTED_PLACES).tolist()
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
    prepared: PreparedMap,
    log_likelihood: float,
    prior_log: float,
    steps: tuple[float, ...],
    cost: float,
    parts: tuple[float, ...] = (),
) -> SitePlace:
    """Return a place of a map with what the verdict needs to know of the map."""
    entry, pose = prepared.entry, hypothesis.pose
    return SitePlace(
        hypothesis=replace(hypothesis, map_id=entry.id),
        log_likelihood=log_likelihood,
        prior_log=prior_log,
        steps=steps,
        cost=cost,
        T_site_base=None if entry.T_site_map is None else entry.T_site_map @ pose,
        content=prepared.content,
        level=(entry.building, entry.floor),
        part_costs=parts,
    )
