"""The frames of one robot, as its messages tell: where its laser is, how odometry moves it."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from firstfix.core.odometry import Odometry
from firstfix.io.ros_messages.incoming import StampedTransform
from firstfix.io.ros_messages.sensor_place import SensorPlace, place_of
from firstfix.io.ros_messages.tf_buffer import LookupFailure, TransformBuffer
from firstfix.io.ros_messages.transforms import flat

# Messages may overtake each other by so much, s; more, and the clock was set back.
_REORDERING_S = 1.0
# Unless scans go back, too: what comes so much later than it should, s, was not overtaken then.
_BEHIND_S = 0.05


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
        self._tf = TransformBuffer()
        # By itself: its frames need not agree with the tree of tf.
        self._topic = TransformBuffer()
        self._topic_child = base
        self._known_until = -math.inf
        # Stamps of the last messages, the newest or not.
        self._last_odometry_at, self._last_scan_at = math.inf, -math.inf

    @property
    def known_until(self) -> float:
        """Stamp of the last odometry that was told, s; minus infinity before the first."""
        return self._known_until

    @property
    def reach(self) -> float | LookupFailure:
        """Until when odometry is known, s; infinite for a robot that is fixed to its odometry."""
        reach = math.inf
        for buffer, target, source in self._path():
            newest = buffer.newest(target, source)
            if isinstance(newest, LookupFailure):
                return newest
            reach = min(reach, newest)
        return reach

    def add_static(self, transforms: Iterable[StampedTransform]) -> None:
        """Take in transforms that hold for all times."""
        for transform in transforms:
            self._tf.add_static(transform)

    def add_moving(self, transforms: Iterable[StampedTransform]) -> float:
        """Take in transforms that move.

        Parameters
        ----------
        transforms : iterable of StampedTransform
            From ``tf``; only those between odometry and base tell the time.

        Returns
        -------
        float
            By how much the clock was set back, s; 0 if it was not. What moved before that is
            forgotten.
        """
        back = 0.0
        links = self._tf.links(self._odom, self._base)
        clocks = () if isinstance(links, LookupFailure) else links
        for new in transforms:
            if new.child in clocks:
                back = max(back, self._clock_step(new.stamp))
            self._tf.add(new)
        return back

    def add_odometry(self, odometry: StampedTransform) -> float:
        """Take in ``nav_msgs/Odometry``, which counts only where ``tf`` does not tell.

        Parameters
        ----------
        odometry : StampedTransform
            From `to_odometry`; without a child it is that of the base.

        Returns
        -------
        float
            As `move` does.
        """
        if not isinstance(self._tf.links(self._odom, self._base), LookupFailure):
            return 0.0
        back = self._clock_step(odometry.stamp)
        self._topic_child = odometry.child or self._base
        self._topic.add(odometry._replace(child=self._topic_child))
        return back

    def clock_step_at_scan(self, stamp: float) -> float:
        """Take note of a scan, and see whether the clock of the robot was set back a little.

        One message may be overtaken by another; odometry and scans that both go back are not.

        Parameters
        ----------
        stamp : float
            Of the scan, s.

        Returns
        -------
        float
            By how much scans went back, s; 0 if the clock was not set back. If it was, what moved
            before is forgotten: of two odometries of one time, nobody knows which is meant.
        """
        back, self._last_scan_at = self._last_scan_at - stamp, stamp
        if back <= 0.0 or self._known_until - self._last_odometry_at <= _BEHIND_S:
            return 0.0
        self._discard_motion()
        return back

    def new_odometry(self) -> list[Odometry]:
        """Return the odometry that has become known since the last call: one message or none."""
        reach = self.reach
        if isinstance(reach, LookupFailure) or not self._known_until < reach < math.inf:
            return []
        return self.odometry_at(reach)

    def odometry_at(self, stamp: float) -> list[Odometry]:
        """Return the odometry at a time, as told; none where it is not known."""
        T_odom_base = np.eye(4)
        for buffer, target, source in self._path():
            T_target_source = buffer.at(target, source, stamp)
            if isinstance(T_target_source, LookupFailure):
                return []
            T_odom_base = T_odom_base @ T_target_source
        self._known_until = stamp
        return [Odometry(stamp, flat(T_odom_base))]

    def laser_at(self, frame: str, stamp: float) -> SensorPlace | LookupFailure:
        """Look up where a sensor sits.

        Parameters
        ----------
        frame : str
            Its frame.
        stamp : float
            Time of its scan, s.

        Returns
        -------
        SensorPlace or LookupFailure
            Where, or why not.

        Raises
        ------
        ScanError
            If it does not scan level.
        """
        T_base_laser = self._tf.at(self._base, frame, stamp)
        if isinstance(T_base_laser, LookupFailure):
            return T_base_laser
        return place_of(frame, T_base_laser)

    def _path(self) -> tuple[tuple[TransformBuffer, str, str], ...]:
        """Return the steps from odometry to the base, with who knows them."""
        by_tf = (self._tf, self._odom, self._base)
        if not self._topic.frames or not isinstance(self._tf.links(*by_tf[1:]), LookupFailure):
            return (by_tf,)
        child = self._topic_child
        return (self._topic, self._odom, child), (self._tf, child, self._base)

    def _clock_step(self, stamp: float) -> float:
        """Return by how much the clock was set back, s; if it was, forget what moved."""
        self._last_odometry_at = stamp
        back = self._known_until - stamp
        if back <= _REORDERING_S:
            return 0.0
        self._discard_motion()
        return back

    def _discard_motion(self) -> None:
        self._tf.discard_moving()
        self._topic.discard_moving()
        self._known_until = -math.inf
