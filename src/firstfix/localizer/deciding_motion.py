"""Which motion would tell several places apart."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Hypothesis
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.localizer.outputs import MotionRequest

_TURNS = tuple(math.radians(degrees) for degrees in (0, 45, -45, 90, -90, 135, -135, 180))
_AHEAD_M = (0.0, 1.0, 2.0, 3.0)
_PLACES = 6
_BEAMS = 48

# Farther than the map is true, a beam tells two places apart.
_DIFFERENT_M = 0.3
# A motion must tell at least this share of beams apart to be worth asking for, and every metre must
# buy some.
_LEAST_GAIN = 0.05
_COST_PER_M = 0.02

# Room that a robot needs on its way, in front and at its sides.
_ROOM_M = 0.5
_SIDES_RAD = (-0.3, 0.0, 0.3)


def deciding_motion(
    scan: LaserScan, places: Sequence[Hypothesis], grid: OccupancyGrid
) -> MotionRequest | None:
    """Find the turn and way after which the likeliest place looks least like any other.

    Parameters
    ----------
    scan : LaserScan
        The scan that left the places open: it says what the sensor can see.
    places : sequence of Hypothesis
        Most likely first; the first six are told apart.
    grid : OccupancyGrid
        The map.

    Returns
    -------
    MotionRequest or None
        The motion, free of walls at all of these places; None if none of those tried would help.
    """
    poses = [place.pose for place in places[:_PLACES]]
    best: MotionRequest | None = None
    for turn in _TURNS:
        room = min((_room_ahead(grid, pose, turn) for pose in poses), default=0.0)
        for ahead in _AHEAD_M:
            if ahead > 0.0 and room < ahead + _ROOM_M:
                continue
            gain = _gain(scan, poses, SE2(0.0, 0.0, turn) @ SE2(ahead, 0.0, 0.0), grid)
            worth = gain - _COST_PER_M * ahead
            if gain >= _LEAST_GAIN and (
                best is None or worth > best.gain - _COST_PER_M * best.ahead
            ):
                best = MotionRequest(scan.stamp, turn, ahead, gain)
    return best


def _room_ahead(grid: OccupancyGrid, T_map_base: SE2, turn: float) -> float:
    bearings = turn + np.array(_SIDES_RAD)
    return float(expected_ranges(grid, T_map_base, bearings, max(_AHEAD_M) + 1.0).min())


def _gain(scan: LaserScan, poses: Sequence[SE2], T_base_moved: SE2, grid: OccupancyGrid) -> float:
    """Share of beams that would differ between the first place and the one most like it."""
    chosen = np.linspace(0, len(scan) - 1, min(_BEAMS, len(scan))).round().astype(np.int64)
    bearings = scan.bearings[chosen]
    views = [_view(scan, pose @ T_base_moved, bearings, grid) for pose in poses]
    gains = [float(np.mean(np.abs(view - views[0]) > _DIFFERENT_M)) for view in views[1:]]
    return min(gains, default=0.0)


def _view(
    scan: LaserScan, T_map_base: SE2, bearings: NDArray[np.float64], grid: OccupancyGrid
) -> NDArray[np.float64]:
    reach = min(scan.range_max, 30.0)
    ranges = expected_ranges(grid, T_map_base @ scan.T_base_laser, bearings, reach)
    return np.minimum(ranges, reach)
