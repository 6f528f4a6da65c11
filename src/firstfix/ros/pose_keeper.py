"""Keeping the last pose of a robot on disk, as often as the parameters say."""

from __future__ import annotations

import math
from pathlib import Path

from firstfix.io.atomic_files import remove_file
from firstfix.io.saved_pose import SavedPose, save_pose


class PoseKeeper:
    """A file with the last pose.

    Parameters
    ----------
    path : Path
        The file; replaced each time, all or nothing.
    rate_hz : float
        How often to save at most, by the stamps of the poses; zero or less: only where told to.
    """

    def __init__(self, path: Path, rate_hz: float) -> None:
        self._path = path
        self._pause_s = 1.0 / rate_hz if rate_hz > 0.0 else math.inf
        self._last = math.nan

    def is_due(self, stamp: float) -> bool:
        """Tell whether a pose of this time is to be saved; the pause begins with the first."""
        if math.isnan(self._last) or stamp < self._last:  # the clock was set back
            self._last = stamp
        return stamp - self._last >= self._pause_s

    def offer(self, pose: SavedPose) -> None:
        """Save a pose if it is time to; raises InputError if it cannot be written."""
        if self.is_due(pose.stamp):
            self.save(pose)

    def save(self, pose: SavedPose) -> None:
        """Save a pose now; raises InputError if it cannot be written."""
        self._last = pose.stamp
        save_pose(self._path, pose)

    def withdraw(self) -> None:
        """Remove the file, because the robot is not there any more; raises InputError if not."""
        remove_file(self._path)
