"""Poses over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import wrap
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Poses over time, such as odometry (``T_odom_base``) or ground truth (``T_map_base``).

    Parameters
    ----------
    stamps : ndarray, shape (n,)
        Times, s, ascending. Made read-only.
    poses : ndarray, shape (n, 3)
        x (m), y (m), yaw (rad) at these times. Made read-only.

    Raises
    ------
    InputError
        If the lengths differ, a number is not finite, or the stamps are not ascending.

    Examples
    --------
    >>> path = ff.Trajectory([0.0, 1.0], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    >>> path.at(0.5)
    SE2(x=0.5, y=0.0, yaw=0.0)
    """

    stamps: NDArray[np.float64]
    poses: NDArray[np.float64]

    def __post_init__(self) -> None:
        stamps = np.array(self.stamps, np.float64)
        poses = np.array(self.poses, np.float64)
        if stamps.ndim != 1 or poses.shape != (len(stamps), 3):
            raise InputError(
                expected="n stamps and poses of shape (n, 3)",
                received=f"shapes {stamps.shape} and {poses.shape}",
                remedy="give one pose x, y, yaw for every stamp",
            )
        if not (np.isfinite(stamps).all() and np.isfinite(poses).all()):
            raise InputError(
                expected="finite stamps and poses",
                received="NaN or infinity among them",
                remedy="remove the unknown poses",
            )
        steps_back = stamps[1:] < stamps[:-1]
        if steps_back.any():
            raise InputError(
                expected="stamps in ascending order",
                received=f"a step back at pose {int(np.argmax(steps_back)) + 1}",
                remedy="sort the log by time",
            )
        stamps.flags.writeable = poses.flags.writeable = False
        object.__setattr__(self, "stamps", stamps)
        object.__setattr__(self, "poses", poses)

    def __len__(self) -> int:
        return len(self.stamps)

    def __repr__(self) -> str:
        duration = float(self.stamps[-1] - self.stamps[0]) if len(self) else 0.0
        return f"<Trajectory {len(self)} poses in {duration:.1f} s>"

    def at(self, stamp: float) -> SE2 | None:
        """Interpolate the pose at a time.

        Parameters
        ----------
        stamp : float
            Time, s.

        Returns
        -------
        SE2 or None
            The pose; None before the first and after the last stamp.
        """
        i = int(np.searchsorted(self.stamps, stamp))
        if i < len(self.stamps) and self.stamps[i] == stamp:
            return SE2.from_array(self.poses[i])
        if i == 0 or i == len(self.stamps):
            return None
        before, after = self.poses[i - 1], self.poses[i]
        share = (stamp - self.stamps[i - 1]) / (self.stamps[i] - self.stamps[i - 1])
        x, y = before[:2] + share * (after[:2] - before[:2])
        return SE2(float(x), float(y), float(before[2] + share * wrap(float(after[2] - before[2]))))
