"""ROS messages to inputs: looked up at their stamps, left out where that is not known."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable
from typing import Any

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import InputError
from firstfix.core.odometry import Signal, SignalKind
from firstfix.io.ros_messages.incoming import (
    to_frame,
    to_grid,
    to_laser_scan,
    to_odometry,
    to_planar,
    to_pose,
    to_pressed,
    to_seconds,
    to_transform,
)
from firstfix.io.ros_messages.robot_frames import RobotFrames
from firstfix.io.ros_messages.tf_buffer import NotKnown
from firstfix.io.saved_pose import map_key
from firstfix.localizer.inputs import Input, NewMap, NoMotionUpdate, PoseHint, Reset
from firstfix.ros.channels import Heard

# Odometry that lags more than this behind the scans comes from another clock, s.
_LAG_S = 1.0
# Scans that wait for the transform of a sensor that moves on its robot.
_MOST_WAITING = 40

_KINDS = {
    Heard.CLIFF: SignalKind.CLIFF,
    Heard.WHEEL_DROP: SignalKind.WHEEL_DROP,
    Heard.BUMPER: SignalKind.BUMPER,
    Heard.KIDNAPPED: SignalKind.PICKED_UP,
}


class MessageConverter:
    """What has been heard so far, as far as it is needed to understand what comes next.

    Parameters
    ----------
    config : AmclConfig
        The names of the frames, and whether only the first map counts.
    complain : callable
        Takes the subject and one sentence for people; called as often as there is reason to.
    """

    def __init__(self, config: AmclConfig, complain: Callable[[str, str], None]) -> None:
        self._config = config
        self._complain = complain
        self._frames = RobotFrames(config.odom_frame_id, config.base_frame_id)
        self._waiting: deque[Any] = deque(maxlen=_MOST_WAITING)
        self._left_out: Counter[str] = Counter()
        self._pressed: set[tuple[Heard, int]] = set()
        self._map_key = self._map_key_before = ""

    def take(self, heard: Heard, message: Any) -> list[Input]:
        """Convert a message.

        Parameters
        ----------
        heard : Heard
            What it is.
        message : message
            None for a request.

        Returns
        -------
        list of Input
            What it means; empty if it says nothing yet, or nothing new.

        Raises
        ------
        InputError
            If it cannot be used.
        """
        if heard is Heard.SCAN:
            return self._take_scan(message)
        if heard is Heard.TF:
            return self._go_on(self._frames.move(map(to_transform, message.transforms)))
        if heard is Heard.ODOM:
            return self._go_on(self._frames.move_by_topic(to_odometry(message)))
        if heard is Heard.TF_STATIC:
            self._frames.fix(map(to_transform, message.transforms))
            return self._go_on(0.0)
        if heard is Heard.MAP:
            return self._take_map(message)
        if heard is Heard.INITIAL_POSE:
            return self._take_hint(message)
        if heard is Heard.INPUT:
            return self.use_map(message) if isinstance(message, NewMap) else [message]
        if heard is Heard.RESET:
            return [self._reset()]
        if heard is Heard.UPDATE:
            return [NoMotionUpdate(self._now)]
        return self._take_event(heard, message)

    def use_map(self, given: NewMap) -> list[Input]:
        """Take a map unless it is the one in use: map servers say the same again and again."""
        key = map_key(given.grid)
        if key == self._map_key:
            return []
        self._map_key_before, self._map_key = self._map_key, key
        return [given]

    def take_back_map(self) -> None:
        """Go back to the map before, because the last one cannot be searched."""
        self._map_key = self._map_key_before

    @property
    def _now(self) -> float:
        """Stamp of the newest odometry, for messages that have none."""
        return max(0.0, self._frames.told_until)

    def _reset(self) -> Reset:
        self._pressed.clear()
        return Reset(self._now)

    def _take_scan(self, message: Any) -> list[Input]:
        stamp, frame = to_seconds(message.header.stamp), to_frame(message.header.frame_id)
        if stamp <= 0.0:
            return self._leave_out("a scan has no stamp: its driver must write one")
        if (back_s := self._frames.set_back_at_scan(stamp)) > 0.0:
            return self._leave_out(f"the clock was set back: scans by {back_s:.2f} s")
        reach = self._frames.reach
        if isinstance(reach, NotKnown):
            odom, base = self._config.odom_frame_id, self._config.base_frame_id
            return self._leave_out(f"odometry ({odom} -> {base}) is not known: {reach.why}")
        place = self._frames.laser_at(frame, stamp)
        if isinstance(place, NotKnown):
            has_room = len(self._waiting) < _MOST_WAITING
            if place.later:
                self._waiting.append(message)
                if has_room:
                    return []
            return self._leave_out(f"the place of the laser is not known: {place.why}")
        if stamp - reach > _LAG_S:
            lag = f"odometry is {stamp - reach:.1f} s behind the scans: do the clocks agree?"
            self._complain("lag", lag)
        scan = to_laser_scan(message, T_base_laser=place.T_base_laser, mounting=place.mounting)
        # A robot that is fixed to its odometry is where it always was, also at this scan.
        return [*(self._frames.odometry_at(stamp) if reach == math.inf else ()), scan]

    def _leave_out(self, why: str) -> list[Input]:
        subject = why.partition(":")[0]
        self._left_out[subject] += 1
        self._complain(subject, f"{self._left_out[subject]} scans left out so far; {why}")
        return []

    def _go_on(self, back_s: float) -> list[Input]:
        """Return what transforms have made known: odometry, and scans that had to wait for them."""
        waiting = [*self._waiting]
        self._waiting.clear()
        inputs: list[Input] = [*self._frames.news()]
        if back_s > 0.0:
            self._complain("clock", f"time went back by {back_s:.1f} s: beginning anew")
            return [self._reset(), *inputs]
        # Of the scans that are known now, the newest wins.
        known = [taken for message in waiting if (taken := self._take_waited(message))]
        return [*inputs, *(known[-1] if known else ())]

    def _take_waited(self, message: Any) -> list[Input]:
        try:
            return self._take_scan(message)
        except InputError as error:  # which odometry must not suffer from
            return self._leave_out(f"a scan cannot be used: {error}")

    def _take_map(self, message: Any) -> list[Input]:
        if self._map_key and self._config.first_map_only:
            return []
        frame, expected = to_frame(message.header.frame_id), self._config.global_frame_id
        if frame != expected:
            self._complain("map frame", f"the map is in {frame!r}, not in {expected!r}: used as is")
        return self.use_map(NewMap(to_seconds(message.header.stamp), to_grid(message)))

    def _take_hint(self, message: Any) -> list[Input]:
        said, expected = to_pose(message), self._config.global_frame_id
        if not said.parent:  # as AMCL does it
            self._complain("hint frame", f"an initial pose names no frame: taken as in {expected}")
        elif said.parent != expected:
            raise InputError(
                expected=f"an initial pose in {expected}",
                received=f"one in {said.parent}",
                remedy="set the fixed frame of the viewer to the frame of the map",
            )
        return [PoseHint(said.stamp or self._now, to_planar(said))]

    def _take_event(self, heard: Heard, message: Any) -> list[Input]:
        which, is_pressed = to_pressed(message)
        was_any = any(kind is heard for kind, _ in self._pressed)
        (self._pressed.add if is_pressed else self._pressed.discard)((heard, which))
        is_any = any(kind is heard for kind, _ in self._pressed)
        return [Signal(self._now, _KINDS[heard], is_any)] if is_any or was_any else []
