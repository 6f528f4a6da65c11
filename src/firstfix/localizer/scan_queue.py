"""Scans wait until odometry reaches their stamp; those of one instant become one view."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

from firstfix.belief.belief import REST_M, REST_RAD
from firstfix.belief.view import View
from firstfix.core.deskew import LONGEST_SWEEP_S, straighten
from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.localizer.config import ScansConfig
from firstfix.localizer.odometry_buffer import OdometryBuffer
from firstfix.localizer.sensor_clocks import SensorClocks

# Odometry may lag by so many scans: a second at 40 Hz. With a queue of one scan, odometry that lags
# by more than the time between two scans would starve the localizer.
_MOST_WAITING = 40

# Motion during a scan below which it is not worth straightening.
_SLIGHT_M = 0.001
_SLIGHT_RAD = math.radians(0.05)

# A robot rests if odometry has not moved for so long, s.
_REST_S = 1.0


class ScanQueue:
    """Pairs scans with the odometry at their stamps, whichever arrives first.

    Scans of several sensors that were taken at about the same time are one view. A view waits for
    the sensors that are about to send.

    Parameters
    ----------
    config : ScansConfig
        Whether scans are straightened.
    """

    def __init__(self, config: ScansConfig) -> None:
        self._config = config
        self.odometry = OdometryBuffer()
        self._instants: deque[list[LaserScan]] = deque(maxlen=_MOST_WAITING)
        self._clocks = SensorClocks()
        self._apart: dict[str, LaserScan] = {}  # of sensors whose clocks differ
        self._used_until = -math.inf
        self._valid_since = -math.inf

    def add(self, scan: LaserScan) -> str | None:
        """Queue a scan.

        Returns
        -------
        str or None
            One sentence if the clock of its sensor turns out to differ from the others'.
        """
        last = self.odometry.last
        self._clocks.note(scan, None if last is None else last.stamp)
        if self._clocks.differs(scan.sensor):
            self._apart[scan.sensor] = scan
            return self._clocks.complaint(scan.sensor)
        for instant in reversed(self._instants):
            if self._belongs(scan, instant):
                instant.append(scan)
                return None
        self._instants.append([scan])
        return None

    def add_odometry(self, odometry: Odometry) -> bool:
        """Add odometry; return whether it jumped, in which case all waiting scans are discarded."""
        has_jumped = self.odometry.add(odometry)
        if has_jumped:  # the clock or the odometry frame is another one
            self.clear()
            self._clocks, self._used_until = SensorClocks(), -math.inf
            self._valid_since = min(self._valid_since, odometry.stamp)
        return has_jumped

    def discard_until(self, stamp: float) -> None:
        """Discard all waiting scans, and every later one that was taken before a time."""
        self.clear()
        self._valid_since = stamp

    def clear(self) -> None:
        """Discard all waiting scans."""
        self._instants.clear()
        self._apart.clear()

    def pop(self) -> View | LaserScan | None:
        """Return the newest view that odometry has reached; the older ones are discarded.

        Returns
        -------
        View, LaserScan or None
            The scans of one instant with the odometry at the newest of them, the poses of the other
            sensors moved there. A scan that is older than all odometry that is known. None if no
            scan is ready.
        """
        last = self.odometry.last
        if last is None:
            return None
        reached = [
            instant
            for instant in self._instants
            if all(scan.stamp <= last.stamp for scan in instant)
        ]
        ready = [i for i in range(len(reached)) if self._is_complete(i, reached)]
        if not ready:
            return self._view_apart(last)
        # Not only from the left: a stamp in the future must not block others.
        for instant in reached[: ready[-1] + 1]:
            self._instants.remove(instant)
        return self._view(reached[ready[-1]])

    def is_valid(self, view: View) -> bool:
        """Return whether all scans of a view were taken after the last `discard_until`."""
        return all(scan.stamp >= self._valid_since for scan in view.scans)

    def _belongs(self, scan: LaserScan, instant: list[LaserScan]) -> bool:
        most = self._clocks.apart_s
        return all(
            other.sensor != scan.sensor and abs(other.stamp - scan.stamp) <= most
            for other in instant
        )

    def _is_complete(self, i: int, instants: list[list[LaserScan]]) -> bool:
        """Return whether nobody is waited for: a later scan of a sensor ends its instant."""
        if not self._clocks.missing(instants[i]):
            return True
        sensors = {scan.sensor for scan in instants[i]}
        return any(scan.sensor in sensors for later in instants[i + 1 :] for scan in later)

    def _view(self, scans: list[LaserScan]) -> View | LaserScan:
        """Move the scans of an instant to its newest; late ones to the view that was used last."""
        newest = max(scan.stamp for scan in scans)
        now = max(newest, self._used_until) if self._clocks.are_several else newest
        T_odom_base = self.odometry.at(now)
        moved: list[LaserScan] = []
        for scan in sorted(scans, key=lambda scan: scan.sensor):
            T_odom_then = self.odometry.at(scan.stamp)
            if T_odom_base is None or T_odom_then is None:
                return scan
            scan = self._straightened(scan)  # noqa: PLW2901
            if T_odom_then != T_odom_base:
                T_now_then = T_odom_base.inverse() @ T_odom_then
                scan = replace(scan, T_base_laser=T_now_then @ scan.T_base_laser)  # noqa: PLW2901
            moved.append(scan if newest == now else replace(scan, stamp=now))
        self._used_until = now
        assert T_odom_base is not None  # noqa: S101 - there is a scan
        return View(tuple(moved), T_odom_base)

    def _straightened(self, scan: LaserScan) -> LaserScan:
        """Straighten a scan of a robot that moved meanwhile."""
        sweep_s = scan.time_increment * (len(scan) - 1)
        if not self._config.deskew or not 0.0 < sweep_s <= LONGEST_SWEEP_S:
            return scan
        motion = self.odometry.motion(scan.stamp, sweep_s)
        if motion is None:
            return scan
        is_slight = math.hypot(motion.x, motion.y) < _SLIGHT_M and abs(motion.yaw) < _SLIGHT_RAD
        return scan if is_slight else straighten(scan, motion)

    def _view_apart(self, last: Odometry) -> View | None:
        """Return the scan of a sensor with another clock; at rest its time does not count."""
        if not self._apart or last.stamp < self._used_until:
            return None
        name = min(self._apart)
        scan = self._apart.pop(name)
        before = self.odometry.at(last.stamp - _REST_S)
        if before is None:
            return None
        step = before.inverse() @ last.T_odom_base
        if math.hypot(step.x, step.y) > REST_M or abs(step.yaw) > REST_RAD:
            return None
        self._used_until = last.stamp
        return View((replace(scan, stamp=last.stamp),), last.T_odom_base)
