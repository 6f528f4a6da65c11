"""The odometry of the last seconds, interpolated at the stamp of a scan."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque

from firstfix.core.angles import angle_error, wrap
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2

_KEPT = 2000

# No robot indoors is faster. A larger step between two messages is a restart of the odometry.
_FASTEST_M_S = 5.0
_FASTEST_RAD_S = 15.0
_JUMP_M = 0.3
_JUMP_RAD = math.radians(30.0)

# Odometry this close to zero, m, has just been restarted, unless the robot came from nearby.
_START_M = 0.05

# Past its end, odometry is continued for this long by its last motion, s.
_EXTRAPOLATED_S = 0.2

# After a gap of several messages, a longer step than this needs a scan that confirms it. After a
# silence of this many seconds any step does: the robot may have been off, and carried.
_LEAP_M = 0.5
_GAP_MESSAGES = 3.0
_SILENCE_S = 1.0


class OdometryBuffer:
    """Odometry in the order of its stamps, at most 2000 messages."""

    def __init__(self) -> None:
        self._kept: deque[Odometry] = deque(maxlen=_KEPT)

    @property
    def last(self) -> Odometry | None:
        """The newest message; None before the first."""
        return self._kept[-1] if self._kept else None

    def add(self, odometry: Odometry) -> bool:
        """Add a message; after a jump all earlier messages are discarded.

        Parameters
        ----------
        odometry : Odometry
            The message. One with the stamp of the last replaces it.

        Returns
        -------
        bool
            True if the clock or the pose jumped: the odometry frame is another one.
        """
        last = self.last
        jumped = last is not None and _has_jumped(last, odometry)
        if jumped:
            self._kept.clear()
        elif last is not None and last.stamp == odometry.stamp:
            self._kept.pop()
        self._kept.append(odometry)
        return jumped

    def leaps(self, odometry: Odometry) -> bool:
        """Return whether a message, not yet added, needs a scan that confirms it.

        After a gap a robot that drove on cannot be distinguished from one whose odometry was
        restarted, nor one that stood from one that was switched off and carried.

        Parameters
        ----------
        odometry : Odometry
            The next message.

        Returns
        -------
        bool
            True if messages are missing before it, and it is far from the last one or comes after
            a silence of more than a second.
        """
        if len(self._kept) < 2:
            return False
        before, last = self._kept[-2], self._kept[-1]
        usual_s = last.stamp - before.stamp
        distance = last.T_odom_base.distance_to(odometry.T_odom_base)
        turn = angle_error(last.T_odom_base.yaw, odometry.T_odom_base.yaw)
        gap_s = odometry.stamp - last.stamp
        is_far = distance > _LEAP_M or turn > _JUMP_RAD
        return gap_s > _GAP_MESSAGES * usual_s and (is_far or gap_s > _SILENCE_S)

    def at(self, stamp: float) -> SE2 | None:
        """Interpolate ``T_odom_base`` at a time; None if it is not known there, or not yet."""
        i = bisect_left(self._kept, stamp, key=lambda odometry: odometry.stamp)
        if i == len(self._kept):
            return None
        right = self._kept[i]
        if right.stamp == stamp:
            return right.T_odom_base
        if i == 0:
            return None
        left = self._kept[i - 1]
        share = (stamp - left.stamp) / (right.stamp - left.stamp)
        a, b = left.T_odom_base, right.T_odom_base
        return SE2(
            a.x + share * (b.x - a.x),
            a.y + share * (b.y - a.y),
            a.yaw + share * wrap(b.yaw - a.yaw),
        )

    def motion(self, stamp: float, duration: float) -> SE2 | None:
        """Return the motion of the base from a time on; None where it is unknown.

        Parameters
        ----------
        stamp : float
            When it begins, s.
        duration : float
            How long it takes, s. Up to 0.2 s after the last message, the robot is taken to move on
            as before.
        """
        start, end = self.at(stamp), self.at(stamp + duration)
        if start is not None and end is not None:
            return start.inverse() @ end
        if self.last is None or not 0.0 < stamp + duration - self.last.stamp <= _EXTRAPOLATED_S:
            return None
        before = self.at(self.last.stamp - duration)
        return None if before is None else before.inverse() @ self.last.T_odom_base


def _has_jumped(last: Odometry, new: Odometry) -> bool:
    passed = new.stamp - last.stamp
    if passed < 0.0:
        return True
    distance = last.T_odom_base.distance_to(new.T_odom_base)
    # After a gap of any length: a restarted odometry is at zero, and the robot has not moved.
    if distance > _JUMP_M and new.T_odom_base.distance_to(SE2.identity()) <= _START_M:
        return True
    turn = angle_error(last.T_odom_base.yaw, new.T_odom_base.yaw)
    return distance > _JUMP_M + _FASTEST_M_S * passed or turn > _JUMP_RAD + _FASTEST_RAD_S * passed
