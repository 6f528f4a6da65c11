"""The kernels of the first look at large maps."""

from __future__ import annotations

import counts
import limits
import numpy as np
from kernel import Kernel
from numpy.typing import NDArray
from of_fields import LEAP_OPERATIONS, STEP_BYTES, STEP_OPERATIONS, leap_roofs, step_roofs

from firstfix.core.scan import LaserScan
from firstfix.fields import look_table, range_table
from firstfix.fields.map_fields import MapFields
from firstfix.fields.sweep import free_cells, lines
from firstfix.global_localization import look, look_kernels
from firstfix.global_localization.beams import Beams, by_direction, usable_beams
from firstfix.global_localization.search import (
    RANGE_BEAMS,
    SECTORS,
    SHORT_LIMIT,
    THROUGH_LIMIT,
    endpoint_offsets,
)


def kernels(fields: MapFields, scan: LaserScan) -> list[Kernel]:
    """All of the first look, though this map may be small enough for a search of all poses."""
    beams = usable_beams(scan)
    return [
        *_looks(fields),
        _bounds(fields, beams),
        _end_points(fields, beams),
        _gaps(fields, beams),
    ]


def _looks(fields: MapFields) -> list[Kernel]:
    """Make the table of the look; sweep in one direction that crosses rows."""
    grid, stride = fields.grid, fields.look.stride
    standing = grid.seen_free & (fields.clearance > round(look_table._KEPT_M / grid.resolution))
    least = look_table._LEAST_SHARE * stride**2
    rows, _, samples = look_table._label(standing, stride, least)
    starts, _, places = look_table._bands(rows, samples, stride, upright=True)
    (height, width), entries = standing.shape, len(rows)
    line = lines(look_table._BETWEEN * look_table.LOOK_DIRECTIONS, height, upright=True)[9]
    free, share = free_cells(grid.occupied, upright=True), float(standing.mean())
    per_cell = entries / standing.size
    of_entries = (limits.gather(2.0 * stride * width), look_table._SAMPLES**2 * per_cell)
    return [
        Kernel(
            function=look_table._label,
            parts=(look_table._flood, look_table._choose_samples),
            unit="cell",
            units=float(standing.size),
            call=lambda: look_table._label(standing, stride, least),
            working_set=2.0 * stride * width,
            moved=2 * (3 + 16 * share),  # twice: seen, cleared and standing; two lists of cells
            operations=2 * 4 * 8 * share,
            roofs={
                "memory": ((limits.copy(2.0 * stride * width), 2 * (3 + 16 * share)),),
                "looking up": ((limits.gather(stride * width), 2 * 2 * 4 * share),),
            },
        ),
        Kernel(
            function=look_table._sweep,
            parts=(look_table._find_bounds,),
            unit="cell",
            units=float(standing.size),
            call=lambda: look_table._swept(free, starts, places, grid.resolution, stride, line),
            working_set=2.0 * stride * width,
            moved=STEP_BYTES + per_cell * (10 * look_table._SAMPLES**2 + 2),
            operations=STEP_OPERATIONS + per_cell * 2 * look_table._SAMPLES**2,
            roofs={what: (*roof, of_entries) for what, roof in step_roofs(width).items()},
        ),
    ]


def _bounds(fields: MapFields, beams: Beams) -> Kernel:
    """Bounds of all entries, none of which is dropped before the last beam."""
    table, query = fields.look, look._look_beams(beams)
    penalties = np.zeros(len(table), np.uint16)
    scores = np.empty((len(table), SECTORS), np.uint16)
    histogram = np.zeros(look_kernels.LEVELS, np.int64)
    of_scan = query.directions, query.counts, query.through, query.short
    others = penalties, look_kernels.LEVELS, scores, histogram
    n = len(query.directions)
    return Kernel(
        function=look_kernels.compare_bounds,
        parts=(),
        unit="beam at a heading",
        units=float(len(table) * look_table.LOOK_DIRECTIONS * n),
        call=lambda: look_kernels.compare_bounds(table.bounds, *of_scan, *others),
        working_set=8.0 * look_table.LOOK_DIRECTIONS,
        moved=2 + 8 / n,
        operations=8,
        roofs={
            "memory": ((limits.read(table.bounds.nbytes), 2 / n), (limits.read(4096), 2)),
            "arithmetic": ((limits.operations("u8"), 8),),
        },
    )


def _end_points(fields: MapFields, beams: Beams) -> Kernel:
    """End points in one block of three, in one eighth of a turn."""
    table, positions, field = fields.look, fields.positions, fields.endpoints
    hits = beams.hits()
    ends = hits.take(np.flatnonzero(hits.ranges < range_table.REACH_M)).thinned(look.ENDPOINT_BEAMS)
    offsets = endpoint_offsets(ends, fields)
    rows = table.rows[::3].astype(np.int64) * look_table.BLOCKS
    columns = table.columns[::3].astype(np.int64) * look_table.BLOCKS
    sectors = np.arange(len(rows)) % SECTORS
    costs, poses = np.empty(len(rows), np.int64), np.empty((len(rows), 3), np.int64)
    at = field.values, field.columns, field.margin, offsets
    space = fields.clearance, positions.stride
    free = _free_positions(fields.clearance, positions.stride, rows, columns)
    headings = look_kernels._HEADINGS + 1
    return Kernel(
        function=look_kernels.compare_end_points,
        parts=(),
        unit="beam at a pose",
        units=float(free * headings * len(ends)),
        call=lambda: look_kernels.compare_end_points(
            rows, columns, sectors, at, space, costs, poses
        ),
        working_set=float(field.values.nbytes),
        moved=1 + 8,
        operations=2,
        roofs={
            # Neighbouring blocks find the same lines of the cache.
            "looking up": ((limits.gather(256 * 1024), 1),),
            "memory": ((limits.read(offsets.nbytes / SECTORS), 8),),
        },
    )


def _free_positions(
    clearance: NDArray[np.uint8], stride: int, rows: NDArray[np.int64], columns: NDArray[np.int64]
) -> int:
    total = 0
    for place in range(look_table.BLOCKS**2):
        y = (rows + place // look_table.BLOCKS) * stride + stride // 2
        x = (columns + place % look_table.BLOCKS) * stride + stride // 2
        inside = (y < clearance.shape[0]) & (x < clearance.shape[1])
        total += int(np.count_nonzero(clearance[y[inside], x[inside]]))
    return total


def _gaps(fields: MapFields, beams: Beams) -> Kernel:
    """Ranges at the places that are left, as many as in a large map."""
    query, limit = look.look_at(beams, [fields], look.BLOCKS_KEPT)
    found = look.end_points(beams, fields, query[0], limit).poses[: look.PLACES_KEPT]
    seen = by_direction(beams.from_origin())[1].thinned(RANGE_BEAMS)
    cells_per_count = range_table.UNIT_M / fields.grid.resolution
    ranges = np.minimum(seen.ranges, range_table.REACH_M) / fields.grid.resolution
    through = np.full(len(seen), THROUGH_LIMIT * cells_per_count)
    short = np.full(len(seen), SHORT_LIMIT * cells_per_count)
    gaps = np.empty(len(found))
    leaps = counts.at_poses(fields.clearance, found, seen.bearings, ranges + short)
    leaps /= len(found) * len(seen)
    mean_cells = float(ranges.mean())
    return Kernel(
        function=look_kernels.mean_gaps,
        parts=(),
        unit="beam at a pose",
        units=float(len(found) * len(seen)),
        call=lambda: look_kernels.mean_gaps(
            fields.clearance, found, seen.bearings, ranges, through, short, gaps
        ),
        working_set=(2.0 * mean_cells) ** 2,
        moved=32 + leaps,
        operations=LEAP_OPERATIONS * leaps + 6,
        roofs=leap_roofs(mean_cells, leaps, (limits.calls("sin + cos"), 1)),
    )
