"""What a robot reports besides scans: how its wheels turned, and that something happened to it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from firstfix.core.arguments import as_member, as_pose
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2


@dataclass(frozen=True, slots=True)
class Odometry:
    """Where the wheels say that the robot is.

    Parameters
    ----------
    stamp : float
        Time, s.
    T_odom_base : SE2
        Pose of the base in the odometry frame: smooth, and adrift.

    Raises
    ------
    InputError
        If the stamp is not finite.

    Examples
    --------
    >>> ff.Odometry(stamp=0.1, T_odom_base=(1.0, 2.0, 0.5)).T_odom_base
    SE2(x=1.0, y=2.0, yaw=0.5)
    """

    stamp: float
    T_odom_base: SE2

    def __post_init__(self) -> None:
        _check_stamp(self.stamp)
        object.__setattr__(self, "T_odom_base", as_pose(self.T_odom_base, "T_odom_base"))


class SignalKind(Enum):
    """What sensors of the base can tell; the values are Kobuki's words.

    Examples
    --------
    >>> ff.SignalKind("cliff").means_lifted, ff.SignalKind("bumper").means_lifted
    (True, False)
    """

    CLIFF = "cliff"
    WHEEL_DROP = "wheel_drop"
    PICKED_UP = "picked_up"
    BUMPER = "bumper"

    @property
    def means_lifted(self) -> bool:
        """True for what a robot senses that does not stand on its wheels."""
        return self is not SignalKind.BUMPER


@dataclass(frozen=True, slots=True)
class Signal:
    """A sensor of the base that begins or ceases to report.

    Parameters
    ----------
    stamp : float
        Time, s.
    kind : SignalKind
        Which sensor.
    active : bool
        True from when a wheel drops, a bumper is pressed...; False from when that is over.

    Raises
    ------
    InputError
        If the stamp is not finite.

    Examples
    --------
    >>> signal = ff.Signal(stamp=0.1, kind="wheel_drop", active=True)
    >>> signal.kind.means_lifted
    True
    """

    stamp: float
    kind: SignalKind
    active: bool

    def __post_init__(self) -> None:
        _check_stamp(self.stamp)
        object.__setattr__(self, "kind", as_member(SignalKind, self.kind, "kind"))


def _check_stamp(stamp: float) -> None:
    if not math.isfinite(stamp):
        raise InputError(
            expected="a finite stamp in seconds",
            received=f"stamp {stamp}",
            remedy="look for NaN or infinity where the time comes from",
        )
