"""The frames of one robot, as its messages tell: where its laser is, how odometry moves it."""

from __future__ import annotations

import math
from collections.abc import Iterable

from firstfix.core.odometry import Odometry
from firstfix.formats.messages import StampedTransform
from firstfix.formats.sensor_place import SensorPlace, place_of
from firstfix.formats.tf_buffer import NotKnown, TransformBuffer
from firstfix.formats.transforms import flat

# Messages of one link may overtake each other by so much, s; more, and the clock was set back.
_OVERTAKING_S = 1.0


class RobotFrames:
    """What ``tf`` has told so far.

    Parameters
    ----------
    odom, base : str
        The frames of odometry and of the robot.
    """

    def __init__(self, odom: str, base: str) -> None:
        self._odom = odom
        self._base = base
        self._buffer = TransformBuffer()
        self._newest: dict[str, float] = {}  # stamp of each frame that moves
        self._told_until = -math.inf
        self._is_topic_used = False

    @property
    def told_until(self) -> float:
        """Stamp of the last odometry that was told, s; minus infinity before the first."""
        return self._told_until

    @property
    def reach(self) -> float | NotKnown:
        """Until when odometry is known, s; infinite for a robot that is fixed to its odometry."""
        return self._buffer.newest(self._odom, self._base)

    def fix(self, transforms: Iterable[StampedTransform]) -> None:
        """Take in transforms that hold for all times."""
        for transform in transforms:
            self._buffer.add_static(transform)

    def move(self, transforms: Iterable[StampedTransform]) -> float:
        """Take in transforms that move.

        Parameters
        ----------
        transforms : iterable of StampedTransform
            From ``tf``.

        Returns
        -------
        float
            By how much the clock was set back, s; 0 if it was not. What moved before that is
            forgotten.
        """
        back = 0.0
        for new in transforms:
            if self._is_topic_used and new.child == self._base:
                # Two sources must not be mixed, and tf is the one that was asked for.
                self._is_topic_used = False
                self._buffer.forget_moves()
            back = max(back, self._add(new))
        return back

    def move_by_topic(self, odometry: StampedTransform) -> float:
        """Take in ``nav_msgs/Odometry``, which counts only where ``tf`` does not tell.

        Parameters
        ----------
        odometry : StampedTransform
            From `firstfix.formats.messages.to_odometry`.

        Returns
        -------
        float
            As `move` does.
        """
        if not self._is_topic_used and not isinstance(self.reach, NotKnown):
            return 0.0
        self._is_topic_used = True
        return self._add(odometry)

    def news(self) -> list[Odometry]:
        """Return the odometry that has become known since the last call: one message or none."""
        reach = self.reach
        if isinstance(reach, NotKnown) or not self._told_until < reach < math.inf:
            return []
        return self.odometry_at(reach)

    def odometry_at(self, stamp: float) -> list[Odometry]:
        """Return the odometry at a time, as told; none where it is not known."""
        T_odom_base = self._buffer.at(self._odom, self._base, stamp)
        if isinstance(T_odom_base, NotKnown):
            return []
        self._told_until = stamp
        return [Odometry(stamp, flat(T_odom_base))]

    def laser_at(self, frame: str, stamp: float) -> SensorPlace | NotKnown:
        """Look up where a sensor sits.

        Parameters
        ----------
        frame : str
            Its frame.
        stamp : float
            Time of its scan, s.

        Returns
        -------
        SensorPlace or NotKnown
            Where, or why not.

        Raises
        ------
        ScanError
            If it does not scan level.
        """
        T_base_laser = self._buffer.at(self._base, frame, stamp)
        if isinstance(T_base_laser, NotKnown):
            return T_base_laser
        return place_of(frame, T_base_laser)

    def _add(self, new: StampedTransform) -> float:
        newest = self._newest.get(new.child, -math.inf)
        back = newest - new.stamp
        if back <= _OVERTAKING_S:
            back = 0.0
            self._newest[new.child] = max(newest, new.stamp)
        else:
            self._buffer.forget_moves()
            self._newest = {new.child: new.stamp}
            self._told_until = -math.inf
        self._buffer.add(new)
        return back
