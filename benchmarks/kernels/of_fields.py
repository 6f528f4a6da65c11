"""The kernels that prepare a map."""

from __future__ import annotations

import math
from typing import Any

import counts
import limits
import numpy as np
from kernel import Kernel
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid
from firstfix.fields import (
    clearance,
    distance_kernels,
    endpoint_field,
    range_table,
    raycast,
    sweep,
)
from firstfix.fields.distance import truncated_squares
from firstfix.fields.map_fields import MapFields
from firstfix.fields.sweep import Line, lines


def kernels(fields: MapFields, rng: np.random.Generator) -> list[Kernel]:
    """All of firstfix.fields, on a prepared map."""
    return [
        *_distances(fields.grid, fields.near),
        _clearance(fields.grid),
        _pooled(fields),
        _walked(fields.grid, rng),
        *_table(fields),
    ]


def _distances(grid: OccupancyGrid, near: int) -> list[Kernel]:
    occupied, cells = np.ascontiguousarray(grid.occupied), float(grid.occupied.size)
    manhattan = np.empty(occupied.shape, np.uint16)
    euclidean = np.empty(occupied.shape, np.float32)
    column = euclidean.view(np.int32)
    rounds = _rounds(occupied, near)
    return [
        Kernel(
            function=distance_kernels.manhattan,
            parts=(),
            unit="cell",
            units=cells,
            call=lambda: distance_kernels.manhattan(occupied, manhattan),
            working_set=3 * cells,
            moved=7,  # walls read, distances written, read, written
            operations=10,
            roofs={
                "memory": ((limits.copy(3 * cells), 7),),
                "arithmetic": ((limits.operations("u16"), 6),),
                "chain along a row": ((limits.chain(), 2),),
            },
        ),
        Kernel(
            function=distance_kernels.euclidean,
            parts=(distance_kernels._lower_envelope, distance_kernels._squares_of_envelope),
            unit="cell",
            units=cells,
            call=lambda: distance_kernels.euclidean(occupied, column, euclidean),
            working_set=5 * cells,
            moved=13,
            operations=20,
            roofs={
                "memory": ((limits.copy(5 * cells), 13),),
                "division and root": ((limits.calls("division"), 1), (limits.calls("sqrt"), 1)),
            },
        ),
        Kernel(
            function=distance_kernels.truncated,
            parts=(),
            unit="cell",
            units=cells,
            call=lambda: truncated_squares(occupied, near),
            working_set=3 * cells,
            moved=7,
            operations=8 + 3.25 * rounds,
            roofs={
                "memory": ((limits.copy(3 * cells), 7),),
                "arithmetic": ((limits.operations("u16"), 8 + 3.25 * rounds),),
                # Of each column to compare with: two read, the best so far read and written.
                "nearest cache": ((limits.copy(4096), 8 * rounds),),
            },
        ),
    ]


def _rounds(occupied: NDArray[np.bool_], limit: int) -> float:
    """How many columns to each side the truncated transform compares a cell with, on average."""
    near = np.full(occupied.shape, limit, np.uint16)
    for rows in (slice(None), slice(None, None, -1)):
        best = np.full(occupied.shape[1], limit, np.uint16)
        for wall, row in zip(occupied[rows], near[rows], strict=True):
            best = np.where(wall, 0, np.minimum(best + 1, limit)).astype(np.uint16)
            np.minimum(row, best, out=row)
    total = sum(counts.rounds_outward(row, limit, distance_kernels._CHUNK) for row in near)
    return float(total) / occupied.size


def _clearance(grid: OccupancyGrid) -> Kernel:
    occupied, cells = np.ascontiguousarray(grid.occupied), float(grid.occupied.size)
    return Kernel(
        function=clearance._sweep,
        parts=(clearance._nearest_of_three, clearance._step_along),
        unit="cell",
        units=cells,
        call=lambda: clearance.chessboard_clearance(occupied),
        working_set=2 * cells,
        moved=4,
        operations=46,
        roofs={
            "memory": ((limits.copy(2 * cells), 4),),
            "arithmetic": ((limits.operations("u8"), 46),),
            # Three neighbours to one twice; eight steps along the row, each of three to one.
            "nearest cache": ((limits.copy(4096), 2 * 8 + 8 * 4 + 4),),
        },
    )


def _pooled(fields: MapFields) -> Kernel:
    squares, side = fields.squares, max(1, fields.positions.stride // 2)
    metres = np.sqrt(np.arange(int(squares.max()) + 1)) * fields.grid.resolution
    table = np.minimum(metres / endpoint_field.UNIT_M, endpoint_field.LIMIT).astype(np.float32)
    cells = float(squares.size)
    pooled = np.empty([-(-n // side) for n in squares.shape], np.uint8)
    rows = np.empty(squares.shape[1]), np.empty(pooled.shape[1])
    return Kernel(
        function=endpoint_field._pool,
        parts=(),
        unit="cell",
        units=cells,
        call=lambda: endpoint_field._pool(squares, table, side, *rows, pooled),
        working_set=2 * cells,
        moved=2 + 1 / side**2,
        operations=1 + 3 / side**2,
        roofs={
            "memory": ((limits.read(2 * cells), 2 + 1 / side**2),),
            "looking up": ((limits.gather(table.nbytes), 1),),
            "nearest cache": ((limits.copy(8 * squares.shape[1]), 18 + 24 / side),),
        },
    )


def _walked(grid: OccupancyGrid, rng: np.random.Generator) -> Kernel:
    occupied = grid.occupied
    y, x = rng.choice(np.argwhere(grid.seen_free)) + 0.3
    headings, reach = np.linspace(-np.pi, np.pi, 2000), 12.0 / grid.resolution
    return Kernel(
        function=raycast.cast_rays,
        parts=(raycast.cast_ray, raycast._towards),
        unit="step",
        units=counts.steps(occupied, x, y, headings, reach),
        call=lambda: raycast.cast_rays(occupied, x, y, headings, reach),
        working_set=(2 * reach) ** 2,
        moved=1,
        operations=8,
        roofs={
            "looking up": ((limits.gather((2 * reach) ** 2), 1),),
            "arithmetic": ((limits.operations("f64"), 8),),
        },
    )


LEAP_OPERATIONS = 14
"""To both lines: 2 x (add, add, subtract, multiply); along: 2; floor, nearness: 3; a comparison."""


def leap_roofs(mean_cells: float, leaps: float, *others: tuple[Any, float]) -> dict[str, Any]:
    """Tell what holds leaping rays back: a unit has so many leaps, and other things to do.

    Of one ray, each leap waits for what the last has read. Only many rays at a time could be as
    fast as the reads and the arithmetic alone.
    """
    around = (2.0 * mean_cells) ** 2
    return {
        "chain of leaps": ((limits.chase(around), leaps), (limits.leaps(), leaps), *others),
        "looking up": ((limits.gather(around), leaps), *others),
        "arithmetic": ((limits.operations("f64"), LEAP_OPERATIONS * leaps), *others),
    }


def _table(fields: MapFields) -> list[Kernel]:
    """Fill the table of ranges in one direction that crosses rows."""
    x, y = fields.positions.centres(np.arange(len(fields.positions)))
    rays = range_table._rays(fields.grid.occupied, x, y, upright=True)
    height, width = fields.grid.cells.shape
    both = [
        lines(range_table.DIRECTIONS, height, upright=True, offset=offset)[9]
        for offset in range_table._OFFSETS
    ]
    per_cell = fields.grid.resolution / range_table.UNIT_M
    reach = range_table.FARTHEST / per_cell
    steps = range_table._count_steps(rays, both, reach)
    line, found = both[0], np.empty(len(x), np.uint16)
    far = np.uint16(2 * math.ceil(reach / line.per_row) + 3)
    of_line = line.columns, line.turns, line.step, far
    swept = rays.free, *of_line, rays.starts, rays.columns, found
    return [
        Kernel(
            function=range_table._sweep,
            parts=(sweep.next_row,),
            unit="cell",
            units=float(height * width),
            call=lambda: range_table._sweep(*swept),
            working_set=8.0 * width,
            moved=STEP_BYTES,
            operations=STEP_OPERATIONS,
            roofs=step_roofs(width),
        ),
        _filled(fields, (x, y), line, steps, per_cell),
    ]


STEP_BYTES = 12
"""Of a step of a sweep: 2 cells of the map; before and after 2 + 2, the row 2 + 2, copied 2."""

STEP_OPERATIONS = 7


def step_roofs(width: int) -> dict[str, Any]:
    """Tell what holds a sweep back, which goes from row to row of so many cells."""
    return {
        "memory": ((limits.copy(8.0 * width), STEP_BYTES),),
        "arithmetic": ((limits.operations("u16"), STEP_OPERATIONS),),
    }


def _filled(
    fields: MapFields,
    xy: tuple[NDArray[np.float64], NDArray[np.float64]],
    line: Line,
    steps: NDArray[np.uint16],
    per_cell: float,
) -> Kernel:
    (x, y), (dx, dy), n = xy, line.direction, len(xy[0])
    found, clearance = np.empty(n, np.uint8), fields.clearance
    is_open = (steps[0] != steps[1]) | (steps[0] % 2 == 1)
    free = np.maximum(0.0, (steps.min(axis=0) // 2 - 0.5001) * line.per_row)[is_open]
    starts = x[is_open] + dx * free, y[is_open] + dy * free
    rays = np.full(len(free), dx), np.full(len(free), dy), range_table.FARTHEST / per_cell - free
    leaps = counts.leaps(clearance, *starts, *rays) / n
    arguments = clearance, x, y, line.direction, line.per_row, steps, per_cell, found
    range_table._fill(*arguments)
    return Kernel(
        function=range_table._fill,
        parts=(raycast.cast_ray_leaping, raycast.cast_ray_onward),
        unit="range",
        units=float(n),
        call=lambda: range_table._fill(*arguments),
        working_set=21.0 * n,
        moved=21 + leaps,
        operations=8 + LEAP_OPERATIONS * leaps,
        roofs={
            "memory": ((limits.copy(21.0 * n), 21),),
            **leap_roofs(float(found.mean()) / per_cell, leaps),
        },
    )
