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
from firstfix.fields.kernel_cache import kernel
from firstfix.fields.look_table import BLOCKS, LOOK_DIRECTIONS
from firstfix.fields.map_fields import MapFields
from firstfix.fields.range_table import DIRECTIONS
from firstfix.fields.raycast import cast_ray_leaping
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

# Scores of the bounds are below this.
_LEVELS = 1024

# Beams, of at most 10 each, after which it is seen whether an entry can still be good.
_TOGETHER = 16

# Entries between which the limit is drawn closer.
_PART = 4096

_HEADINGS = DIRECTIONS // SECTORS  # of a sector
_LOOK_HEADINGS = LOOK_DIRECTIONS // SECTORS


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
    histogram = np.zeros(_LEVELS, np.int64)
    looks = []
    for fields in maps:
        table = fields.look
        scores = np.empty((len(table), SECTORS), np.uint16)
        weight = _SPREAD_WEIGHT * query.beams / 64.0
        penalties = np.rint(weight * table.spreads).astype(np.uint16)
        for part in range(0, len(table), _PART):
            here = slice(part, part + _PART)
            _look(
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
    _end_points(
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
    order = order[costs[order] < _NOWHERE]
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
    _gaps(
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


_NOWHERE = 1 << 40


@kernel
def _look(  # noqa: PLR0913 - a kernel takes its arrays one by one
    bounds: NDArray[np.uint8],
    directions: NDArray[np.int64],
    counts: NDArray[np.uint8],
    through: NDArray[np.uint8],
    short: NDArray[np.uint8],
    penalties: NDArray[np.uint16],
    limit: int,
    scores: NDArray[np.uint16],
    histogram: NDArray[np.int64],
) -> None:
    """Compare all headings of every entry: sums of bytes, as `search._add_ranges`.

    An entry that is above the limit at every heading is dropped.
    """
    # Written twice, so that every heading is one slice.
    low, high = np.empty(2 * LOOK_DIRECTIONS, np.uint8), np.empty(2 * LOOK_DIRECTIONS, np.uint8)
    narrow, wide = np.empty(LOOK_DIRECTIONS, np.uint8), np.empty(LOOK_DIRECTIONS, np.uint16)
    n = directions.shape[0]
    for k in range(bounds.shape[0]):
        least = penalties[k]
        nearest, farthest = bounds[k, 0], bounds[k, 1]
        for h in range(LOOK_DIRECTIONS):
            low[h] = nearest[h]
            low[h + LOOK_DIRECTIONS] = nearest[h]
            high[h] = farthest[h]
            high[h + LOOK_DIRECTIONS] = farthest[h]
            wide[h] = 0
        j = 0
        while j < n and least <= limit:
            for h in range(LOOK_DIRECTIONS):
                narrow[h] = 0
            end = min(n, j + _TOGETHER)
            while j < end:
                a, b = low[directions[j] :], low[directions[j + 1] :]
                c, d = low[directions[j + 2] :], low[directions[j + 3] :]
                e, f = high[directions[j] :], high[directions[j + 1] :]
                g, i = high[directions[j + 2] :], high[directions[j + 3] :]
                za, zb, zc, zd = counts[j], counts[j + 1], counts[j + 2], counts[j + 3]
                ta, tb, tc, td = through[j], through[j + 1], through[j + 2], through[j + 3]
                sa, sb, sc, sd = short[j], short[j + 1], short[j + 2], short[j + 3]
                for h in range(LOOK_DIRECTIONS):
                    p = np.uint8(
                        min(np.uint8(max(za, e[h]) - e[h]), ta)
                        + min(np.uint8(max(za, a[h]) - za), sa)
                    )
                    q = np.uint8(
                        min(np.uint8(max(zb, f[h]) - f[h]), tb)
                        + min(np.uint8(max(zb, b[h]) - zb), sb)
                    )
                    r = np.uint8(
                        min(np.uint8(max(zc, g[h]) - g[h]), tc)
                        + min(np.uint8(max(zc, c[h]) - zc), sc)
                    )
                    s = np.uint8(
                        min(np.uint8(max(zd, i[h]) - i[h]), td)
                        + min(np.uint8(max(zd, d[h]) - zd), sd)
                    )
                    narrow[h] += np.uint8(np.uint8(p + q) + np.uint8(r + s))
                j += 4
            for h in range(LOOK_DIRECTIONS):
                wide[h] += np.uint16(narrow[h])
            lowest = np.uint16(65535)
            for h in range(LOOK_DIRECTIONS):
                lowest = min(lowest, wide[h])
            least = np.uint16(lowest + penalties[k])
        if least > limit:
            scores[k] = _LEVELS - 1
            histogram[_LEVELS - 1] += SECTORS
            continue
        for sector in range(SECTORS):
            best = np.uint16(65535)
            for h in range(_LOOK_HEADINGS):
                best = min(best, wide[sector * _LOOK_HEADINGS + h])
            best = np.uint16(min(_LEVELS - 1, best + penalties[k]))
            scores[k, sector] = best
            histogram[best] += 1


@kernel
def _end_points(
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    sectors: NDArray[np.int64],
    field: tuple[NDArray[np.uint8], int, int, NDArray[np.int64]],
    space: tuple[NDArray[np.uint8], int],
    costs: NDArray[np.int64],
    poses: NDArray[np.int64],
) -> None:
    """Find the lowest sum of distances in each block and sector; poses are column, row, heading."""
    values, pitch, margin, offsets = field
    clearance, stride = space
    n = offsets.shape[1]
    for k in range(rows.shape[0]):
        costs[k] = _NOWHERE
        for place in range(BLOCKS * BLOCKS):
            row, column = rows[k] + place // BLOCKS, columns[k] + place % BLOCKS
            y, x = row * stride + stride // 2, column * stride + stride // 2
            if y >= clearance.shape[0] or x >= clearance.shape[1] or clearance[y, x] == 0:
                continue
            base = (row + margin) * pitch + column + margin
            for i in range(_HEADINGS + 1):
                # A heading of the look covers those of the search to both its sides.
                h = (sectors[k] * _HEADINGS + i - 1) % DIRECTIONS
                total = 0
                for j in range(n):
                    total += values[base + offsets[h, j]]
                if total < costs[k]:
                    costs[k] = total
                    poses[k, 0], poses[k, 1], poses[k, 2] = column, row, h


@kernel
def _gaps(
    clearance: NDArray[np.uint8],
    poses: NDArray[np.float64],
    bearings: NDArray[np.float64],
    ranges: NDArray[np.float64],
    through: NDArray[np.float64],
    short: NDArray[np.float64],
    gaps: NDArray[np.float64],
) -> None:
    """Mean difference to the range that the map predicts, with limits to both sides, cells."""
    for k in range(poses.shape[0]):
        total = 0.0
        for i in range(ranges.shape[0]):
            angle = poses[k, 2] + bearings[i]
            dx, dy = np.cos(angle), np.sin(angle)
            reach = ranges[i] + short[i]
            seen = cast_ray_leaping(clearance, poses[k, 0], poses[k, 1], dx, dy, reach)
            gap = ranges[i] - seen
            total += min(gap, through[i]) if gap > 0.0 else min(-gap, short[i])
        gaps[k] = total / ranges.shape[0]
