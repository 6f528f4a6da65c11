"""A first look at a large map: few blocks are worth a search, and they are found without one.

1. *Bounds*: all blocks of 0.4 m and all headings. A beam should end between the shortest and the
   longest range that the block can see in its direction.
2. *End points*: the best blocks, position by position and heading by heading, in the field that the
   search uses.
3. *Rays*: at the best of those, the ranges that the search reads from its table are cast.

The scores of the last step are those of the search (`global_localization.search`), so the places
are its places. No table of ranges is needed, which takes most of the memory and the preparation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.estimate import SearchReport
from firstfix.fields import endpoint_field, range_table
from firstfix.fields.look_table import BLOCKS, LOOK_DIRECTIONS
from firstfix.fields.map_fields import MapFields
from firstfix.fields.range_table import DIRECTIONS
from firstfix.global_localization import look_kernels
from firstfix.global_localization.beams import Beams, by_direction
from firstfix.global_localization.config import MAX_POSES
from firstfix.global_localization.search import (
    NO_RETURN_LIMIT,
    RANGE_BEAMS,
    SECTORS,
    SHORT_LIMIT,
    THROUGH_LIMIT,
    Candidates,
    endpoint_offsets,
    search,
)

BEAMS = 32
ENDPOINT_BEAMS = 24

BLOCKS_KEPT = 120_000
"""Blocks and eighths of a turn of all maps together whose end points are compared."""

PLACES_KEPT = 4_000
"""Those of them in which rays are cast."""

# A block that can see many ranges in a direction says little: cost of a beam, counts, for each
# factor of two (`LookTable.spreads`).
_SPREAD_WEIGHT = 0.25

# Of the bounds' cost against the distance of end points, where rays are cast.
_BOUNDS_WEIGHT = 0.5

# Entries between which the limit is drawn closer.
_PART = 4096


@dataclass(frozen=True, eq=False)
class LookedAt:
    """Scores of the bounds of one map.

    Parameters
    ----------
    scores : ndarray of uint16, shape (n, SECTORS)
        Of each entry of `MapFields.look` the best heading in each eighth of a turn; lower is
        better. Above the limit of `look_at` the largest score stands for any.
    beams : int
        Number of beams that were compared.
    """

    scores: NDArray[np.uint16]
    beams: int


@dataclass(frozen=True, eq=False)
class Promising:
    """Poses of one map in which rays may be cast, best first.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad) of the sensor in the grid.
    ends : ndarray, shape (n,)
        Mean truncated distance of an end point from a wall, m.
    ranks : ndarray, shape (n,)
        ``ends`` and the cost of the bounds together, m; ascending.
    """

    poses: NDArray[np.float64]
    ends: NDArray[np.float64]
    ranks: NDArray[np.float64]

    def up_to(self, rank: float) -> Promising:
        """Return only the poses up to a rank."""
        n = int(np.searchsorted(self.ranks, rank, side="right"))
        return Promising(self.poses[:n], self.ends[:n], self.ranks[:n])


@dataclass(frozen=True, eq=False)
class _LookBeams:
    """A scan as the bounds are compared with it."""

    directions: NDArray[np.int64]  # (n,)
    counts: NDArray[np.uint8]  # (n,) ranges, counts
    through: NDArray[np.uint8]  # (n,) largest cost of a beam that is too long
    short: NDArray[np.uint8]  # (n,) largest cost of a beam that is too short
    beams: int  # without those that fill up to a multiple of four


def find_places(
    beams: Beams, fields: MapFields, shortlist: int, max_poses: int
) -> tuple[Candidates, SearchReport]:
    """Find the best places of a map: by the search of all poses, or by looks at a large map.

    Parameters
    ----------
    beams : Beams
        At least one from the origin, in the sensor frame.
    fields : MapFields
        The prepared map.
    shortlist : int
        Number of places to keep.
    max_poses : int
        Most poses to score. A search of fewer than all makes no use of looks.

    Returns
    -------
    Candidates
        The best pose of each place, best first.
    SearchReport
        How much was searched. Looks cover everything, but prove no optimum.
    """
    if not fields.is_looked_at or max_poses < MAX_POSES:
        return search(beams, fields, shortlist, max_poses)
    poses = len(fields.positions) * DIRECTIONS
    report = SearchReport(poses, searched=1.0, proven=False)
    return look_into(beams, [fields], shortlist)[0], report


def look_into(beams: Beams, maps: Sequence[MapFields], shortlist: int) -> list[Candidates]:
    """Find the best places of several maps, as `search.search` does in one.

    Parameters
    ----------
    beams : Beams
        At least one from the origin, in the sensor frame.
    maps : sequence of MapFields
        The maps; at least one.
    shortlist : int
        Number of places to keep in each.

    Returns
    -------
    list of Candidates
        For each map the best pose of each place, best first; none where other maps are better.
    """
    looks, limit = look_at(beams, maps, BLOCKS_KEPT)
    found = [
        end_points(beams, fields, looked, limit) for fields, looked in zip(maps, looks, strict=True)
    ]
    rank = rank_of(found, PLACES_KEPT)
    return [
        cast_rays_at(of_map.up_to(rank), beams, fields, shortlist)
        for fields, of_map in zip(maps, found, strict=True)
    ]


def look_at(beams: Beams, maps: Sequence[MapFields], kept: int) -> tuple[list[LookedAt], int]:
    """Compare a scan with the bounds of all blocks of several maps.

    Most blocks are dropped after some of the beams: costs only grow, and ``kept`` blocks of the
    maps before are better already. The result is the same as without that.

    Parameters
    ----------
    beams : Beams
        At least one from the origin, in the sensor frame.
    maps : sequence of MapFields
        The maps; at least one.
    kept : int
        Number of blocks and eighths of a turn that go on, about.

    Returns
    -------
    looks : list of LookedAt
        Of each map.
    limit : int
        Worst score of the blocks that go on.
    """
    query = _look_beams(beams)
    histogram = np.zeros(look_kernels.LEVELS, np.int64)
    looks = []
    for fields in maps:
        table = fields.look
        scores = np.empty((len(table), SECTORS), np.uint16)
        weight = _SPREAD_WEIGHT * query.beams / 64.0
        penalties = np.rint(weight * table.spreads).astype(np.uint16)
        for part in range(0, len(table), _PART):
            here = slice(part, part + _PART)
            look_kernels.compare_bounds(
                table.bounds[here],
                query.directions,
                query.counts,
                query.through,
                query.short,
                penalties[here],
                limit_of(histogram, kept),
                scores[here],
                histogram,
            )
        looks.append(LookedAt(scores, query.beams))
    return looks, limit_of(histogram, kept)


def limit_of(histogram: NDArray[np.int64], kept: int) -> int:
    """Return the worst score of the best blocks, about ``kept`` in number."""
    total = np.cumsum(histogram)
    # At least one level, however many are equal.
    return max(int(np.argmax(total > 0)), int(np.searchsorted(total, kept, side="right")) - 1)


def end_points(beams: Beams, fields: MapFields, looked: LookedAt, limit: int) -> Promising:
    """Compare end points at all positions and headings of the blocks up to a score.

    Returns
    -------
    Promising
        The best pose of each block and eighth of a turn.
    """
    table, positions, endpoints = fields.look, fields.positions, fields.endpoints
    entries, sectors = np.nonzero(looked.scores <= limit)
    hits = beams.hits()
    ends = hits.take(np.flatnonzero(hits.ranges < range_table.REACH_M)).thinned(ENDPOINT_BEAMS)
    costs = np.empty(len(entries), np.int64)
    poses = np.empty((len(entries), 3), np.int64)
    look_kernels.compare_end_points(
        table.rows[entries].astype(np.int64) * BLOCKS,
        table.columns[entries].astype(np.int64) * BLOCKS,
        sectors,
        (endpoints.values, endpoints.columns, endpoints.margin, endpoint_offsets(ends, fields)),
        (fields.clearance, positions.stride),
        costs,
        poses,
    )
    share = len(hits) / len(beams) / max(1, len(ends))
    metres = costs.astype(np.float64) * (endpoint_field.UNIT_M * share)
    bounds = looked.scores[entries, sectors] * (range_table.UNIT_M / looked.beams)
    ranks = metres + _BOUNDS_WEIGHT * bounds
    order = np.argsort(ranks, kind="stable")
    order = order[costs[order] < look_kernels.NOWHERE]
    where = poses[order].astype(np.float64) * [positions.stride, positions.stride, 1.0]
    where[:, :2] += positions.offset
    where[:, 2] *= FULL_TURN / DIRECTIONS
    return Promising(where, metres[order], ranks[order])


def rank_of(found: Sequence[Promising], kept: int) -> float:
    """Return the worst rank of the best poses of several maps, ``kept`` in number."""
    ranks = np.concatenate([of_map.ranks for of_map in found])
    if len(ranks) <= kept:
        return float("inf")
    return float(np.partition(ranks, kept - 1)[kept - 1])


def cast_rays_at(found: Promising, beams: Beams, fields: MapFields, shortlist: int) -> Candidates:
    """Add the second score of the search at some poses, and keep the best of all."""
    _, seen = by_direction(beams.from_origin())
    seen = seen.thinned(RANGE_BEAMS)
    cells_per_count = range_table.UNIT_M / fields.grid.resolution
    gaps = np.empty(len(found.poses))
    look_kernels.mean_gaps(
        fields.clearance,
        found.poses,
        seen.bearings,
        np.minimum(seen.ranges, range_table.REACH_M) / fields.grid.resolution,
        np.where(seen.hit, THROUGH_LIMIT, NO_RETURN_LIMIT) * cells_per_count,
        np.where(seen.hit, SHORT_LIMIT, 0) * cells_per_count,
        gaps,
    )
    scores = found.ends + gaps * fields.grid.resolution
    order = np.argsort(scores, kind="stable")[:shortlist]
    return Candidates(found.poses[order], scores[order])


def _look_beams(beams: Beams) -> _LookBeams:
    """Choose the beams nearest to the directions of the look."""
    own = beams.from_origin()
    exact = own.bearings / FULL_TURN * LOOK_DIRECTIONS
    direction = np.rint(exact).astype(np.int64)
    order = np.lexsort((np.abs(exact - direction), direction % LOOK_DIRECTIONS))
    directions, first = np.unique(direction[order] % LOOK_DIRECTIONS, return_index=True)
    keep = np.linspace(0, len(directions) - 1, min(BEAMS, len(directions))).round().astype(np.int64)
    # Long beams first: few blocks can see that far, and most are dropped after some beams.
    keep = keep[np.argsort(-own.ranges[order[first[keep]]], kind="stable")]
    seen, seen_in = own.take(order[first[keep]]), directions[keep]
    padding = -len(keep) % 4  # the kernel takes four at a time; padding costs nothing
    counts = np.minimum(np.rint(seen.ranges / range_table.UNIT_M), range_table.FARTHEST)
    return _LookBeams(
        directions=np.pad(seen_in, (0, padding)),
        counts=np.pad(counts.astype(np.uint8), (0, padding)),
        through=np.pad(np.where(seen.hit, THROUGH_LIMIT, NO_RETURN_LIMIT), (0, padding)),
        short=np.pad(np.where(seen.hit, SHORT_LIMIT, np.uint8(0)), (0, padding)),
        beams=len(keep),
    )
