"""Scans wait until odometry reaches their stamp."""

from __future__ import annotations

import math
from collections import deque

from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.localizer.odometry_buffer import OdometryBuffer

# Odometry may lag by so many scans: a second at 40 Hz. With a queue of one scan, odometry that lags
# by more than the time between two scans would starve the localizer.
_MOST_WAITING = 40


class ScanQueue:
    """Pairs scans with the odometry at their stamps, whichever arrives first."""

    def __init__(self) -> None:
        self.odometry = OdometryBuffer()
        self._waiting: deque[LaserScan] = deque(maxlen=_MOST_WAITING)
        self._valid_since = -math.inf

    def add(self, scan: LaserScan) -> None:
        """Queue a scan."""
        self._waiting.append(scan)

    def add_odometry(self, odometry: Odometry) -> bool:
        """Add odometry; return whether it jumped, in which case all waiting scans are discarded."""
        has_jumped = self.odometry.add(odometry)
        if has_jumped:  # the clock or the odometry frame is another one
            self._waiting.clear()
            self._valid_since = min(self._valid_since, odometry.stamp)
        return has_jumped

    def discard_until(self, stamp: float) -> None:
        """Discard all waiting scans, and every later one that was taken before a time."""
        self._waiting.clear()
        self._valid_since = stamp

    def clear(self) -> None:
        """Discard all waiting scans."""
        self._waiting.clear()

    def pop(self) -> tuple[LaserScan, SE2 | None] | None:
        """Return the newest scan that odometry has reached; the older ones are discarded.

        Returns
        -------
        tuple of LaserScan and SE2 or None, or None
            The scan, and ``T_odom_base`` at its stamp: None if the scan is older than all odometry
            that is known. None if no scan is ready.
        """
        last = self.odometry.last
        if last is None:
            return None
        reached = [scan for scan in self._waiting if scan.stamp <= last.stamp]
        for scan in reached:  # not only from the left: a stamp in the future must not block others
            self._waiting.remove(scan)
        if not reached:
            return None
        scan = reached[-1]
        return scan, self.odometry.at(scan.stamp)

    def is_valid(self, scan: LaserScan) -> bool:
        """Return whether a scan was taken after the last `discard_until`."""
        return scan.stamp >= self._valid_since
