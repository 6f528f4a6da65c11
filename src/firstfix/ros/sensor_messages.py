"""Messages of lasers, 3D LIDARs and depth cameras to scans."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.core.points import scan_from_points
from firstfix.core.scan import LaserScan
from firstfix.io.ros_messages.incoming import to_frame, to_laser_scan, to_time_increment
from firstfix.io.ros_messages.points import scan_from_depth, to_points
from firstfix.io.ros_messages.robot_frames import RobotFrames
from firstfix.io.ros_messages.sensor_place import place_of
from firstfix.io.ros_messages.tf_buffer import LookupFailure
from firstfix.ros.channels import Channel
from firstfix.ros.node_config import NodeConfig

# A robot that is slower than this distorts its scans by less than maps are precise.
_SLOW_M_S = 0.1
_SLOW_RAD_S = 0.1


class SensorMessages:
    """Makes scans of sensor messages, with the camera info that came before.

    Parameters
    ----------
    config : NodeConfig
        Poses of sensors, band of heights, deskew.
    warn : callable
        Takes a subject and one sentence for people.
    """

    def __init__(self, config: NodeConfig, warn: Callable[[str, str], None]) -> None:
        self._config = config
        self._places = config.sensor_poses
        self._band = config.band
        self._warn = warn
        self._cameras: dict[str, Any] = {}
        self._unknown_skew: set[str] = set()

    def keep_camera(self, info: Any) -> None:
        """Keep the camera info for the depth images of its frame."""
        self._cameras[to_frame(info.header.frame_id)] = info

    def pose_of(
        self, message: Any, stamp: float, frames: RobotFrames
    ) -> NDArray[np.float64] | LookupFailure:
        """Return the pose of a sensor on the robot, shape (4, 4): as given, else by ``tf``."""
        frame = to_frame(message.header.frame_id)
        given = self._places.get(frame, self._places.get(""))
        if given is not None:
            return given
        return frames.sensor_at(self._config.laser_frame or frame, stamp)

    def scan(
        self, channel: Channel, message: Any, stamp: float, T_base_sensor: NDArray[np.float64]
    ) -> LaserScan:
        """Make a scan of a message; its sensor has the name of its frame.

        Parameters
        ----------
        channel : Channel
            SCAN, CLOUD or DEPTH.
        message : message
            Of this channel.
        stamp : float
            Its stamp, s.
        T_base_sensor : ndarray, shape (4, 4)
            Pose of the sensor.

        Raises
        ------
        ScanError
            If the message cannot be used.
        """
        frame = to_frame(message.header.frame_id)
        if channel is Channel.SCAN:
            laser = place_of(frame, T_base_sensor)
            return to_laser_scan(
                message, T_base_laser=laser.T_base_laser, mounting=laser.mounting, sensor=frame
            )
        if channel is Channel.CLOUD:
            points = to_points(message)
            scan = scan_from_points(points, T_base_sensor, self._band, stamp=stamp)
        else:
            if frame not in self._cameras:
                raise ScanError(
                    f"No camera info of {frame} has come for its depth images. It must be "
                    "published as camera_info beside the topic of the images, with the same frame."
                )
            info = self._cameras[frame]
            scan = scan_from_depth(message, info, T_base_sensor, self._band, stamp)
        return replace(scan, sensor=frame)

    def check_skew(self, message: Any, frames: RobotFrames) -> None:
        """Say once for each laser that its skew is unknown, when the robot begins to move."""
        frame = to_frame(message.header.frame_id)
        speed, rate = frames.speed
        is_slow = speed < _SLOW_M_S and rate < _SLOW_RAD_S
        if not self._config.localizer.scans.deskew or is_slow or frame in self._unknown_skew:
            return
        if to_time_increment(message) == 0.0:
            self._unknown_skew.add(frame)
            text = (
                f"the scans of {frame} have neither time_increment nor scan_time, so they are not "
                "straightened while the robot moves: set them in the driver, or deskew to false"
            )
            self._warn(f"skew of {frame}", text)
