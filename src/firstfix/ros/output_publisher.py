"""Outputs of the localizer to ROS messages, each at its rate."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from firstfix.amcl.particles import Particles
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import StampedTransform, to_pose
from firstfix.io.ros_messages.outgoing import (
    Level,
    diagnostics,
    particle_cloud,
    pose_array,
    pose_with_covariance,
    transforms,
)
from firstfix.localizer.outputs import (
    Hypotheses,
    InitialPose,
    MotionRequest,
    Output,
    Status,
    TrackedPose,
)
from firstfix.localizer.states import State
from firstfix.ros.channels import AMCL_POSE, HYPOTHESES, INITIAL_POSE, STATUS, TF
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
    transport : Transport
        Makes and sends the messages.
    """

    def __init__(self, config: NodeConfig, transport: Transport) -> None:
        self._config = config
        self._transport = transport
        self._map = config.global_frame_id
        self._state: State | None = None
        self._status_at = -math.inf
        self._logged_at = -math.inf
        self._cloud_at = -math.inf
        self._motion: MotionRequest | None = None
        self._places = 0
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
            if isinstance(output, InitialPose):
                if self._config.mode is Mode.BOOTSTRAP:
                    self._publish_initial(output)
            elif isinstance(output, TrackedPose):
                self._publish_tracked(output, particles)
            elif isinstance(output, Hypotheses):
                self._publish_places(output.stamp, [place.pose for place in output.places])
            elif isinstance(output, Status):
                self._publish_status(output)

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
        make = self._transport.make
        return pose_with_covariance(make, at.stamp, self._map, at.T_map_base, at.covariance)

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
            until = stamp + config.transform_tolerance
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
        make, poses = self._transport.make, particles.poses()
        if topic.type_name == "geometry_msgs/PoseArray":
            cloud = pose_array(make, stamp, self._map, map(SE2.from_array, poses))
        else:
            cloud = particle_cloud(make, stamp, self._map, poses, particles.weight)
        self._transport.publish(topic, cloud)

    def _publish_places(self, stamp: float, poses: list[SE2]) -> None:
        self._places = len(poses)
        message = pose_array(self._transport.make, stamp, self._map, poses)
        self._transport.publish(HYPOTHESES, message)

    def _publish_status(self, status: Status) -> None:
        if self._places and status.state is not State.DISAMBIGUATING:
            self._publish_places(status.stamp, [])  # one place is left, or none
            self._motion = None
        has_changed = status.state is not self._state
        is_lost = status.state in (State.SEARCHING, State.DISAMBIGUATING)
        if has_changed or (is_lost and _is_due(status.stamp, self._logged_at, _REMIND_S)):
            self._logged_at = status.stamp
            self._transport.log(Severity.INFO, f"{status.state.value}: {status.reason}")
        is_due = _is_due(status.stamp, self._status_at, 1.0 / self._config.status_rate)
        if not has_changed and not is_due:
            return
        self._state, self._status_at = status.state, status.stamp
        message = diagnostics(
            self._transport.make,
            status.stamp,
            "firstfix: localization",
            _LEVELS[status.state],
            f"{status.state.value}: {status.reason}",
            self._values(status),
        )
        self._transport.publish(STATUS, message)

    def _values(self, status: Status) -> dict[str, str]:
        values = {"state": status.state.value, "mode": self._config.mode.value}
        values["hypotheses"] = str(self._places)
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
