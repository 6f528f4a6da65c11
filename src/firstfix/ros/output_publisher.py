"""Outputs of the localizer to ROS messages, each at its rate."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Any

from firstfix.amcl.particles import Particles
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import StampedTransform, to_pose
from firstfix.io.ros_messages.outgoing import (
    Level,
    diagnostics,
    occupancy_grid,
    particle_cloud,
    place_markers,
    pose_array,
    pose_with_covariance,
    transforms,
)
from firstfix.localizer.outputs import (
    Hypotheses,
    InitialPose,
    MapSwitched,
    MotionRequest,
    Output,
    Status,
    TrackedPose,
)
from firstfix.localizer.states import State
from firstfix.ros.channels import (
    AMCL_POSE,
    HYPOTHESES,
    INITIAL_POSE,
    LOCALIZED,
    MAP,
    MAP_ID,
    MARKERS,
    STATUS,
    TF,
)
from firstfix.ros.exact_stamps import ExactStamps
from firstfix.ros.node_config import Mode, NodeConfig
from firstfix.ros.transport import Severity, Transport

# So many of the own poses may still be on their way back through the topic.
_OWN_POSES = 10
# The log repeats the reason this often while the robot is not localized, s.
_REMIND_S = 10.0

_LEVELS = {
    State.NO_MAP: Level.ERROR,
    State.SEARCHING: Level.WARN,
    State.DISAMBIGUATING: Level.WARN,
    State.VERIFYING_HINT: Level.WARN,
    State.LIFTED: Level.WARN,
    State.LOCALIZED: Level.OK,
}


class OutputPublisher:
    """Publishes the outputs of a localizer.

    Parameters
    ----------
    config : NodeConfig
        Mode, frames, rates.
    stamps : ExactStamps
        The exact stamps of recent scans.
    transport : Transport
        Makes and sends the messages.
    """

    def __init__(self, config: NodeConfig, stamps: ExactStamps, transport: Transport) -> None:
        self._config = config
        self._stamps = stamps
        self._transport = transport
        self._map = config.global_frame_id
        self._status: Status | None = None
        self._is_localized: bool | None = None
        self._status_at = -math.inf
        self._logged_at = -math.inf
        self._cloud_at = -math.inf
        self._motion: MotionRequest | None = None
        self._places: list[tuple[SE2, float]] = []
        self._own_poses: deque[StampedTransform] = deque(maxlen=_OWN_POSES)
        self._pose_subscribers = 0

    def publish(self, outputs: list[Output], particles: Particles | None) -> None:
        """Publish.

        Parameters
        ----------
        outputs : list of Output
            Those of one input.
        particles : Particles or None
            The particles now.
        """
        if any(isinstance(output, Hypotheses) for output in outputs):
            # Before the status, which contains it.
            self._motion = next((o for o in outputs if isinstance(o, MotionRequest)), None)
        for output in outputs:
            if isinstance(output, MapSwitched):
                self.publish_map(output)
            elif isinstance(output, InitialPose):
                if self._config.mode is Mode.BOOTSTRAP:
                    self._publish_initial(output)
            elif isinstance(output, TrackedPose):
                self._publish_tracked(output, particles)
            elif isinstance(output, Hypotheses):
                self._publish_places(output.stamp, [(p.pose, p.probability) for p in output.places])
            elif isinstance(output, Status):
                self._publish_status(output)

    def publish_map_id(self, map_id: str) -> None:
        """Publish the name of the map in use."""
        self._transport.publish(MAP_ID, self._transport.make("std_msgs/String", data=map_id))

    def publish_map(self, switched: MapSwitched) -> None:
        """Publish the name of the map that all later poses are in, then the map.

        The map itself is left to a map server, where one is told to load it.
        """
        self.publish_map_id(switched.map_id)
        if self._config.load_map_service:
            return
        topic = replace(MAP, name=self._config.map_topic)
        grid = occupancy_grid(self._transport.make, switched.stamp, self._map, switched.grid)
        self._transport.publish(topic, grid)

    def is_own(self, message: Any) -> bool:
        """Return whether an initial pose was published here."""
        return to_pose(message) in self._own_poses

    def _publish_initial(self, found: InitialPose | TrackedPose) -> None:
        """Hand a pose over to the AMCL that runs beside."""
        message = self._pose_message(found)
        self._own_poses.append(to_pose(message))
        self._pose_subscribers = self._transport.subscriber_count(INITIAL_POSE)
        self._transport.publish(INITIAL_POSE, message)

    def _pose_message(self, at: InitialPose | TrackedPose) -> Any:
        make, stamp = self._transport.make, self._stamps.exact(at.stamp)
        return pose_with_covariance(make, stamp, self._map, at.T_map_base, at.covariance)

    def _publish_tracked(self, tracked: TrackedPose, particles: Particles | None) -> None:
        if self._config.mode is Mode.BOOTSTRAP:
            before, self._pose_subscribers = (
                self._pose_subscribers,
                self._transport.subscriber_count(INITIAL_POSE),
            )
            if self._pose_subscribers > before:
                self._publish_initial(tracked)  # to an AMCL that started later
            return
        make, config, stamp = self._transport.make, self._config, tracked.stamp
        self._transport.publish(AMCL_POSE, self._pose_message(tracked))
        if config.tf_broadcast:
            # Stamped ahead, as in AMCL, so that it is valid until the next one.
            until = self._stamps.exact(stamp, config.transform_tolerance)
            T = tracked.T_map_odom
            self._transport.publish(TF, transforms(make, until, self._map, config.odom_frame_id, T))
        if particles is not None:
            self._publish_particles(stamp, particles)

    def _publish_particles(self, stamp: float, particles: Particles) -> None:
        rate, topic = self._config.cloud_rate, self._transport.particles
        is_due = rate > 0.0 and _is_due(stamp, self._cloud_at, 1.0 / rate)
        if not is_due or not self._transport.subscriber_count(topic):
            return
        self._cloud_at = stamp
        make, exact, poses = self._transport.make, self._stamps.exact(stamp), particles.poses()
        if topic.type_name == "geometry_msgs/PoseArray":
            cloud = pose_array(make, exact, self._map, map(SE2.from_array, poses))
        else:
            cloud = particle_cloud(make, exact, self._map, poses, particles.weight)
        self._transport.publish(topic, cloud)

    def _publish_places(self, stamp: float, places: list[tuple[SE2, float]]) -> None:
        self._places = places
        make, exact = self._transport.make, self._stamps.exact(stamp)
        poses = [pose for pose, _ in places]
        self._transport.publish(HYPOTHESES, pose_array(make, exact, self._map, poses))
        if self._transport.subscriber_count(MARKERS):
            self._transport.publish(MARKERS, place_markers(make, exact, self._map, places))

    def _publish_status(self, status: Status) -> None:
        if self._places and status.state is not State.DISAMBIGUATING:
            self._publish_places(status.stamp, [])  # one place is left, or none
            self._motion = None
        has_changed = self._status is None or status.state is not self._status.state
        is_lost = status.state in (State.SEARCHING, State.DISAMBIGUATING)
        if has_changed or (is_lost and _is_due(status.stamp, self._logged_at, _REMIND_S)):
            self._logged_at = status.stamp
            self._transport.log(Severity.INFO, f"{status.state.value}: {status.reason}")
        is_due = _is_due(status.stamp, self._status_at, 1.0 / self._config.status_rate)
        if not has_changed and not is_due:
            return
        self._status, self._status_at = status, status.stamp
        text = f"{status.state.value}: {status.reason}"
        self._send_status(status, _LEVELS[status.state], text)
        self._send_localized(is_localized=status.state is State.LOCALIZED)

    def publish_stale(self, silence_s: float) -> None:
        """Publish that the last status is stale, because no scan has come for a time (s)."""
        if self._status is None:
            return
        text = f"STALE: no scan for {silence_s:.1f} s; the state was {self._status.state.value}"
        later = replace(self._status, stamp=self._status.stamp + silence_s)
        self._transport.log(Severity.WARNING, text)
        self._send_status(later, Level.STALE, text, state="STALE")
        self._send_localized(is_localized=False)
        self._status = None  # the next one is published, whatever its state

    def _send_status(self, status: Status, level: Level, text: str, state: str = "") -> None:
        make, stamp = self._transport.make, self._stamps.exact(status.stamp)
        name, values = "firstfix: localization", self._values(status)
        values["state"] = state or status.state.value
        self._transport.publish(STATUS, diagnostics(make, stamp, name, level, text, values))

    def _send_localized(self, *, is_localized: bool) -> None:
        if is_localized is not self._is_localized:
            self._is_localized = is_localized
            message = self._transport.make("std_msgs/Bool", data=is_localized)
            self._transport.publish(LOCALIZED, message)

    def _values(self, status: Status) -> dict[str, str]:
        values = {"state": "", "mode": self._config.mode.value}
        values["hypotheses"] = str(len(self._places))
        if (evidence := status.evidence) is not None:
            for name in ("explained", "short", "through_wall", "unknown"):
                values[name] = f"{getattr(evidence, name):.3f}"
            values["beams"] = str(evidence.beams)
        if self._places and self._motion is not None:
            values["turn_rad"] = f"{self._motion.turn:.2f}"
            values["ahead_m"] = f"{self._motion.ahead:.2f}"
        return values


def _is_due(stamp: float, last: float, pause_s: float) -> bool:
    """Return whether a pause is over; also if the clock was set back."""
    return not 0.0 <= stamp - last < pause_s
