"""ROS messages to inputs of the localizer."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from firstfix.core.errors import InputError
from firstfix.core.odometry import Signal, SignalKind
from firstfix.io.ros_messages.incoming import (
    to_covariance,
    to_frame,
    to_grid,
    to_odometry,
    to_planar,
    to_pose,
    to_pressed,
    to_seconds,
    to_transform,
)
from firstfix.io.ros_messages.robot_frames import RobotFrames
from firstfix.io.ros_messages.tf_buffer import LookupFailure
from firstfix.io.saved_pose import map_key
from firstfix.localizer.inputs import (
    Input,
    MapHint,
    NewMap,
    NoMotionUpdate,
    PoseHint,
    PositionFix,
    Reset,
)
from firstfix.ros.channels import SENSORS, Channel
from firstfix.ros.exact_stamps import ExactStamps
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.sensor_messages import SensorMessages

# Odometry that stays behind the scans by more than this, for this time, has another clock, s.
_LAG_S = 1.0
# Scans that wait for the transform of a sensor that moves on its robot.
_MAX_WAITING = 40
# Characters of a hash that names a map.
_ID_LENGTH = 12

_KINDS = {
    Channel.CLIFF: SignalKind.CLIFF,
    Channel.WHEEL_DROP: SignalKind.WHEEL_DROP,
    Channel.BUMPER: SignalKind.BUMPER,
    Channel.KIDNAPPED: SignalKind.PICKED_UP,
}


@dataclass(frozen=True, slots=True)
class _Map:
    """The map in use: key of its content, and name."""

    key: str
    map_id: str


_NO_MAP = _Map("", "")


class MessageConverter:
    """Converts messages one by one, with the transforms and the map that came before.

    A scan is dropped where the pose of its sensor or the odometry is unknown; nothing is guessed.

    Parameters
    ----------
    config : NodeConfig
        Frames, and `first_map_only`.
    stamps : ExactStamps
        Collects the stamps of scans.
    warn : callable
        Takes a subject and one sentence for people; may be called as often as there is reason to.
    """

    def __init__(
        self, config: NodeConfig, stamps: ExactStamps, warn: Callable[[str, str], None]
    ) -> None:
        self._config = config
        self._stamps = stamps
        self._warn = warn
        self._frames = RobotFrames(config.odom_frame_id, config.base_frame_id)
        self._sensors = SensorMessages(config, warn)
        self._waiting: deque[tuple[Channel, Any]] = deque(maxlen=_MAX_WAITING)
        self._dropped: Counter[str] = Counter()
        self._lags_since: float | None = None
        self._pressed: set[tuple[Channel, int]] = set()
        self._map = self._map_before = _NO_MAP

    def convert(self, channel: Channel, message: Any) -> list[Input]:
        """Convert a message.

        Parameters
        ----------
        channel : Channel
            Where it came from.
        message : message
            None for a request.

        Returns
        -------
        list of Input
            Empty if the message is incomplete without others, or repeats what is known.

        Raises
        ------
        InputError
            If it cannot be used.
        """
        if channel in SENSORS:
            return self._convert_scan(channel, message)
        if channel is Channel.CAMERA_INFO:
            self._sensors.keep_camera(message)
            return []
        if channel is Channel.POSITION_FIX:
            return self._convert_fix(message)
        if channel is Channel.TF:
            transforms = map(to_transform, message.transforms)
            return self._after_transforms(self._frames.add_moving(transforms))
        if channel is Channel.ODOM:
            return self._after_transforms(self._frames.add_odometry(to_odometry(message)))
        if channel is Channel.TF_STATIC:
            self._frames.add_static(map(to_transform, message.transforms))
            return self._after_transforms(0.0)
        if channel is Channel.MAP:
            return self._convert_map(message)
        if channel is Channel.INITIAL_POSE:
            return self._convert_hint(message)
        if channel is Channel.INPUT:
            return self._convert_input(message)
        if channel in (Channel.MAP_HINT, Channel.RESET, Channel.UPDATE):
            return [self._request(channel, message)]
        return self._convert_event(channel, message)

    def _request(self, channel: Channel, message: Any) -> Input:
        if channel is Channel.MAP_HINT:
            return MapHint(self._now, str(message.data), "map_hint")
        return self._reset() if channel is Channel.RESET else NoMotionUpdate(self._now)

    def use_map(self, given: NewMap) -> list[Input]:
        """Return a map with its name, unless it is the one in use: map servers repeat theirs."""
        key = map_key(given.grid)
        if self._map.key == key and given.map_id in ("", self._map.map_id):
            return []
        own_name = self._config.map_id if self._map is _NO_MAP else ""
        named = _Map(key, own_name or given.map_id or key[:_ID_LENGTH])
        self._map_before, self._map = self._map, named
        return [replace(given, map_id=named.map_id)]

    def restore_map(self) -> None:
        """Return to the previous map: the last one cannot be searched."""
        self._map = self._map_before

    @property
    def _now(self) -> float:
        """Stamp of the newest odometry, for messages without a stamp."""
        return max(0.0, self._frames.known_until)

    def _reset(self) -> Reset:
        self._pressed.clear()
        return Reset(self._now)

    def _convert_input(self, given: Input) -> list[Input]:
        if not isinstance(given, NewMap):
            return [given]
        return self.use_map(replace(given, stamp=max(given.stamp, self._now)))

    def _convert_scan(self, channel: Channel, message: Any) -> list[Input]:
        stamp, frame = self._stamps.add(message.header.stamp), to_frame(message.header.frame_id)
        if stamp <= 0.0:
            return self._drop("a scan has no stamp: its driver must write one")
        if (back_s := self._frames.clock_step_at_scan(stamp, frame)) > 0.0:
            return self._drop(f"the clock was set back: scans by {back_s:.2f} s")
        reach = self._frames.reach
        if isinstance(reach, LookupFailure):
            odom, base = self._config.odom_frame_id, self._config.base_frame_id
            return self._drop(f"odometry ({odom} -> {base}) is unknown: {reach.why}")
        pose = self._sensors.pose_of(message, stamp, self._frames)
        if isinstance(pose, LookupFailure):
            has_room = len(self._waiting) < _MAX_WAITING
            if pose.later:
                self._waiting.append((channel, message))
                if has_room:
                    return []
            return self._drop(f"the pose of the laser is unknown: {pose.why}")
        self._check_lag(stamp, reach)
        scan = self._sensors.scan(channel, message, stamp, pose)
        if channel is Channel.SCAN:
            self._sensors.check_skew(message, self._frames)
        # Where fixed transforms join odometry and base, odometry is known at any time.
        is_fixed = reach == math.inf
        odometry = self._frames.odometry_at if is_fixed else self._frames.extrapolated
        return [*odometry(stamp), scan]

    def _check_lag(self, stamp: float, reach: float) -> None:
        """Warn of odometry that stays behind the scans; at the start it may just be late."""
        lag_s = stamp - reach
        if lag_s <= _LAG_S:
            self._lags_since = None
        elif self._lags_since is None or stamp < self._lags_since:
            self._lags_since = stamp
        elif stamp - self._lags_since >= _LAG_S:
            lag = f"odometry is {lag_s:.1f} s behind the scans: do the clocks agree?"
            self._warn("lag", lag)

    def _drop(self, why: str) -> list[Input]:
        subject = why.partition(":")[0]
        self._dropped[subject] += 1
        self._warn(subject, f"{self._dropped[subject]} scans dropped so far; {why}")
        return []

    def _after_transforms(self, back_s: float) -> list[Input]:
        """Return the new odometry, and the newest scan that waited for these transforms."""
        waiting = [*self._waiting]
        self._waiting.clear()
        inputs: list[Input] = [*self._frames.new_odometry()]
        if back_s > 0.0:
            self._warn("clock", f"time went back by {back_s:.1f} s: starting over")
            return [self._reset(), *inputs]
        ready: dict[str, list[Input]] = {}  # the newest of each sensor
        for channel, message in waiting:
            if scan := self._convert_waiting(channel, message):
                ready[message.header.frame_id] = scan
        return [*inputs, *(given for scan in ready.values() for given in scan)]

    def _convert_waiting(self, channel: Channel, message: Any) -> list[Input]:
        try:
            return self._convert_scan(channel, message)
        except InputError as error:  # the odometry of the same message is still good
            return self._drop(f"a scan cannot be used: {error}")

    def _convert_map(self, message: Any) -> list[Input]:
        if self._map is not _NO_MAP and self._config.first_map_only:
            return []
        frame, expected = to_frame(message.header.frame_id), self._config.global_frame_id
        if frame != expected:
            self._warn("map frame", f"the map is in {frame!r}, not in {expected!r}: used as it is")
        return self.use_map(NewMap(to_seconds(message.header.stamp), to_grid(message)))

    def _convert_hint(self, message: Any) -> list[Input]:
        hint, expected = to_pose(message), self._config.global_frame_id
        if not hint.parent:  # AMCL does the same
            self._warn("hint frame", f"an initial pose names no frame: taken as in {expected}")
        elif hint.parent != expected:
            raise InputError(
                expected=f"an initial pose in {expected}",
                received=f"one in {hint.parent}",
                remedy="set the fixed frame of the viewer to the frame of the map",
            )
        return [PoseHint(hint.stamp or self._now, to_planar(hint))]

    def _convert_fix(self, message: Any) -> list[Input]:
        fix, expected = to_pose(message), self._config.global_frame_id
        if fix.parent != expected:
            raise InputError(
                expected=f"a position fix in {expected}",
                received=f"one in {fix.parent or 'no frame'}",
                remedy="transform it to the frame of the map",
            )
        return [PositionFix(fix.stamp or self._now, to_planar(fix), to_covariance(message))]

    def _convert_event(self, channel: Channel, message: Any) -> list[Input]:
        which, is_pressed = to_pressed(message)
        was_any = any(kind is channel for kind, _ in self._pressed)
        (self._pressed.add if is_pressed else self._pressed.discard)((channel, which))
        is_any = any(kind is channel for kind, _ in self._pressed)
        return [Signal(self._now, _KINDS[channel], is_any)] if is_any or was_any else []
