"""The frames of one robot: odometry and the pose of its laser, from the messages so far."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import StampedTransform
from firstfix.io.ros_messages.tf_buffer import LookupFailure, TransformBuffer
from firstfix.io.ros_messages.transforms import flat

# Messages of one publisher are reordered by less than this, s; more means a clock set back.
_REORDERING_S = 1.0
# If scans go back too, odometry that is this late means a clock set back by less than that, s.
_BEHIND_S = 0.05
# Odometry is extrapolated by its period at most, and by no more than this, s.
_MAX_EXTRAPOLATION_S = 0.05
# The clock of the topic ``odom``; that of a transform is named after its child.
_TOPIC = "/odom"


class RobotFrames:
    """Transforms and odometry so far.

    Parameters
    ----------
    odom, base : str
        The frames of odometry and of the robot.
    """

    def __init__(self, odom: str, base: str) -> None:
        self._odom = odom
        self._base = base
        self._tf = TransformBuffer()
        # Separate: its frames need not agree with the tree of tf.
        self._topic = TransformBuffer()
        self._topic_child = base
        self._last_scan_at: defaultdict[str, float] = defaultdict(lambda: -math.inf)
        # Stamps of the last odometry that was returned, extrapolated or not, and measured.
        self._known_until = self._measured_until = -math.inf
        self._recent: tuple[Odometry, ...] = ()  # the last two that were measured
        self._newest: defaultdict[str, float] = defaultdict(lambda: -math.inf)
        self._behind_s = 0.0  # of the last odometry, behind the newest of its publisher

    @property
    def known_until(self) -> float:
        """Stamp of the last odometry that was returned, s; minus infinity before the first."""
        return self._known_until

    @property
    def reach(self) -> float | LookupFailure:
        """Stamp until which odometry is known, s; infinite if fixed transforms join the base."""
        reach = math.inf
        for buffer, target, source in self._path():
            newest = buffer.newest(target, source)
            if isinstance(newest, LookupFailure):
                return newest
            reach = min(reach, newest)
        return reach

    def add_static(self, transforms: Iterable[StampedTransform]) -> None:
        """Add transforms that hold for all times."""
        for transform in transforms:
            self._tf.add_static(transform)

    def add_moving(self, transforms: Iterable[StampedTransform]) -> float:
        """Add transforms that move.

        Parameters
        ----------
        transforms : iterable of StampedTransform
            From ``tf``; the stamps of those between odometry and base are compared.

        Returns
        -------
        float
            How far the clock was set back, s; 0 if it was not. Older motion is discarded then.
        """
        back = 0.0
        links = self._tf.links(self._odom, self._base)
        clocks = () if isinstance(links, LookupFailure) else links
        for new in transforms:
            if new.child in clocks:
                back = max(back, self._clock_step(new.child, new.stamp))
            else:  # it may become one of them
                self._newest[new.child] = max(self._newest[new.child], new.stamp)
            self._tf.add(new)
        return back

    def add_odometry(self, odometry: StampedTransform) -> float:
        """Add a ``nav_msgs/Odometry``; ``tf`` has priority over it.

        Parameters
        ----------
        odometry : StampedTransform
            From `to_odometry`; without a child it is that of the base.

        Returns
        -------
        float
            See `add_moving`.
        """
        if not isinstance(self._tf.links(self._odom, self._base), LookupFailure):
            return 0.0
        back = self._clock_step(_TOPIC, odometry.stamp)
        self._topic_child = odometry.child or self._base
        self._topic.add(odometry._replace(child=self._topic_child))
        return back

    def clock_step_at_scan(self, stamp: float, frame: str = "") -> float:
        """Detect that the clock was set back by less than a second.

        One message may be reordered; odometry and scans that both go back are not.

        Parameters
        ----------
        stamp : float
            Stamp of a scan, s.
        frame : str
            Frame of its sensor: scans of several sensors need not come in their order.

        Returns
        -------
        float
            How far scans went back, s; 0 if the clock was not set back. If it was, older motion is
            discarded: of two odometries with one stamp, either may be meant.
        """
        back, self._last_scan_at[frame] = self._last_scan_at[frame] - stamp, stamp
        if back <= 0.0 or self._behind_s <= _BEHIND_S:
            return 0.0
        self._discard_motion()
        return back

    def new_odometry(self) -> list[Odometry]:
        """Return the odometry that was added since the last call: one message or none."""
        reach = self.reach
        if isinstance(reach, LookupFailure) or not self._measured_until < reach < math.inf:
            return []
        odometry = self._at(reach)
        self._measured_until = reach
        self._recent = (*self._recent[-1:], *odometry)
        if reach < self._known_until:
            return []  # older than what was extrapolated
        self._known_until = reach
        return odometry

    def odometry_at(self, stamp: float) -> list[Odometry]:
        """Return the odometry at a time within `reach`; none where it is unknown."""
        odometry = self._at(stamp)
        if odometry:
            self._known_until = stamp
        return odometry

    def extrapolated(self, stamp: float) -> list[Odometry]:
        """Return the odometry up to one period after the newest, at its last velocity.

        Parameters
        ----------
        stamp : float
            Stamp of a scan, s.

        Returns
        -------
        list of Odometry
            One; none if the newest odometry is too old, or not older than the scan.
        """
        if len(self._recent) < 2 or stamp <= self._known_until:
            return []
        before, last = self._recent
        period, ahead = last.stamp - before.stamp, stamp - last.stamp
        if not 0.0 < ahead <= min(period, _MAX_EXTRAPOLATION_S):
            return []
        step, share = before.T_odom_base.inverse() @ last.T_odom_base, ahead / period
        moved = SE2(share * step.x, share * step.y, share * step.yaw)
        self._known_until = stamp
        return [Odometry(stamp, last.T_odom_base @ moved)]

    @property
    def speed(self) -> tuple[float, float]:
        """Of the last odometry, m/s and rad/s, both at least 0."""
        if len(self._recent) < 2:
            return 0.0, 0.0
        before, last = self._recent
        step, passed = before.T_odom_base.inverse() @ last.T_odom_base, last.stamp - before.stamp
        return math.hypot(step.x, step.y) / passed, abs(step.yaw) / passed

    def sensor_at(self, frame: str, stamp: float) -> NDArray[np.float64] | LookupFailure:
        """Look up the pose of a sensor on the robot, shape (4, 4), at the stamp of its message."""
        return self._tf.at(self._base, frame, stamp)

    def _at(self, stamp: float) -> list[Odometry]:
        T_odom_base = np.eye(4)
        for buffer, target, source in self._path():
            T_target_source = buffer.at(target, source, stamp)
            if isinstance(T_target_source, LookupFailure):
                return []
            T_odom_base = T_odom_base @ T_target_source
        return [Odometry(stamp, flat(T_odom_base))]

    def _path(self) -> tuple[tuple[TransformBuffer, str, str], ...]:
        """Return the steps from odometry to the base, each with its buffer."""
        by_tf = (self._tf, self._odom, self._base)
        if not self._topic.frames or not isinstance(self._tf.links(*by_tf[1:]), LookupFailure):
            return (by_tf,)
        child = self._topic_child
        return (self._topic, self._odom, child), (self._tf, child, self._base)

    def _clock_step(self, clock: str, stamp: float) -> float:
        """Return how far a clock was set back, s; if it was, discard older motion.

        A message is compared with those of its own publisher: two publishers start at their own
        times, and each has its own delay.
        """
        self._behind_s = self._newest[clock] - stamp
        back = self._behind_s if self._behind_s > _REORDERING_S else 0.0
        if back > 0.0:
            self._discard_motion()
        self._newest[clock] = max(self._newest[clock], stamp)
        return back

    def _discard_motion(self) -> None:
        self._tf.discard_moving()
        self._topic.discard_moving()
        self._known_until = self._measured_until = -math.inf
        self._recent = ()
        self._newest.clear()
        self._behind_s = 0.0
