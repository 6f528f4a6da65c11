"""Inputs from the base: wheel odometry, and the signals of its safety sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from firstfix.core.arguments import as_member, as_pose
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2


@dataclass(frozen=True, slots=True)
class Odometry:
    """A pose from wheel odometry.

    Parameters
    ----------
    stamp : float
        Time, s.
    T_odom_base : SE2
        Pose of the base in the odometry frame: continuous, but it drifts. A tuple (x, y, yaw) in
        metres and radians is accepted.

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
    """Safety sensors of a base; the values are the names of the Kobuki driver.

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
        """True for the sensors that are active while the robot is off the floor."""
        return self is not SignalKind.BUMPER


@dataclass(frozen=True, slots=True)
class Signal:
    """A safety sensor of the base that becomes active or inactive.

    Parameters
    ----------
    stamp : float
        Time, s.
    kind : SignalKind or str
        The sensor.
    active : bool
        True when the wheel drops or the bumper is pressed; False when that is over.

    Raises
    ------
    InputError
        If the stamp is not finite, or no sensor has this name.

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
            remedy="check the source of the time",
        )
