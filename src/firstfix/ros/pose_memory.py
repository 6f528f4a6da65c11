"""What is known of a robot's place before its first scan, and kept for the next start."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from firstfix.core.errors import InputError
from firstfix.core.odometry import Odometry
from firstfix.io.atomic_files import is_file
from firstfix.io.recalled_pose import recall
from firstfix.io.saved_pose import SavedPose, load_pose, map_key
from firstfix.localizer.inputs import Input, NewMap, PoseHint
from firstfix.localizer.outputs import Output, Status, TrackedPose
from firstfix.localizer.states import State
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.pose_keeper import PoseKeeper
from firstfix.ros.transport import Severity


class PoseMemory:
    """Hints for the start, and a file that holds the last pose for as long as it is known.

    The file is written by a thread of its own: a memory card may take a second for it.

    Parameters
    ----------
    config : NodeConfig
        saved_pose_file, save_pose_rate, set_initial_pose, initial_pose, always_reset_initial_pose.
    say : callable
        Writes a line of the log; called by whoever calls the methods.
    """

    def __init__(self, config: NodeConfig, say: Callable[[Severity, str], None]) -> None:
        self._amcl = config.amcl
        self._say = say
        self._path = Path(config.saved_pose_file) if config.saved_pose_file else None
        self._keeper = PoseKeeper(self._path, self._amcl.save_pose_rate) if self._path else None
        self._disk = ThreadPoolExecutor(1, "firstfix-disk")
        self._writing: Future[None] | None = None
        self._is_told = False
        self._map_key = ""
        self._odometry: Odometry | None = None
        self._is_hint_due = False
        self._last: TrackedPose | None = None

    def hint_after(self, given: Input) -> PoseHint | None:
        """Say where the robot may be, once its map and its odometry are known.

        Parameters
        ----------
        given : Input
            What has just been handled.

        Returns
        -------
        PoseHint or None
            The saved pose, as far as it is still worth something, else initial_pose where
            set_initial_pose asks for it; for the first map, or with always_reset_initial_pose
            initial_pose for every map.
        """
        if isinstance(given, NewMap):
            self._is_hint_due = not self._map_key or self._amcl.always_reset_initial_pose
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
        """Note where the robot is; no longer localized, what was saved does not hold.

        Parameters
        ----------
        outputs : list of Output
            Of the localizer, for one input.
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
        """Save the last pose, if it still holds, and wait until that is done."""
        if self._keeper is not None and self._last is not None:
            self._save(self._keeper, self._last)
            self._last = None
        self._disk.shutdown()
        self._is_disk_idle()

    def _recalled(self, odometry: Odometry) -> PoseHint | None:
        if self._path is None or self._amcl.always_reset_initial_pose:
            return None
        if not is_file(self._path):
            self._say(Severity.INFO, f"no saved pose in {self._path} yet")
            return None
        try:
            saved = load_pose(self._path)
        except InputError as error:
            self._say(Severity.WARNING, f"the saved pose cannot be used: {error}")
            return None
        recalled = recall(
            saved,
            now=odometry.stamp,
            T_odom_base=odometry.T_odom_base,
            map_key=self._map_key,
            max_age_s=math.inf,  # the next scan will tell
        )
        self._say(Severity.INFO, f"the saved pose is {recalled.standing.value}: {recalled.why}")
        if recalled.T_map_base is None:
            return None
        return PoseHint(odometry.stamp, recalled.T_map_base, "the saved pose")

    def _set(self, odometry: Odometry) -> PoseHint | None:
        if not self._amcl.set_initial_pose:
            return None
        return PoseHint(odometry.stamp, self._amcl.initial_pose, "initial_pose")

    def _save(self, keeper: PoseKeeper, last: TrackedPose) -> None:
        T_odom_base = last.T_map_odom.inverse() @ last.T_map_base
        pose = SavedPose(last.T_map_base, last.covariance, last.stamp, T_odom_base, self._map_key)
        self._writing = self._disk.submit(keeper.save, pose)

    def _is_disk_idle(self) -> bool:
        """Tell whether the last write is done; if it failed, say so, once until one succeeds."""
        if self._writing is None:
            return True
        if not self._writing.done():
            return False
        error, self._writing = self._writing.exception(), None
        if error is not None and not self._is_told:
            self._say(Severity.WARNING, f"the pose is not saved: {error}")
        self._is_told = error is not None
        return True
