"""The pose of a robot before its first scan: saved by the last run, or a parameter."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from firstfix.core.errors import InputError
from firstfix.core.odometry import Odometry
from firstfix.io.atomic_files import is_file, remove_file
from firstfix.io.recalled_pose import recall
from firstfix.io.saved_pose import SavedPose, load_pose, map_key, save_pose
from firstfix.localizer.inputs import Input, NewMap, PoseHint
from firstfix.localizer.outputs import Output, Status, TrackedPose
from firstfix.localizer.states import State
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.transport import Severity

# What was saved is good to this at first, m. People move robots that are switched off: a metre in
# each ten minutes, up to a room.
_RADIUS_M = 1.0
_GROWTH_M_S = 1.0 / 600.0
_LARGEST_RADIUS_M = 5.0


class PoseKeeper:
    """A file with the last pose.

    Parameters
    ----------
    path : Path
        The file; replaced each time, all or nothing.
    rate_hz : float
        Maximum rate by the stamps of the poses, Hz; zero or less: only `save` saves.
    """

    def __init__(self, path: Path, rate_hz: float) -> None:
        self._path = path
        self._pause_s = 1.0 / rate_hz if rate_hz > 0.0 else math.inf
        self._last = math.nan

    def is_due(self, stamp: float) -> bool:
        """Return whether a pose of this time is to be saved; the pause begins with the first."""
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
        """Remove the file: its pose no longer holds; raises InputError if it cannot be removed."""
        remove_file(self._path)


class PoseMemory:
    """Provides a hint for the start, and keeps the last pose in a file while it holds.

    A separate thread writes the file: a memory card may take a second.

    Parameters
    ----------
    config : NodeConfig
        saved_pose_file, save_pose_rate, set_initial_pose, initial_pose, always_reset_initial_pose.
    log : callable
        Writes a line to the log; called in the thread that calls the methods.
    """

    def __init__(self, config: NodeConfig, log: Callable[[Severity, str], None]) -> None:
        self._config = config
        self._log = log
        self._path = Path(config.saved_pose_file) if config.saved_pose_file else None
        self._keeper = PoseKeeper(self._path, self._config.save_pose_rate) if self._path else None
        self._disk = ThreadPoolExecutor(1, "firstfix-disk")
        self._writing: Future[None] | None = None
        self._has_warned = False
        self._map_key = ""
        self._odometry: Odometry | None = None
        self._is_hint_due = False
        self._last: TrackedPose | None = None

    def hint_after(self, given: Input) -> PoseHint | None:
        """Return where the robot may be, once its map and its odometry are known.

        Parameters
        ----------
        given : Input
            The input that was just handled.

        Returns
        -------
        PoseHint or None
            The saved pose if it still holds, else initial_pose with set_initial_pose; for the
            first map, or with always_reset_initial_pose initial_pose for every map.
        """
        if isinstance(given, NewMap):
            self._is_hint_due = not self._map_key or self._config.always_reset_initial_pose
            self._map_key = map_key(given.grid)
        elif isinstance(given, Odometry):
            self._odometry = given
        elif isinstance(given, PoseHint):
            self._is_hint_due = False
        if not self._is_hint_due or self._odometry is None:
            return None
        self._is_hint_due = False
        return self._recalled(self._odometry) or self._set(self._odometry)

    def keep(self, outputs: list[Output]) -> None:
        """Save the pose when it is due; remove the file once the robot is no longer localized.

        Parameters
        ----------
        outputs : list of Output
            Those of one input.
        """
        if self._keeper is None:
            return
        for output in outputs:
            if isinstance(output, TrackedPose):
                self._last = output
                if self._is_disk_idle() and self._keeper.is_due(output.stamp):
                    self._save(self._keeper, output)
            elif isinstance(output, Status) and output.state is not State.LOCALIZED and self._last:
                self._last = None
                self._writing = self._disk.submit(self._keeper.withdraw)

    def close(self) -> None:
        """Save the last pose if it still holds, and wait until it is written."""
        if self._keeper is not None and self._last is not None:
            self._save(self._keeper, self._last)
            self._last = None
        self._disk.shutdown()
        self._is_disk_idle()

    def _recalled(self, odometry: Odometry) -> PoseHint | None:
        if self._path is None or self._config.always_reset_initial_pose:
            return None
        if not is_file(self._path):
            self._log(Severity.INFO, f"no saved pose in {self._path} yet")
            return None
        try:
            saved = load_pose(self._path)
        except InputError as error:
            self._log(Severity.WARNING, f"the saved pose cannot be used: {error}")
            return None
        recalled = recall(
            saved,
            now=odometry.stamp,
            T_odom_base=odometry.T_odom_base,
            map_key=self._map_key,
            max_age_s=math.inf,  # the next scan checks it
        )
        self._log(Severity.INFO, f"the saved pose is {recalled.outcome.value}: {recalled.reason}")
        if recalled.T_map_base is None:
            return None
        age_s = max(0.0, odometry.stamp - saved.stamp)
        radius = min(_RADIUS_M + _GROWTH_M_S * age_s, _LARGEST_RADIUS_M)
        return PoseHint(odometry.stamp, recalled.T_map_base, "the saved pose", radius=radius)

    def _set(self, odometry: Odometry) -> PoseHint | None:
        if not self._config.set_initial_pose:
            return None
        return PoseHint(odometry.stamp, self._config.initial_pose, "initial_pose")

    def _save(self, keeper: PoseKeeper, last: TrackedPose) -> None:
        T_odom_base = last.T_map_odom.inverse() @ last.T_map_base
        pose = SavedPose(last.T_map_base, last.covariance, last.stamp, T_odom_base, self._map_key)
        self._writing = self._disk.submit(keeper.save, pose)

    def _is_disk_idle(self) -> bool:
        """Return whether the last write is done; warn about a failure once until one succeeds."""
        if self._writing is None:
            return True
        if not self._writing.done():
            return False
        error, self._writing = self._writing.exception(), None
        if error is not None and not self._has_warned:
            self._log(Severity.WARNING, f"the pose is not saved: {error}")
        self._has_warned = error is not None
        return True
