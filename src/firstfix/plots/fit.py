"""Which beams of a scan a pose explains, for a picture."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import FREE, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges

# As wide as what `global_localization` calls a wall seen through.
AGREES_M = 0.3


class Fit(IntEnum):
    """How a beam agrees with the map."""

    AS_MAPPED = 0
    SHORTER = 1
    THROUGH_WALL = 2
    UNMAPPED = 3


def fit_of_hits(grid: OccupancyGrid, scan: LaserScan, T_map_base: SE2) -> NDArray[np.int64]:
    """Sort the beams that hit something by how they agree with the map.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        The scan.
    T_map_base : SE2
        Pose of the robot.

    Returns
    -------
    ndarray of int64, shape (n_hit,)
        Values of `Fit`, in the order of ``scan.points()``.
    """
    measured = scan.ranges[scan.hit].astype(np.float64)
    if len(measured) == 0:
        return np.empty(0, np.int64)
    reach = float(measured.max()) + 2 * AGREES_M
    laser = T_map_base @ scan.T_base_laser
    gap = measured - expected_ranges(grid, laser, scan.bearings[scan.hit], reach)
    fit = np.full(len(measured), Fit.SHORTER, np.int64)
    fit[_is_unknown(grid, T_map_base.apply(scan.points()))] = Fit.UNMAPPED
    fit[gap > AGREES_M] = Fit.THROUGH_WALL
    fit[np.abs(gap) <= AGREES_M] = Fit.AS_MAPPED
    return fit


def _is_unknown(grid: OccupancyGrid, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    column, row = np.floor(grid.to_cells(points)).T.astype(np.int64)
    inside = (column >= 0) & (row >= 0) & (column < grid.width) & (row < grid.height)
    unknown = np.ones(len(points), np.bool_)
    unknown[inside] = grid.cells[row[inside], column[inside]] < FREE
    return unknown
