"""Exhaustive search of the whole map: every position, every heading.

Two scores are added for each pose, because each has a weakness that the other has not:

- *end points*: how far the beams end from the nearest wall (the paper's score, truncated). Ignores
  walls that a beam passes through.
- *ranges*: how the beams compare with the ranges that the map predicts. Accounts for walls, but
  changes abruptly where a few centimetres decide what is visible.

Both are sums of contiguous bytes (see `fields.phased_field`, `fields.range_table`), so the search
takes milliseconds. It scores every pose of the grid, so the optimum over the grid is proven.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.estimate import SearchReport
from firstfix.fields import endpoint_field, range_table
from firstfix.fields.kernel_cache import kernel, part
from firstfix.fields.map_fields import MapFields
from firstfix.fields.range_table import DIRECTIONS
from firstfix.fields.search_grid import TILE_COLUMNS, TILE_ROWS
from firstfix.global_localization.beams import Beams, by_direction

ENDPOINT_BEAMS = 36
RANGE_BEAMS = 40

# Sensing through a wall is nearly impossible; a beam cut short by a person is common; a beam that
# did not return may have met glass or black paint. Counts of range_table.UNIT_M: 1 m, 0.4 m, 0.5 m.
THROUGH_LIMIT = np.uint8(10)
SHORT_LIMIT = np.uint8(4)
NO_RETURN_LIMIT = np.uint8(5)

# The best heading is kept for each eighth of a turn: a place that fits in two directions is two
# candidates.
SECTORS = 8

# Two by two positions and one sector are one place of the shortlist.
_BIN = 2

# Scores are integers of this many metres, so that a score and its heading fit one 32-bit word and
# the smaller word is the better pose. A score is at most 1.5 m: 24 bits.
_SCORE_UNIT = 2.0**-23
_HEADING_BITS = 7
_UNSEEN = np.int32(2**31 - 1)


@dataclass(frozen=True, eq=False)
class Candidates:
    """Poses of the sensor worth refining, best first.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y in cells of the grid, heading against its x axis, rad.
    scores : ndarray, shape (n,)
        Search score, m: mean truncated distance of a beam; lower is better.
    """

    poses: NDArray[np.float64]
    scores: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Queries:
    """A scan as the kernels read it."""

    offsets: NDArray[np.int64]  # (DIRECTIONS, n_endpoints) into MapFields.endpoints
    directions: NDArray[np.int64]  # (n_ranges,)
    counts: NDArray[np.uint8]  # (n_ranges,) ranges, counts
    through: NDArray[np.uint8]  # (n_ranges,) largest cost of a beam through a wall
    short: NDArray[np.uint8]  # (n_ranges,) largest cost of a short beam
    endpoint_weight: np.int32  # _SCORE_UNITs per count
    range_weight: np.int32


def search(
    beams: Beams, fields: MapFields, shortlist: int, max_poses: int
) -> tuple[Candidates, SearchReport]:
    """Score all poses of the search grid and keep the best places.

    Parameters
    ----------
    beams : Beams
        At least one from the origin, in the sensor frame. Of beams with other origins only the end
        points count here.
    fields : MapFields
        The prepared map.
    shortlist : int
        Number of places to keep.
    max_poses : int
        Most poses to score; at least one tile is always searched.

    Returns
    -------
    Candidates
        The best pose of each place (2 x 2 positions, one eighth of a turn), best first.
    SearchReport
        How much was searched; the optimum is proven if all was.
    """
    positions = fields.positions
    best = np.full((len(positions), SECTORS), _UNSEEN, np.int32)
    queries = _queries(beams, fields)
    order = _spread(len(positions.tile_rows))
    sizes = np.diff(positions.tile_starts)[order]
    tiles = max(1, int(np.count_nonzero(np.cumsum(sizes) * DIRECTIONS <= max_poses)))
    _score_tiles(order[:tiles], fields, queries, best)
    seen = int(sizes[:tiles].sum())
    report = SearchReport(
        poses=len(positions) * DIRECTIONS,
        searched=seen / max(1, len(positions)),
        proven=seen == len(positions),
    )
    return _best_places(best, fields, shortlist), report


def _queries(beams: Beams, fields: MapFields) -> _Queries:
    hits = beams.hits()
    reached = hits.ranges < range_table.REACH_M
    ends = hits.take(np.flatnonzero(reached)).thinned(ENDPOINT_BEAMS)
    # The table has the ranges from a position; those of a sensor beside it are others.
    directions, seen = by_direction(beams.from_origin())
    keep = np.linspace(0, len(seen) - 1, min(RANGE_BEAMS, len(seen))).round().astype(np.int64)
    # The kernel takes four beams at a time; padding costs nothing.
    padding = -len(keep) % 4
    hit = seen.hit[keep]
    counts = np.minimum(np.rint(seen.ranges[keep] / range_table.UNIT_M), range_table.FARTHEST)
    return _Queries(
        offsets=endpoint_offsets(ends, fields),
        directions=np.pad(directions[keep], (0, padding)),
        counts=np.pad(counts.astype(np.uint8), (0, padding)),
        through=np.pad(np.where(hit, THROUGH_LIMIT, NO_RETURN_LIMIT), (0, padding)),
        short=np.pad(np.where(hit, SHORT_LIMIT, np.uint8(0)), (0, padding)),
        # Beams without a return have no end point: the mean is over all beams, not over the hits.
        endpoint_weight=_weight(endpoint_field.UNIT_M * len(hits) / len(beams) / max(1, len(ends))),
        range_weight=_weight(range_table.UNIT_M / len(keep)),
    )


def endpoint_offsets(ends: Beams, fields: MapFields) -> NDArray[np.int64]:
    """Return where beams end in `MapFields.endpoints`, relative to the block of a position.

    Parameters
    ----------
    ends : Beams
        Shorter than `range_table.REACH_M`.
    fields : MapFields
        The prepared map.

    Returns
    -------
    ndarray of int64, shape (DIRECTIONS, len(ends))
        Offsets for every heading.
    """
    headings = np.arange(DIRECTIONS)[:, None] * (FULL_TURN / DIRECTIONS)
    cells = ends.ranges / fields.grid.resolution
    start_x, start_y = ends.starts.T / fields.grid.resolution
    cos, sin = np.cos(headings), np.sin(headings)
    angles = ends.bearings + headings
    offset = fields.positions.offset
    return fields.endpoints.offsets(
        offset + (sin * start_x + cos * start_y) + cells * np.sin(angles),
        offset + (cos * start_x - sin * start_y) + cells * np.cos(angles),
    )


def _weight(metres_per_count: float) -> np.int32:
    return np.int32(round(metres_per_count / _SCORE_UNIT))


def _spread(n: int) -> NDArray[np.int64]:
    """Order tiles so that a search cut short has scored some in every part of the map."""
    return np.concatenate([np.arange(start, n, 16) for start in range(16)])


def _score_tiles(
    tiles: NDArray[np.int64],
    fields: MapFields,
    queries: _Queries,
    best: NDArray[np.int32],
) -> None:
    positions, endpoints = fields.positions, fields.endpoints
    _score(
        tiles,
        positions.tile_starts,
        endpoints.base(positions.tile_rows, positions.tile_columns),
        *positions.in_tile,
        (endpoints.values, endpoints.columns, queries.offsets),
        (fields.ranges, queries.directions, queries.counts, queries.through, queries.short),
        (queries.endpoint_weight, queries.range_weight),
        (
            np.empty((TILE_ROWS, DIRECTIONS, TILE_COLUMNS), np.uint16),
            np.zeros((DIRECTIONS, TILE_COLUMNS), np.uint16),
            np.empty(DIRECTIONS, np.uint8),
            np.empty(DIRECTIONS, np.uint16),
            np.empty((SECTORS, TILE_COLUMNS), np.int32),
        ),
        best,
    )


def _best_places(best: NDArray[np.int32], fields: MapFields, shortlist: int) -> Candidates:
    flat = best.ravel()
    # A place has at most _BIN² entries here: this many of the lowest contain all places requested.
    lowest = min(shortlist * _BIN**2, int(np.count_nonzero(flat != _UNSEEN)))
    if lowest == 0:
        return Candidates(np.empty((0, 3)), np.empty(0))
    limit = np.partition(flat, lowest - 1)[lowest - 1]
    index = np.flatnonzero(flat <= limit)
    index = index[np.argsort(flat[index], kind="stable")]
    position, sector = index // SECTORS, index % SECTORS
    rows = fields.positions.rows[position].astype(np.int64) // _BIN
    columns = fields.positions.columns[position].astype(np.int64) // _BIN
    place = (rows << 32) + (columns << 8) + sector
    _, first = np.unique(place, return_index=True)
    keep = np.sort(first)[:shortlist]
    x, y = fields.positions.centres(position[keep])
    word = flat[index[keep]]
    turn = (word % DIRECTIONS) * (FULL_TURN / DIRECTIONS)
    scores = (word >> _HEADING_BITS).astype(np.float64) * _SCORE_UNIT
    return Candidates(np.column_stack([x, y, turn]), scores)


# The kernels below are written for LLVM's vectoriser: inner loops over 32 or 128 bytes of fixed
# length, sums that stay in uint8 as long as they cannot overflow (12 end points of at most 10, 24
# ranges of at most 10), slices taken outside the loops. `benchmarks/kernels` times them.


@kernel
def _score(  # noqa: PLR0913 - a kernel takes its arrays one by one
    tiles: NDArray[np.int64],
    tile_starts: NDArray[np.int64],
    tile_bases: NDArray[np.int64],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    endpoints: tuple[NDArray[np.uint8], int, NDArray[np.int64]],
    ranges: tuple[
        NDArray[np.uint8],
        NDArray[np.int64],
        NDArray[np.uint8],
        NDArray[np.uint8],
        NDArray[np.uint8],
    ],
    weights: tuple[np.int32, np.int32],
    scratch: tuple[
        NDArray[np.uint16],
        NDArray[np.uint16],
        NDArray[np.uint8],
        NDArray[np.uint16],
        NDArray[np.int32],
    ],
    best: NDArray[np.int32],
) -> None:
    counts, pitch, offsets = endpoints
    table, directions, measured, through, short = ranges
    ends, gaps, narrow, wide, words = scratch
    for t in range(tiles.shape[0]):
        tile = tiles[t]
        _add_endpoints(counts, tile_bases[tile], pitch, offsets, ends)
        k = tile_starts[tile]
        while k < tile_starts[tile + 1]:
            row, first = rows[k], k
            while k < tile_starts[tile + 1] and rows[k] == row:
                _add_ranges(table[k], directions, measured, through, short, narrow, wide)
                for h in range(DIRECTIONS):
                    gaps[h, columns[k]] = wide[h]
                k += 1
            _choose_headings(ends[row], gaps, weights[0], weights[1], words)
            for j in range(first, k):
                for sector in range(SECTORS):
                    best[j, sector] = words[sector, columns[j]]


@kernel
def _choose_headings(
    ends: NDArray[np.uint16],
    gaps: NDArray[np.uint16],
    endpoint_weight: np.int32,
    range_weight: np.int32,
    words: NDArray[np.int32],
) -> None:
    """Best score of a row of positions in every sector, its heading in the lowest bits."""
    for sector in range(SECTORS):
        word = words[sector]
        for c in range(TILE_COLUMNS):
            word[c] = _UNSEEN
        for i in range(DIRECTIONS // SECTORS):
            h = sector * (DIRECTIONS // SECTORS) + i
            end, gap = ends[h], gaps[h]
            for c in range(TILE_COLUMNS):
                score = np.int32(
                    np.int32(np.int32(end[c]) * endpoint_weight)
                    + np.int32(np.int32(gap[c]) * range_weight)
                )
                word[c] = min(word[c], np.int32(np.int32(score << _HEADING_BITS) | np.int32(h)))


@kernel
def _add_endpoints(
    counts: NDArray[np.uint8],
    base: int,
    columns: int,
    offsets: NDArray[np.int64],
    ends: NDArray[np.uint16],
) -> None:
    n = offsets.shape[1]
    # Unsigned indices cannot count from the end of an array, so that LLVM can vectorise the loop.
    pitch = np.uint64(columns)
    for h in range(DIRECTIONS):
        for r in range(TILE_ROWS):
            row = ends[r, h]
            for x in range(TILE_COLUMNS):
                row[x] = 0
        i = 0
        while i + 12 <= n:
            a = counts[base + offsets[h, i] :]
            b = counts[base + offsets[h, i + 1] :]
            c = counts[base + offsets[h, i + 2] :]
            d = counts[base + offsets[h, i + 3] :]
            e = counts[base + offsets[h, i + 4] :]
            f = counts[base + offsets[h, i + 5] :]
            g = counts[base + offsets[h, i + 6] :]
            j = counts[base + offsets[h, i + 7] :]
            k = counts[base + offsets[h, i + 8] :]
            l = counts[base + offsets[h, i + 9] :]  # noqa: E741
            m = counts[base + offsets[h, i + 10] :]
            o = counts[base + offsets[h, i + 11] :]
            for r in range(np.uint64(TILE_ROWS)):
                p = r * pitch
                row = ends[r, h]
                for x in range(np.uint64(TILE_COLUMNS)):
                    q = p + x
                    s = np.uint8(np.uint8(a[q] + b[q]) + np.uint8(c[q] + d[q]))
                    t = np.uint8(np.uint8(e[q] + f[q]) + np.uint8(g[q] + j[q]))
                    u = np.uint8(np.uint8(k[q] + l[q]) + np.uint8(m[q] + o[q]))
                    row[x] += np.uint16(np.uint8(np.uint8(s + t) + u))
            i += 12
        while i < n:
            a = counts[base + offsets[h, i] :]
            for r in range(np.uint64(TILE_ROWS)):
                row = ends[r, h]
                for x in range(np.uint64(TILE_COLUMNS)):
                    row[x] += np.uint16(a[r * pitch + x])
            i += 1


@part
def _mismatch(
    measured: np.uint8, expected: np.uint8, through: np.uint8, short: np.uint8
) -> np.uint8:
    far = max(measured, expected)
    return np.uint8(min(np.uint8(far - expected), through) + min(np.uint8(far - measured), short))


@kernel
def _add_ranges(
    expected: NDArray[np.uint8],
    directions: NDArray[np.int64],
    measured: NDArray[np.uint8],
    through: NDArray[np.uint8],
    short: NDArray[np.uint8],
    narrow: NDArray[np.uint8],
    wide: NDArray[np.uint16],
) -> None:
    n = directions.shape[0]
    for h in range(DIRECTIONS):
        wide[h] = 0
    j = 0
    while j < n:
        for h in range(DIRECTIONS):
            narrow[h] = 0
        end = min(n, j + 24)
        while j < end:
            a, b = expected[directions[j] :], expected[directions[j + 1] :]
            c, d = expected[directions[j + 2] :], expected[directions[j + 3] :]
            za, zb, zc, zd = measured[j], measured[j + 1], measured[j + 2], measured[j + 3]
            ta, tb, tc, td = through[j], through[j + 1], through[j + 2], through[j + 3]
            sa, sb, sc, sd = short[j], short[j + 1], short[j + 2], short[j + 3]
            for h in range(DIRECTIONS):
                s = np.uint8(_mismatch(za, a[h], ta, sa) + _mismatch(zb, b[h], tb, sb))
                t = np.uint8(_mismatch(zc, c[h], tc, sc) + _mismatch(zd, d[h], td, sd))
                narrow[h] += np.uint8(s + t)
            j += 4
        for h in range(DIRECTIONS):
            wide[h] += np.uint16(narrow[h])
