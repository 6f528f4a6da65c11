"""Furniture that is not in the map."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OCCUPIED, OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor

_SIDES_M = (0.3, 0.9)
_TRIES = 50
_PASSAGE_M = 0.5  # kept free around a piece: it blocks a view, never a path


def furnished(
    grid: OccupancyGrid, count: int, rng: np.random.Generator, keep_free: Sequence[SE2] = ()
) -> OccupancyGrid:
    """Return the map with up to ``count`` boxes that the robot's own map does not have.

    No box is placed at the poses ``keep_free`` (map frame), where a robot will stand.
    """
    room = Floor(grid).room
    cells = grid.cells.copy()
    taken = [(pose.x, pose.y, 0.0) for pose in keep_free]
    for _ in range(count):
        length, width = rng.uniform(*_SIDES_M, 2).tolist()
        half = math.hypot(length, width) / 2.0
        places = np.flatnonzero(room > half + _PASSAGE_M)
        if len(places) == 0:
            continue
        for index in rng.choice(places, _TRIES).tolist():
            row, column = divmod(index, grid.width)
            x, y = grid.to_map(np.array([column + 0.5, row + 0.5])).tolist()
            if all(math.hypot(x - a, y - b) > half + r + _PASSAGE_M for a, b, r in taken):
                taken.append((x, y, half))
                T_map_box = SE2(x, y, float(rng.uniform(-math.pi, math.pi)))
                cells[_inside(grid, T_map_box, length, width)] = OCCUPIED
                break
    return OccupancyGrid(cells, grid.resolution, grid.T_map_grid, grid.unseen)


def _inside(
    grid: OccupancyGrid, T_map_box: SE2, length: float, width: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of the cells whose middle is in a box, sides in m."""
    column, row = grid.to_cells(np.array([T_map_box.x, T_map_box.y]))
    reach = math.ceil(math.hypot(length, width) / 2.0 / grid.resolution) + 1
    rows = np.arange(max(0, int(row) - reach), min(grid.height, int(row) + reach + 1))
    columns = np.arange(max(0, int(column) - reach), min(grid.width, int(column) + reach + 1))
    middles = np.stack(np.meshgrid(columns + 0.5, rows + 0.5), axis=-1)
    in_box = np.abs(T_map_box.inverse().apply(grid.to_map(middles)))
    r, c = np.nonzero((in_box[..., 0] <= length / 2.0) & (in_box[..., 1] <= width / 2.0))
    return rows[r], columns[c]
