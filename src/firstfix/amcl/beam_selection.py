"""Selection of the beams that the filter uses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2

# Range limit of a sensor with an infinite range_max: the likelihood of a random reading is one over
# the range limit.
_FARTHEST_M = 1000.0


@dataclass(frozen=True, eq=False, slots=True)
class SelectedBeams:
    """SelectedBeams of a scan as the filter uses them.

    Parameters
    ----------
    bearings : ndarray, shape (n,)
        Directions in the base frame, rad.
    ranges : ndarray, shape (n,)
        Distances, m; ``range_max`` where nothing returned.
    ends : ndarray, shape (n, 2)
        End points in the base frame, m.
    T_base_laser : SE2
        Where the beams start.
    range_max : float
        Reach of the sensor, m.
    chosen : int
        Number of beams selected, including those without a valid reading.
    """

    bearings: NDArray[np.float64]
    ranges: NDArray[np.float64]
    ends: NDArray[np.float64]
    T_base_laser: SE2
    range_max: float
    chosen: int

    def __len__(self) -> int:
        return len(self.ranges)

    @property
    def hits(self) -> NDArray[np.float64]:
        """End points of the beams that a surface returned, in the base frame, shape (m, 2), m."""
        return self.ends[self.ranges < self.range_max]


def select_beams(scan: LaserScan, config: AmclConfig) -> SelectedBeams:
    """Select evenly spaced beams.

    Parameters
    ----------
    scan : LaserScan
        The scan.
    config : AmclConfig
        max_beams, laser_min_range and laser_max_range.

    Returns
    -------
    SelectedBeams
        At most max_beams of the scan; those without a valid reading are left out.
    """
    range_max = min(scan.range_max, _FARTHEST_M)
    if config.laser_max_range > 0.0:
        range_max = min(range_max, config.laser_max_range)
    count = min(config.max_beams, len(scan))
    chosen = np.linspace(0, len(scan) - 1, count).round().astype(np.int64)
    index = chosen[(scan.hit | scan.no_return)[chosen]]
    ranges = np.minimum(scan.ranges[index].astype(np.float64), range_max)
    if config.laser_min_range > 0.0:
        near = ranges < config.laser_min_range
        index, ranges = index[~near], ranges[~near]
    bearings = scan.bearings[index]
    ends = np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])
    return SelectedBeams(
        bearings=bearings + scan.T_base_laser.yaw,
        ranges=ranges,
        ends=scan.T_base_laser.apply(ends),
        T_base_laser=scan.T_base_laser,
        range_max=range_max,
        chosen=count,
    )
