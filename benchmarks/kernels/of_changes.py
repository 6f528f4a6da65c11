"""The kernels that compare a map with the scans of a robot in it."""

from __future__ import annotations

import limits
import numpy as np
from kernel import Kernel
from of_fields import leap_roofs

from firstfix.changes import counts as day_counts
from firstfix.changes import kernels as of_views
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields

AREAS, SIDE_CELLS, GAP_CELLS = 60, 12, 2


def kernels(
    fields: MapFields, pose: SE2, scan: LaserScan, rng: np.random.Generator
) -> list[Kernel]:
    """All of firstfix.changes: one view from a pose, and drawn areas."""
    return [*_viewed(fields, pose, scan), _labelled(fields, rng)]


def _viewed(fields: MapFields, pose: SE2, scan: LaserScan) -> list[Kernel]:
    grid = fields.grid
    marks = np.zeros(grid.cells.shape, np.uint8)
    T_grid_laser = grid.T_map_grid.inverse() @ pose @ scan.T_base_laser
    x, y = T_grid_laser.x / grid.resolution, T_grid_laser.y / grid.resolution
    beams = day_counts._beams(scan, T_grid_laser.yaw, 0.02, 0.005, grid.resolution)
    longest = day_counts.LONGEST_M / grid.resolution
    view = fields.clearance, fields.squares, marks, x, y, beams, longest
    of_views.mark_beams(*view)
    side = longest + 10.0
    (top, bottom), (left, right) = (
        (max(0, round(at - side)), min(size, round(at + side)))
        for at, size in zip((y, x), grid.cells.shape, strict=True)
    )
    box = top, bottom, left, right
    inside = slice(top, bottom), slice(left, right)
    marked = marks[inside].copy()
    hits, near, passes = (np.zeros(grid.cells.shape, np.uint16) for _ in range(3))
    steps = float(np.minimum(beams[:, 1], longest).mean()) / of_views._STEP
    around, share = (steps * of_views._STEP * 2.0) ** 2, float(np.mean(marked > 0))

    def add() -> None:
        marks[inside] = marked  # they are cleared
        of_views.add_view(marks, hits, near, passes, box)

    return [
        Kernel(
            function=of_views.mark_beams,
            parts=(of_views.free_length, of_views.mark_walls, of_views.mark_end),
            unit="beam",
            units=float(len(beams)),
            call=lambda: of_views.mark_beams(*view),
            working_set=around,
            moved=24 + steps,
            operations=8 * steps,
            roofs={
                "looking up": ((limits.gather(around), steps),),
                "arithmetic": ((limits.operations("f64"), 4 * steps),),
                **{
                    what: roof
                    for what, roof in leap_roofs(steps / 4.0, 1.0).items()
                    if what == "chain of leaps"
                },
            },
        ),
        Kernel(
            function=of_views.add_view,
            parts=(),
            unit="cell of the box",
            units=float(marked.size),
            call=add,
            working_set=8.0 * marked.size,
            moved=4 + 4 * share,
            operations=4,
            roofs={"memory": ((limits.copy(8.0 * marked.size), 4 + 4 * share),)},
        ),
    ]


def _labelled(fields: MapFields, rng: np.random.Generator) -> Kernel:
    kinds = np.zeros(fields.grid.cells.shape, np.uint8)
    for row, column in rng.integers(0, np.subtract(kinds.shape, SIDE_CELLS), (AREAS, 2)):
        kinds[row : row + SIDE_CELLS, column : column + SIDE_CELLS] = 1 + (row + column) % 3
    labels = np.zeros(kinds.shape, np.int32)
    changed = int(np.count_nonzero(kinds))
    waiting, share = np.empty(changed + 1, np.int64), changed / kinds.size
    neighbours = (2 * GAP_CELLS + 1) ** 2

    def call() -> None:
        labels.fill(0)
        of_views.label_areas(kinds, GAP_CELLS, labels, waiting)

    return Kernel(
        function=of_views.label_areas,
        parts=(),
        unit="cell",
        units=float(kinds.size),
        call=call,
        working_set=5.0 * kinds.size,
        moved=1 + 4 + share * neighbours * 5,
        operations=2 + share * neighbours * 4,
        roofs={
            "memory": ((limits.read(kinds.size), 1), (limits.copy(4.0 * kinds.size), 4)),
            "looking up": ((limits.gather(64 * 1024), 2 * share * neighbours),),
        },
    )
