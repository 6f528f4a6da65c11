"""Whether consecutive scans agree on a place."""

from __future__ import annotations

from firstfix.core.se2 import SE2
from firstfix.global_localization.places import is_same_place


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
