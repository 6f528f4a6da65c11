"""The kernels that every scan goes through."""

from __future__ import annotations

from typing import Any
from unittest import mock

import counts
import limits
import numpy as np
from compiled import compiled
from kernel import Kernel
from numpy.typing import NDArray
from of_fields import LEAP_OPERATIONS, leap_roofs

from firstfix.core.scan import LaserScan
from firstfix.fields.map_fields import MapFields
from firstfix.fields.range_table import DIRECTIONS
from firstfix.fields.search_grid import TILE_COLUMNS, TILE_ROWS
from firstfix.global_localization import exhaustive, places, refine, search, verify
from firstfix.global_localization.beams import Beams, usable_beams
from firstfix.global_localization.config import LocateConfig

# As many places as `locate` refines on the field, and on rays.
SHORTLIST = LocateConfig().shortlist
ALL_POSES = LocateConfig().max_poses
ON_RAYS = 10


def kernels(fields: MapFields, scan: LaserScan) -> list[Kernel]:
    """All of firstfix.global_localization, on one scan; poses are those that the search finds."""
    beams = usable_beams(scan)
    found = search.search(beams, fields, SHORTLIST, ALL_POSES)[0].poses
    refined = refine.refine_on_field(found, beams, fields)
    scores = verify.verify(refined, beams, fields).scores
    best = refined[np.argsort(scores)[:ON_RAYS]]
    queries = search._queries(beams, fields)
    return [
        *_searched(fields, queries),
        _lowest(fields, beams.hits()),
        _descend_field(found, beams, fields),
        _descend_rays(best, beams, fields),
        _verify(refined, beams, fields),
        _suppress(fields, beams.hits()),
    ]


def _searched(fields: MapFields, queries: Any) -> list[Kernel]:
    positions, endpoints, table = fields.positions, fields.endpoints, fields.ranges
    bases = endpoints.base(positions.tile_rows, positions.tile_columns)
    n_ends, n_ranges = queries.offsets.shape[1], len(queries.directions)
    ends = np.empty((TILE_ROWS, DIRECTIONS, TILE_COLUMNS), np.uint16)
    gaps = np.zeros((DIRECTIONS, TILE_COLUMNS), np.uint16)
    narrow, wide = np.empty(DIRECTIONS, np.uint8), np.empty(DIRECTIONS, np.uint16)
    words = np.empty((search.SECTORS, TILE_COLUMNS), np.int32)
    weights = queries.endpoint_weight, queries.range_weight
    of_scan = (queries.directions, queries.counts, queries.through, queries.short)
    best = np.empty((len(positions), search.SECTORS), np.int32)
    tiles, rows = np.arange(len(bases)), len(bases) * TILE_ROWS
    touched = _touched(int(bases[0]), endpoints.columns, queries.offsets)
    # Tiles are worked through whole, also where few of their positions are free.
    per_pose = ends.size * len(bases) / (len(positions) * DIRECTIONS)
    of_endpoints = ((limits.runs(touched), 1.0),)
    return [
        Kernel(
            function=search._add_endpoints,
            parts=(),
            unit="beam at a pose",
            units=float(len(bases) * ends.size * n_ends),
            call=lambda: _all_tiles(
                endpoints.values, bases, endpoints.columns, queries.offsets, ends
            ),
            working_set=touched,
            moved=1 + 4 / 12,  # its byte; sums are read and written once for twelve
            operations=1,
            roofs={
                "memory": of_endpoints,
                "arithmetic": (
                    (limits.operations("u8"), 11 / 12),
                    (limits.operations("u16"), 1 / 12),
                ),
            },
        ),
        Kernel(
            function=search._add_ranges,
            parts=(),
            unit="beam at a pose",
            units=float(table.shape[0] * DIRECTIONS * n_ranges),
            call=lambda: _all_positions(table, *of_scan, narrow, wide),
            working_set=table.shape[1],
            moved=1,
            operations=7,
            roofs={
                "memory": (
                    (limits.read(table.shape[1]), 1),
                    (limits.read(table.nbytes), 2 / n_ranges),
                ),
                "arithmetic": ((limits.operations("u8"), 7),),
            },
        ),
        Kernel(
            function=search._choose_headings,
            parts=(),
            unit="pose",
            units=float(rows * gaps.size),
            call=lambda: _all_rows(rows, ends, gaps, *weights, words),
            working_set=2 * gaps.nbytes,
            moved=4,
            operations=8,
            roofs={
                "memory": ((limits.read(2 * gaps.nbytes), 4),),
                "arithmetic": ((limits.operations("i32"), 8),),
            },
        ),
        Kernel(
            function=search._score,
            parts=(),
            unit="pose",
            units=float(len(positions) * DIRECTIONS),
            call=lambda: search._score_tiles(tiles, fields, queries, best),
            working_set=touched + ends.nbytes,
            moved=n_ends * per_pose * 4 / 3 + n_ranges,
            operations=n_ends * per_pose + 7 * n_ranges + 8,
            roofs={
                "its parts": (
                    (limits.runs(touched), n_ends * per_pose),
                    (limits.operations("u8"), 7 * n_ranges),
                    (limits.operations("i32"), 8),
                )
            },
        ),
    ]


def _touched(base: int, pitch: int, offsets: NDArray[np.int64]) -> float:
    """Bytes of the end-point field that one tile reads, in whole lines of the cache."""
    starts = (base + offsets.ravel()[:, None] + np.arange(TILE_ROWS) * pitch).ravel()
    ends = starts + TILE_COLUMNS - 1
    return 64.0 * np.unique(np.concatenate([starts // 64, ends // 64])).size


def _lowest(fields: MapFields, hits: Beams) -> Kernel:
    grid = exhaustive.FAST
    cells = hits.ranges / fields.grid.resolution
    field = exhaustive.ExhaustiveSearch(fields, grid).layout(float(cells.max()))
    angles = hits.bearings + np.arange(grid.headings)[:, None] * (2 * np.pi / grid.headings)
    offsets = field.offsets(
        grid.stride / 2 + cells * np.sin(angles), grid.stride / 2 + cells * np.cos(angles)
    )
    free = exhaustive._has_free_cell(fields.grid.seen_free, grid.stride)
    rows, columns = (index.astype(np.int32) for index in np.nonzero(free))
    spans = exhaustive._spans(rows, columns)
    bases = field.base(spans[0], spans[1])
    best = np.empty((free.shape[0], field.columns + exhaustive._CHUNK), np.int64)
    chunks = -(-(spans[2] - spans[1]) // exhaustive._CHUNK)
    touched = float(offsets.size * exhaustive._CHUNK * chunks.mean() * field.values.itemsize)
    touched = min(touched, float(field.values.nbytes))
    return Kernel(
        function=exhaustive._lowest,
        parts=(),
        unit="beam at a pose",
        units=float(chunks.sum() * exhaustive._CHUNK * offsets.size),
        call=lambda: exhaustive._lowest(field.values, bases, spans, offsets, best),
        working_set=touched,
        moved=2 + 8 / 8,
        operations=1 + 1 / 8,
        roofs={
            "memory": ((limits.read(touched), 2),),
            "arithmetic": ((limits.operations("u16"), 7 / 8), (limits.operations("i32"), 2 / 8)),
        },
    )


def _descend_field(found: NDArray[np.float64], beams: Beams, fields: MapFields) -> Kernel:
    hits, resolution = beams.hits().thinned(refine.FIELD_BEAMS), fields.grid.resolution
    sigmas = np.geomspace(refine._FIRST_SIGMA_M, refine._LAST_SIGMA_M, refine._FIELD_ROUNDS)
    ends_x = hits.ranges / resolution * np.cos(hits.bearings)
    ends_y = hits.ranges / resolution * np.sin(hits.bearings)
    working_set = 4.0 * (2 * hits.ranges.max() / resolution) ** 2
    return Kernel(
        function=refine._descend_field,
        parts=(refine._solve,),
        unit="beam of a round",
        units=float(len(found) * len(sigmas) * len(hits)),
        call=lambda: refine._descend_field(
            found.copy(),
            ends_x,
            ends_y,
            fields.squares,
            fields.distances,
            sigmas / resolution,
            refine._STIFFNESS_BEAMS_M2 / resolution**2,
            (np.empty((3, 3)), np.empty((3, 3)), np.empty(3)),
        ),
        working_set=working_set,
        moved=2 * 8 + 4 * (2 + 4),
        operations=62,
        roofs={
            "looking up": ((limits.gather(working_set), 4), (limits.gather(2000), 4)),
            "arithmetic": ((limits.operations("f64"), 60), (limits.calls("division"), 2)),
        },
    )


def _descend_rays(best: NDArray[np.float64], beams: Beams, fields: MapFields) -> Kernel:
    hits, resolution = beams.hits().thinned(refine.RAY_BEAMS), fields.grid.resolution
    cosines, sines, ranges = np.cos(hits.bearings), np.sin(hits.bearings), hits.ranges / resolution
    starts = hits.starts / resolution
    beyond = refine._RAY_GATE_M / resolution + refine._BEYOND_GATE_CELLS
    information, variances = np.empty((len(best), 4, 4)), np.empty(len(best))

    descend: Any = refine._descend_rays

    def call(kernel: Any = descend) -> None:
        kernel(
            best.copy(),
            information,
            variances,
            starts,
            cosines,
            sines,
            ranges,
            fields.clearance,
            fields.squares,
            fields.distances,
            resolution,
            (np.empty(4), np.empty((4, 4)), np.empty(4)),
        )

    with mock.patch.object(refine, "_solve", wraps=refine._solve) as solved:
        call(descend.py_func)
    rounds = solved.call_count
    leaps = counts.at_poses(fields.clearance, best, hits.bearings, ranges + beyond) / (
        len(best) * len(hits)
    )
    mean_cells = float(ranges.mean())
    return Kernel(
        function=refine._descend_rays,
        parts=(),
        unit="beam of a round",
        units=float(rounds * len(hits)),
        call=call,
        working_set=(2.0 * mean_cells) ** 2,
        moved=40 + leaps + 24,
        operations=LEAP_OPERATIONS * leaps + 97,
        roofs=leap_roofs(
            mean_cells,
            leaps,
            (limits.calls("exp"), 1),
            (limits.calls("division"), 5),
            (limits.calls("sqrt"), 1),
            (limits.operations("f64"), 97),
        ),
    )


def _verify(refined: NDArray[np.float64], beams: Beams, fields: MapFields) -> Kernel:
    used, resolution = beams.thinned(verify.BEAMS), fields.grid.resolution
    reach = (used.ranges + np.where(used.hit, verify._SHORT_LIMIT_M, 0.0)) / resolution
    leaps = counts.at_poses(fields.clearance, refined, used.bearings, reach) / (
        len(refined) * len(used)
    )
    mean_cells = float(reach.mean())
    return Kernel(
        function=verify._verify,
        parts=(),
        unit="beam at a pose",
        units=float(len(refined) * len(used)),
        call=lambda: verify._compared(refined, used, fields),
        working_set=(2.0 * mean_cells) ** 2,
        moved=57 + leaps + 7,
        operations=LEAP_OPERATIONS * leaps + 34,
        roofs=leap_roofs(mean_cells, leaps, (limits.calls("exp"), 1), (limits.calls("log"), 1)),
    )


def _suppress(fields: MapFields, hits: Beams) -> Kernel:
    tried, scores = exhaustive.ExhaustiveSearch(fields, exhaustive.FAST).pose_scores(hits)
    order = np.argsort(scores, kind="stable")
    near = places.SAME_PLACE_M / fields.grid.resolution, places.SAME_PLACE_RAD
    most = SHORTLIST  # of the ten that the paper publishes, only the call would be seen
    seen, compared = counts.pairs(tried, order, *near, most)
    return Kernel(
        function=places._suppress,
        parts=(),
        unit="pair of poses",
        units=float(compared),
        call=lambda: places._suppress(tried, order, *near, np.empty(most, np.int64)),
        working_set=float(tried.nbytes),
        moved=32 * seen / compared,
        operations=11,
        roofs={
            "arithmetic": ((limits.operations("f64"), 11),),
            # The poses come in the order of their scores, from all over the map.
            "looking up": ((limits.gather(tried.nbytes), 3 * seen / compared),),
        },
    )


# The drivers below are not cached: a stale one would time a kernel of yesterday.


@compiled
def _all_tiles(
    counts: NDArray[np.uint8],
    bases: NDArray[np.int64],
    columns: int,
    offsets: NDArray[np.int64],
    ends: NDArray[np.uint16],
) -> None:
    for base in bases:
        search._add_endpoints(counts, base, columns, offsets, ends)


@compiled
def _all_positions(
    table: NDArray[np.uint8],
    directions: NDArray[np.int64],
    measured: NDArray[np.uint8],
    through: NDArray[np.uint8],
    short: NDArray[np.uint8],
    narrow: NDArray[np.uint8],
    wide: NDArray[np.uint16],
) -> None:
    for k in range(table.shape[0]):
        search._add_ranges(table[k], directions, measured, through, short, narrow, wide)


@compiled
def _all_rows(
    rows: int,
    ends: NDArray[np.uint16],
    gaps: NDArray[np.uint16],
    endpoint_weight: np.int32,
    range_weight: np.int32,
    words: NDArray[np.int32],
) -> None:
    for row in range(rows):
        search._choose_headings(ends[row % TILE_ROWS], gaps, endpoint_weight, range_weight, words)
