"""The kernels of the simulation."""

from __future__ import annotations

import counts
import limits
import numpy as np
from kernel import Kernel
from of_fields import leap_roofs

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.clearance import chessboard_clearance
from firstfix.lab.simulation import sweep, wavefront

BEAMS = 2000
PEOPLE = 6


def kernels(grid: OccupancyGrid, pose: SE2, rng: np.random.Generator) -> list[Kernel]:
    """All of firstfix.lab.simulation, around one pose."""
    return [_swept(grid, pose, rng), _walked(grid, pose)]


def _swept(grid: OccupancyGrid, pose: SE2, rng: np.random.Generator) -> Kernel:
    clearance = chessboard_clearance(grid.occupied)
    start = grid.to_cells(np.array([[pose.x, pose.y]]))[0]
    x, y = np.full(BEAMS, start[0]), np.full(BEAMS, start[1])
    headings, reach = np.linspace(-np.pi, np.pi, BEAMS), 12.0 / grid.resolution
    circles = np.column_stack([start + rng.uniform(-60, 60, (PEOPLE, 2)), np.full(PEOPLE, 5.0)])
    leaps = counts.leaps(clearance, x, y, np.cos(headings), np.sin(headings), np.full(BEAMS, reach))
    ranges = sweep._cast(clearance, x, y, headings, circles, reach)
    each, mean_cells = leaps / BEAMS, float(np.minimum(ranges, reach).mean())
    return Kernel(
        function=sweep._cast,
        parts=(),
        unit="beam",
        units=float(BEAMS),
        call=lambda: sweep._cast(clearance, x, y, headings, circles, reach),
        working_set=(2.0 * mean_cells) ** 2,
        moved=32 + each,
        operations=14 * each + 12 * PEOPLE,
        roofs=leap_roofs(
            mean_cells,
            each,
            (limits.calls("sin + cos"), 1),
            (limits.operations("f64"), 12 * PEOPLE),
        ),
    )


def _walked(grid: OccupancyGrid, pose: SE2) -> Kernel:
    blocked = np.pad(grid.occupied, 1, constant_values=True)
    weights = np.where(blocked, np.inf, 1.0).astype(np.float32)
    column, row = np.floor(grid.to_cells(np.array([[pose.x, pose.y]]))[0]).astype(int)
    start = int(row) + 1, int(column) + 1

    def call() -> None:
        costs = np.full(weights.shape, np.inf, np.float32)
        costs[start] = 0.0
        wavefront._sweep_until_still(weights, costs)

    times = counts.passes(weights, start)
    return Kernel(
        function=wavefront._sweep_until_still,
        parts=(wavefront._improve,),
        unit="cell of a sweep",
        units=float(times * weights.size),
        call=call,
        working_set=2.0 * weights.nbytes,
        moved=8,
        operations=7,
        roofs={
            "memory": ((limits.copy(2.0 * weights.nbytes), 8),),
            "chain along a row": ((limits.sums(), 1),),
        },
    )
