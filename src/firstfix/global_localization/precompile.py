"""Compile or load the kernels of a search in advance, by a search in a small room."""

from __future__ import annotations

import numpy as np

from firstfix.core.angles import FULL_TURN
from firstfix.core.grid import FREE, OCCUPIED, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.global_localization.config import Method
from firstfix.global_localization.scan_matcher import ScanMatcher

_RANGE_MAX = 12.0
_HERE = SE2(3.0, 2.5, 0.4)


def precompile_search(method: Method) -> None:
    """Run one search, so that the time of the next one is that of the search alone."""
    grid = small_room()
    ScanMatcher(grid, method=method).locate(scan_of(grid, _HERE))


def small_room() -> OccupancyGrid:
    """Return a room of 8 x 6 m with a pillar and a cut corner, its corner at the origin.

    One scan is enough to find a robot there, so that a short story also tracks it.
    """
    cells = np.full((120, 160), FREE, np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = OCCUPIED
    cells[30:50, 100:120] = OCCUPIED
    cells[80:, :50] = OCCUPIED
    return OccupancyGrid(cells, 0.05)


def scan_of(grid: OccupancyGrid, T_map_base: SE2) -> LaserScan:
    """Return the scan of a perfect sensor with 180 beams all round."""
    bearings = np.linspace(-FULL_TURN / 2, FULL_TURN / 2, 180, endpoint=False)
    ranges = expected_ranges(grid, T_map_base, bearings, _RANGE_MAX).astype(np.float32)
    step = float(bearings[1] - bearings[0])
    return LaserScan(ranges, float(bearings[0]), step, range_min=0.1, range_max=_RANGE_MAX)
