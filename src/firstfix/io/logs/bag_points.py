"""Point clouds and depth images of a bag as scans."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.core.points import DEFAULT_BAND_M, scan_from_points
from firstfix.core.scan import LaserScan
from firstfix.io.logs.bag_file import CAMERA_INFO, CLOUD, DEPTH, BagFile
from firstfix.io.ros_messages.points import scan_from_depth, to_points

KINDS = (CLOUD, DEPTH)

Converter = Callable[[Any, float], LaserScan]


def converter(
    bag: BagFile,
    topic: str,
    kind: str,
    T_base_sensor: NDArray[np.float64],
    band: tuple[float, float] = DEFAULT_BAND_M,
) -> Converter:
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
    band : tuple of float
        Lowest and highest height above the base frame, m.

    Raises
    ------
    ScanError
        If there is no camera info beside a depth image.
    """
    if kind == CLOUD:
        return lambda message, stamp: scan_from_points(
            to_points(message), T_base_sensor, band, stamp=stamp
        )
    info = _camera_info(bag, topic)
    return lambda message, stamp: scan_from_depth(message, info, T_base_sensor, band, stamp)


def _camera_info(bag: BagFile, topic: str) -> Any:
    name = f"{topic.rpartition('/')[0]}/camera_info"
    first = next(bag.messages(CAMERA_INFO, [name]), None)
    if first is None:
        raise ScanError(f"The bag has no {name} for the depth images on {topic}. Record both.")
    return first[1]
