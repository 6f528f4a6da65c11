"""A small room to try things in first, so that no figure contains the compiler."""

from __future__ import annotations

import numpy as np

from firstfix.core.angles import FULL_TURN
from firstfix.core.grid import FREE, OCCUPIED, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges

RANGE_MAX = 5.0


def small_room() -> OccupancyGrid:
    """Return a room of 8 x 6 m with a pillar, its corner at the origin."""
    cells = np.full((120, 160), FREE, np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = OCCUPIED
    cells[30:50, 100:120] = OCCUPIED
    return OccupancyGrid(cells, 0.05)


def scan_of(grid: OccupancyGrid, T_map_base: SE2) -> LaserScan:
    """Return what a perfect sensor of 180 beams all round sees."""
    bearings = np.linspace(-FULL_TURN / 2, FULL_TURN / 2, 180, endpoint=False)
    ranges = expected_ranges(grid, T_map_base, bearings, RANGE_MAX).astype(np.float32)
    step = float(bearings[1] - bearings[0])
    return LaserScan(ranges, float(bearings[0]), step, range_min=0.1, range_max=RANGE_MAX)
