"""Path following: pure pursuit of a point ahead on the path."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.core.se2 import SE2

CRUISE_MPS = 0.4

_AHEAD_M = 0.35  # nearer: the robot oscillates; farther: it cuts corners
_SPACING_M = 0.05
_ARRIVED_M = 0.08
_TURN_FIRST_RAD = 0.7  # a corner as sharp as this is turned on the spot
_GAIN = 2.5  # turn rate, rad/s for each rad off the point ahead
_BRAKE_MPS2 = 0.4
_SLOWEST_MPS = 0.06
_LOOK_BACK = 20  # points; where a path crosses itself, the nearest point may be wrong


class Pilot:
    """Follows a path, shape (n, 2), corners in the map frame, at a cruising speed (m, m/s)."""

    def __init__(self, path: NDArray[np.float64], cruise_mps: float = CRUISE_MPS) -> None:
        lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        self._length = float(lengths[-1])
        self._along = np.linspace(0.0, self._length, max(2, round(self._length / _SPACING_M) + 1))
        self._x, self._y = (np.interp(self._along, lengths, side) for side in path.T)
        self._cruise_mps = cruise_mps
        self._nearest = 0
        self.arrived = False

    def command(self, T_map_base: SE2) -> tuple[float, float]:
        """Return the forward speed (m/s) and the turn rate (rad/s); both are 0 after arrival."""
        x, y = T_map_base.x, T_map_base.y
        window = slice(self._nearest, self._nearest + _LOOK_BACK)
        away = np.hypot(self._x[window] - x, self._y[window] - y)
        self._nearest += int(np.argmin(away))
        left_m = math.hypot(self._x[-1] - x, self._y[-1] - y)
        rest_m = max(left_m, self._length - float(self._along[self._nearest]))
        if self.arrived or rest_m < _ARRIVED_M:
            self.arrived = True
            return 0.0, 0.0
        ahead = min(self._nearest + round(_AHEAD_M / _SPACING_M), len(self._x) - 1)
        bearing = math.atan2(self._y[ahead] - y, self._x[ahead] - x)
        aside = SE2(0.0, 0.0, bearing - T_map_base.yaw).yaw
        v = min(self._cruise_mps, math.sqrt(2.0 * _BRAKE_MPS2 * rest_m))
        straightness = max(0.0, 1.0 - abs(aside) / _TURN_FIRST_RAD)
        v = max(_SLOWEST_MPS, v * straightness) if straightness > 0.0 else 0.0
        return v, _GAIN * aside
