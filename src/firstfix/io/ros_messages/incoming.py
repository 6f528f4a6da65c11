"""ROS messages to core types.

Nothing here imports ROS: a message is any object with the fields of its definition, from rospy,
rclpy or a bag.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.errors import InputError, MapError, ScanError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2

# A quaternion with a smaller norm is not a rotation.
MIN_NORM = 1e-3

FARTHEST_M = 1e9
"""Largest translation of a transform, m; sums of such numbers stay finite."""

_MAP_REMEDY = "look for the node that publishes the map"


class StampedTransform(NamedTuple):
    """``T_parent_child`` at one time, in 3D.

    Parameters
    ----------
    parent, child : str
        Frames, without a leading slash.
    stamp : float
        Time, s.
    translation : tuple of float
        x, y, z, m.
    rotation : tuple of float
        Unit quaternion x, y, z, w; four NaN if the message has none.
    """

    parent: str
    child: str
    stamp: float
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


def to_seconds(stamp: Any) -> float:
    """Read a time.

    Parameters
    ----------
    stamp : message
        ROS 2 (``sec``, ``nanosec``) or rospy (``secs``, ``nsecs``).

    Returns
    -------
    float
        s.
    """
    try:
        return float(stamp.sec + 1e-9 * stamp.nanosec)
    except AttributeError:
        return float(stamp.secs + 1e-9 * stamp.nsecs)


def to_nanoseconds(stamp: Any) -> int:
    """Read a time as nanoseconds, exactly; see `to_seconds`."""
    try:
        return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
    except AttributeError:
        return int(stamp.secs) * 1_000_000_000 + int(stamp.nsecs)


def to_frame(name: str) -> str:
    """Return the name of a frame without the leading slash of old ROS 1 nodes."""
    return name.removeprefix("/")


def to_laser_scan(
    message: Any,
    *,
    T_base_laser: SE2,
    mounting: Mounting,
    stamp: float | None = None,
    sensor: str = "",
) -> LaserScan:
    """Convert a ``sensor_msgs/LaserScan``.

    Beams follow ``angle_increment`` from ``angle_min``, whatever its sign; ``angle_max`` is not
    used: drivers disagree whether it belongs to the last beam.

    Parameters
    ----------
    message : message
        The scan.
    T_base_laser : SE2
        Pose of the sensor on the robot.
    mounting : Mounting
        Upright or upside down.
    stamp : float or None
        Time to use instead of the one in the header, s.
    sensor : str
        Name of the sensor.

    Returns
    -------
    LaserScan
        The scan, with a copy of the ranges.

    Raises
    ------
    ScanError
        If the message cannot describe a scan.
    """
    return LaserScan(
        # rclpy has an array.array here, rospy a tuple, rosbags an ndarray.
        ranges=np.asarray(message.ranges),
        angle_min=float(message.angle_min),
        angle_increment=float(message.angle_increment),
        range_min=float(message.range_min),
        range_max=float(message.range_max),
        stamp=to_seconds(message.header.stamp) if stamp is None else stamp,
        T_base_laser=T_base_laser,
        mounting=mounting,
        time_increment=to_time_increment(message),
        sensor=sensor,
    )


def to_time_increment(message: Any) -> float:
    """Return the time between two beams of a ``sensor_msgs/LaserScan``, s; 0 if it is unknown.

    Some drivers send ``scan_time`` only: the time of a full turn.
    """
    step = float(getattr(message, "time_increment", 0.0))
    if 0.0 < step < math.inf:
        return step
    turn = float(getattr(message, "scan_time", 0.0))
    if not 0.0 < turn < math.inf:
        return 0.0
    return turn * abs(float(message.angle_increment)) / FULL_TURN


def to_covariance(message: Any) -> NDArray[np.float64]:
    """Convert the covariance of a ``geometry_msgs/PoseWithCovarianceStamped``.

    Returns
    -------
    ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad).

    Raises
    ------
    InputError
        If it is no covariance.
    """
    c = np.asarray(message.pose.covariance, np.float64)
    planar = np.full((3, 3), np.nan)
    if c.size == 36:
        planar = c.reshape(6, 6)[np.ix_([0, 1, 5], [0, 1, 5])]
    if np.isfinite(planar).all() and (np.linalg.eigvalsh(planar + planar.T) >= -1e-9).all():
        symmetric: NDArray[np.float64] = 0.5 * (planar + planar.T)
        return symmetric
    raise InputError(
        "The covariance of a pose is none: its 36 numbers must be finite, and no variance "
        "negative. Look for the node that publishes it."
    )


def to_grid(message: Any) -> OccupancyGrid:
    """Convert a ``nav_msgs/OccupancyGrid``.

    Parameters
    ----------
    message : message
        The map; the yaw of its origin is used, a tilt is ignored.

    Returns
    -------
    OccupancyGrid
        The map, with a copy of the cells.

    Raises
    ------
    MapError
        If the message cannot describe a map.
    """
    info = message.info
    cells, height, width = _cells(message.data), int(info.height), int(info.width)
    if cells.size != height * width:
        raise MapError(
            expected=f"{width} x {height} cells",
            received=f"{cells.size}",
            remedy=_MAP_REMEDY,
        )
    x, y, yaw = _project(
        (info.origin.position.x, info.origin.position.y), _map_rotation(info.origin.orientation)
    )
    if not _is_place(x, y, yaw):
        raise MapError(
            expected="an origin of the map with a position and a rotation",
            received=f"position ({x}, {y}) and a yaw of {yaw}",
            remedy=_MAP_REMEDY,
        )
    with np.errstate(over="ignore"):  # infinite then, which OccupancyGrid refuses
        # 0.05 travels as 0.05000000074505806: the shortest number with the same float32 is meant.
        resolution = float(str(np.float32(info.resolution)))
    return OccupancyGrid(cells.reshape(height, width), resolution, SE2(x, y, yaw))


def to_transform(message: Any) -> StampedTransform:
    """Convert a ``geometry_msgs/TransformStamped``.

    Parameters
    ----------
    message : message
        One transform, such as an element of ``tf2_msgs/TFMessage.transforms``.

    Returns
    -------
    StampedTransform
        ``T_parent_child``, of ``frame_id`` and ``child_frame_id``.
    """
    placed = message.transform
    return _stamped(message.header, message.child_frame_id, placed.translation, placed.rotation)


def to_odometry(message: Any) -> StampedTransform:
    """Convert a ``nav_msgs/Odometry``.

    Parameters
    ----------
    message : message
        The odometry; its twist and covariances are not used.

    Returns
    -------
    StampedTransform
        ``T_odom_base``, of ``frame_id`` and ``child_frame_id``.
    """
    pose = message.pose.pose
    return _stamped(message.header, message.child_frame_id, pose.position, pose.orientation)


def to_pose(message: Any) -> StampedTransform:
    """Convert a ``geometry_msgs/PoseWithCovarianceStamped``.

    Parameters
    ----------
    message : message
        A pose; its covariance is not used.

    Returns
    -------
    StampedTransform
        From ``frame_id`` to a child without a name.
    """
    pose = message.pose.pose
    return _stamped(message.header, "", pose.position, pose.orientation)


def to_pressed(message: Any) -> tuple[int, bool]:
    """Convert a CliffEvent, WheelDropEvent or BumperEvent of a Kobuki, or a ``std_msgs/Bool``.

    Parameters
    ----------
    message : message
        The event.

    Returns
    -------
    tuple of int and bool
        Number of the sensor (left, centre, right; 0 for a Bool), and whether it is active: a cliff,
        a dropped wheel, a pressed bumper.

    Raises
    ------
    InputError
        If it is another message: the subscriber of ROS 1 accepts any type.
    """
    if isinstance(getattr(message, "data", None), (bool, np.bool_)):
        return 0, bool(message.data)
    for name in ("sensor", "wheel", "bumper"):
        if hasattr(message, name) and hasattr(message, "state"):
            return int(getattr(message, name)), bool(message.state)
    raise InputError(
        expected="an event of a Kobuki, or a std_msgs/Bool",
        received=f"a {type(message).__name__.strip('_')} without their fields",
        remedy="remap the topic to another name",
    )


def to_planar(transform: StampedTransform) -> SE2:
    """Project a transform onto the floor: x, y and the direction of the x axis.

    Parameters
    ----------
    transform : StampedTransform
        Of a level robot.

    Returns
    -------
    SE2
        ``T_parent_child``.

    Raises
    ------
    ScanError
        If a number of the transform is not finite, or beyond `FARTHEST_M`.
    """
    x, y, yaw = planar(transform)
    if not _is_place(x, y, yaw):
        raise ScanError(
            expected=f"a transform of finite numbers from {transform.parent} to {transform.child}",
            received=f"{transform.translation} and {transform.rotation}",
            remedy="look for the node that publishes it",
        )
    return SE2(x, y, yaw)


def planar(transform: StampedTransform) -> tuple[float, float, float]:
    """Return x (m), y (m), yaw (rad) of `to_planar`; NaN where unknown."""
    return _project(transform.translation[:2], transform.rotation)


def _cells(data: Any) -> NDArray[np.int8]:
    """Copy the cells of a map, read-only; rclpy has an array.array, rospy a tuple or bytes."""
    is_raw = isinstance(data, (bytes, bytearray, memoryview))
    cells = np.frombuffer(data, np.int8) if is_raw else np.asarray(data)
    limits = np.iinfo(np.int8)
    is_whole = cells.dtype.kind in "iu" and cells.ndim == 1
    if cells.size and not (is_whole and limits.min <= cells.min() <= cells.max() <= limits.max):
        raise MapError(
            expected="cells from -1 (unknown) over 0 (free) to 100 (occupied)",
            received=f"{cells.dtype} cells"
            + (f" from {cells.min()} to {cells.max()}" if is_whole else ""),
            remedy=_MAP_REMEDY,
        )
    copy = cells.astype(np.int8)
    copy.flags.writeable = False  # or the grid would copy it once more
    return copy


def _map_rotation(rotation: Any) -> tuple[float, float, float, float]:
    """Return a unit quaternion; all zeros mean no rotation, as in RViz and AMCL."""
    if rotation.x == rotation.y == rotation.z == rotation.w == 0.0:
        return 0.0, 0.0, 0.0, 1.0
    return _normalized(rotation)


def _is_place(x: float, y: float, yaw: float) -> bool:
    return abs(x) <= FARTHEST_M and abs(y) <= FARTHEST_M and math.isfinite(yaw)


def _project(
    translation: tuple[float, float], rotation: tuple[float, float, float, float]
) -> tuple[float, float, float]:
    x, y, z, w = rotation
    # atan2(R[1, 0], R[0, 0]): direction of the x axis, also upside down.
    yaw = math.atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    return float(translation[0]), float(translation[1]), yaw


def _normalized(rotation: Any) -> tuple[float, float, float, float]:
    q = (float(rotation.x), float(rotation.y), float(rotation.z), float(rotation.w))
    norm = math.hypot(*q)
    # For an unknown rotation some nodes send zeros, others NaN.
    x, y, z, w = (v / norm for v in q) if MIN_NORM < norm < math.inf else (math.nan,) * 4
    return x, y, z, w


def _stamped(header: Any, child: str, translation: Any, rotation: Any) -> StampedTransform:
    return StampedTransform(
        parent=to_frame(header.frame_id),
        child=to_frame(child),
        stamp=to_seconds(header.stamp),
        translation=(float(translation.x), float(translation.y), float(translation.z)),
        rotation=_normalized(rotation),
    )
