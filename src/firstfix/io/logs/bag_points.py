"""Point clouds and depth images of a bag as scans."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.core.points import scan_from_points
from firstfix.core.scan import LaserScan
from firstfix.io.logs.bag_file import CAMERA_INFO, CLOUD, DEPTH, BagFile
from firstfix.io.ros_messages.points import to_depth_points, to_points

KINDS = (CLOUD, DEPTH)

# Nobody builds a depth camera that reaches farther.
_DEPTH_RANGE_MAX_M = 10.0

Converter = Callable[[Any, float], LaserScan]


def converter(bag: BagFile, topic: str, kind: str, T_base_sensor: NDArray[np.float64]) -> Converter:
    """Return the function that makes a scan of a message and its stamp.

    Parameters
    ----------
    bag : BagFile
        Open; has the camera info of a depth image.
    topic : str
        Topic of the messages.
    kind : str
        One of `KINDS`.
    T_base_sensor : ndarray, shape (4, 4)
        Pose of the sensor.

    Raises
    ------
    ScanError
        If there is no camera info beside a depth image.
    """
    if kind == CLOUD:
        return lambda message, stamp: scan_from_points(
            to_points(message), T_base_sensor, stamp=stamp
        )
    info = _camera_info(bag, topic)
    # The optical axis in the base frame: z of the optical frame.
    heading = math.atan2(T_base_sensor[1, 2], T_base_sensor[0, 2])

    def convert(message: Any, stamp: float) -> LaserScan:
        points, (left, right) = to_depth_points(message, info)
        return scan_from_points(
            points,
            T_base_sensor,
            view=(heading - right, heading + left),
            range_max=_DEPTH_RANGE_MAX_M,
            stamp=stamp,
        )

    return convert


def _camera_info(bag: BagFile, topic: str) -> Any:
    name = f"{topic.rpartition('/')[0]}/camera_info"
    first = next(bag.messages(CAMERA_INFO, [name]), None)
    if first is None:
        raise ScanError(f"The bag has no {name} for the depth images on {topic}. Record both.")
    return first[1]
