"""Do several scans agree on a place? A pose that changes by a leap needs more than one."""

from __future__ import annotations

import math

from firstfix.core.se2 import SE2
from firstfix.global_localization.places import is_same_place
from firstfix.localizer.config import MonitorConfig

# A robot that lost its pose is accepted at the first sure place within this distance.
_STRAYED_M = 2.0


class AgreementCounter:
    """Counts consecutive scans that, carried along by odometry, agree on one place."""

    def __init__(self) -> None:
        self._T_map_odom: SE2 | None = None
        self._count = 0

    def count(self, T_map_base: SE2, T_odom_base: SE2) -> int:
        """Return how many scans in a row agree on this place, the present one included.

        Parameters
        ----------
        T_map_base : SE2
            Where a scan puts the robot.
        T_odom_base : SE2
            Odometry at the scan.
        """
        agrees = self._T_map_odom is not None and is_same_place(
            T_map_base, self._T_map_odom @ T_odom_base
        )
        self._count = self._count + 1 if agrees else 1
        self._T_map_odom = T_map_base @ T_odom_base.inverse()
        return self._count

    def clear(self) -> None:
        """Start again: the last scan did not agree."""
        self._T_map_odom, self._count = None, 0


class LostPose:
    """The pose that a robot lost without being picked up, and what may follow it.

    Such a robot is not far away, or it has left the mapped area, where any sure place is wrong. So
    a place far away needs several views that agree.

    Parameters
    ----------
    config : MonitorConfig
        What counts as a view, and how many must agree.
    """

    def __init__(self, config: MonitorConfig) -> None:
        self._config = config
        self._T_map_odom: SE2 | None = None
        self._agreement = AgreementCounter()
        self._agreed_at: SE2 | None = None

    def set(self, T_map_odom: SE2 | None) -> None:
        """Record where a pose was lost; None if none was, or the robot was picked up."""
        self._T_map_odom = T_map_odom
        self._agreement.clear()
        self._agreed_at = None

    def allows(self, T_map_base: SE2, T_odom_base: SE2) -> bool:
        """Return whether a sure place may be published."""
        if self._T_map_odom is None:
            return True
        if T_map_base.distance_to(self._T_map_odom @ T_odom_base) <= _STRAYED_M:
            return True
        if self._agreed_at is not None and not self._is_new_view(self._agreed_at, T_odom_base):
            return False
        self._agreed_at = T_odom_base
        return self._agreement.count(T_map_base, T_odom_base) >= self._config.decided_views

    def _is_new_view(self, before: SE2, after: SE2) -> bool:
        moved = before.inverse() @ after
        far = math.hypot(moved.x, moved.y) >= self._config.new_view_m
        return far or abs(moved.yaw) >= self._config.new_view_rad
