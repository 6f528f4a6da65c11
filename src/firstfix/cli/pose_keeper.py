"""Keeping the last pose of a drive on disk, as often as the parameters say."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from firstfix.formats.saved_pose import SavedPose, save_pose

if TYPE_CHECKING:
    from firstfix.evaluation.track import TrackedScan


class PoseKeeper:
    """A file with the last pose.

    Parameters
    ----------
    path : Path
        The file; replaced each time, all or nothing.
    map_key : str
        Which map the poses are in.
    rate_hz : float
        How often to save at most, by the stamps of the scans; zero or less: only at the end.
    """

    def __init__(self, path: Path, map_key: str, rate_hz: float) -> None:
        self._path = path
        self._map_key = map_key
        self._pause_s = 1.0 / rate_hz if rate_hz > 0.0 else math.inf
        self._last = math.nan

    def offer(self, tracked: TrackedScan) -> None:
        """Save a pose if it is time to."""
        stamp = tracked.sight.scan.stamp
        if math.isnan(self._last):
            self._last = stamp
        elif stamp - self._last >= self._pause_s:
            self.save(tracked)

    def save(self, tracked: TrackedScan) -> None:
        """Save a pose now."""
        self._last = tracked.sight.scan.stamp
        saved = SavedPose(
            T_map_base=tracked.T_map_base,
            covariance=tracked.covariance,
            stamp=self._last,
            T_odom_base=tracked.sight.T_odom_base,
            map_key=self._map_key,
        )
        save_pose(self._path, saved)
