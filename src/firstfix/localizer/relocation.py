"""Another place where the robot may be: how many scans have said so in a row."""

from __future__ import annotations

import math

from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2
from firstfix.localizer.config import WatchConfig


class Candidates:
    """Counts scans that, carried by odometry, mean the same place.

    Parameters
    ----------
    config : WatchConfig
        Up to where two poses are one place.
    """

    def __init__(self, config: WatchConfig) -> None:
        self._config = config
        self._T_map_odom: SE2 | None = None
        self._count = 0

    def count(self, T_map_base: SE2, T_odom_base: SE2) -> int:
        """Return how many scans in a row have meant this place, with this one.

        Parameters
        ----------
        T_map_base : SE2
            Where a scan puts the robot.
        T_odom_base : SE2
            Odometry at the scan.

        Returns
        -------
        int
            1 for a place that is new.
        """
        agrees = self._T_map_odom is not None and same_place(
            T_map_base, self._T_map_odom @ T_odom_base, self._config
        )
        self._count = self._count + 1 if agrees else 1
        self._T_map_odom = T_map_base @ T_odom_base.inverse()
        return self._count

    def clear(self) -> None:
        """Forget the place: a scan has not meant it."""
        self._T_map_odom, self._count = None, 0


def same_place(a: SE2, b: SE2, config: WatchConfig) -> bool:
    """Tell whether two poses are one place."""
    return a.distance_to(b) <= config.agree_m and angle_error(a.yaw, b.yaw) <= config.agree_rad


def moved_on(before: SE2, after: SE2, config: WatchConfig) -> bool:
    """Tell whether a robot has moved so far that it sees something else (both ``T_odom_base``)."""
    moved = before.inverse() @ after
    far = math.hypot(moved.x, moved.y) >= config.look_again_m
    return far or abs(moved.yaw) >= config.look_again_rad
