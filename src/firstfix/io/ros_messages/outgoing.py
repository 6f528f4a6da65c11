"""Core types to ROS messages.

Nothing here imports ROS. A transport provides a function ``make("package/Type", **fields)``: rospy,
rclpy and rosbags all build messages from the named fields of their definition.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2

# Of x, y and yaw in the 6 x 6 covariance of a message: x, y, z, roll, pitch, yaw.
_PLANAR = np.ix_([0, 1, 5], [0, 1, 5])
_NS = 1_000_000_000
# Of visualization_msgs/Marker.
_ARROW, _TEXT = 0, 9
_ADD, _DELETE_ALL = 0, 3


Make = Callable[..., Any]


class Level(IntEnum):
    """Levels of ``diagnostic_msgs/DiagnosticStatus``."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class ExactTime:
    """Nanoseconds since the epoch, where float seconds would lose some."""

    nanoseconds: int


def header(make: Make, stamp: float | ExactTime, frame: str) -> Any:
    """Build a ``std_msgs/Header``.

    Parameters
    ----------
    make : Make
        Of the transport.
    stamp : float or ExactTime
        Time, s or exact; a time before the epoch becomes 0, the least that messages can hold.
    frame : str
        ``frame_id``.

    Returns
    -------
    message
        The header.
    """
    ns = max(0, stamp.nanoseconds if isinstance(stamp, ExactTime) else _nanoseconds(stamp))
    time = make("builtin_interfaces/Time", sec=ns // _NS, nanosec=ns % _NS)
    return make("std_msgs/Header", stamp=time, frame_id=frame)


def _nanoseconds(seconds: float) -> int:
    # The parts one by one: a product of 1e18 has lost 100 ns.
    whole = math.floor(seconds)
    return whole * _NS + round((seconds - whole) * _NS)


def pose(make: Make, T: SE2) -> Any:
    """Build a ``geometry_msgs/Pose`` on the floor."""
    return make(
        "geometry_msgs/Pose",
        position=make("geometry_msgs/Point", x=T.x, y=T.y, z=0.0),
        orientation=_yaw_rotation(make, T.yaw),
    )


def pose_with_covariance(
    make: Make,
    stamp: float | ExactTime,
    frame: str,
    T_map_base: SE2,
    covariance: NDArray[np.float64],
) -> Any:
    """Build a ``geometry_msgs/PoseWithCovarianceStamped``.

    Parameters
    ----------
    make : Make
        Of the transport.
    stamp : float or ExactTime
        Time, s or exact.
    frame : str
        Frame of the map.
    T_map_base : SE2
        The pose.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame.

    Returns
    -------
    message
        With zeros for z, roll and pitch.
    """
    full = np.zeros((6, 6))
    full[_PLANAR] = covariance
    placed = make(
        "geometry_msgs/PoseWithCovariance", pose=pose(make, T_map_base), covariance=full.ravel()
    )
    return make(
        "geometry_msgs/PoseWithCovarianceStamped", header=header(make, stamp, frame), pose=placed
    )


def pose_array(make: Make, stamp: float | ExactTime, frame: str, poses: Iterable[SE2]) -> Any:
    """Build a ``geometry_msgs/PoseArray`` of poses in a frame."""
    listed = [pose(make, T) for T in poses]
    return make("geometry_msgs/PoseArray", header=header(make, stamp, frame), poses=listed)


def particle_cloud(
    make: Make,
    stamp: float | ExactTime,
    frame: str,
    poses: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> Any:
    """Build a ``nav2_msgs/ParticleCloud``.

    Parameters
    ----------
    make : Make
        Of the transport.
    stamp : float or ExactTime
        Time, s or exact.
    frame : str
        Frame of the map.
    poses : ndarray, shape (n, 3)
        x (m), y (m), yaw (rad).
    weights : ndarray, shape (n,)
        Of each.

    Returns
    -------
    message
        The particles in this order.
    """
    particles = [
        make("nav2_msgs/Particle", pose=pose(make, SE2(x, y, yaw)), weight=weight)
        for (x, y, yaw), weight in zip(poses.tolist(), weights.tolist(), strict=True)
    ]
    return make("nav2_msgs/ParticleCloud", header=header(make, stamp, frame), particles=particles)


def transforms(
    make: Make, stamp: float | ExactTime, parent: str, child: str, T_parent_child: SE2
) -> Any:
    """Build a ``tf2_msgs/TFMessage`` of one transform."""
    T = T_parent_child
    stamped = make(
        "geometry_msgs/TransformStamped",
        header=header(make, stamp, parent),
        child_frame_id=child,
        transform=make(
            "geometry_msgs/Transform",
            translation=make("geometry_msgs/Vector3", x=T.x, y=T.y, z=0.0),
            rotation=_yaw_rotation(make, T.yaw),
        ),
    )
    return make("tf2_msgs/TFMessage", transforms=[stamped])


def diagnostics(
    make: Make,
    stamp: float | ExactTime,
    name: str,
    level: Level,
    message: str,
    values: Mapping[str, str],
) -> Any:
    """Build a ``diagnostic_msgs/DiagnosticArray`` of one status.

    Parameters
    ----------
    make : Make
        Of the transport.
    stamp : float or ExactTime
        Time, s or exact.
    name : str
        Name of the component.
    level : Level
        Severity.
    message : str
        Text for people.
    values : mapping of str to str
        Keys and values for programs.

    Returns
    -------
    message
        The array.
    """
    status = make(
        "diagnostic_msgs/DiagnosticStatus",
        level=level,
        name=name,
        message=message,
        hardware_id="",
        values=[make("diagnostic_msgs/KeyValue", key=k, value=v) for k, v in values.items()],
    )
    return make("diagnostic_msgs/DiagnosticArray", header=header(make, stamp, ""), status=[status])


def place_markers(
    make: Make, stamp: float | ExactTime, frame: str, places: Iterable[tuple[SE2, float]]
) -> Any:
    """Build a ``visualization_msgs/MarkerArray``: an arrow and its probability for each place.

    Parameters
    ----------
    make : Make
        Of the transport; it fills in the fields that are not given.
    stamp : float or ExactTime
        Time, s or exact.
    frame : str
        Frame of the map.
    places : iterable of tuple of SE2 and float
        Pose and probability of each place.

    Returns
    -------
    message
        Begins with a marker that removes those of before.
    """
    top = header(make, stamp, frame)

    def marker(kind: int, number: int, **fields: Any) -> Any:
        return make(
            "visualization_msgs/Marker", header=top, ns="firstfix", id=number, type=kind, **fields
        )

    markers = [marker(_ARROW, 0, action=_DELETE_ALL)]
    for number, (T_map_base, probability) in enumerate(places):
        # An unlikely place stays visible.
        color = make("std_msgs/ColorRGBA", r=0.9, g=0.4, b=0.0, a=0.2 + 0.8 * probability)
        shown = {"action": _ADD, "pose": pose(make, T_map_base), "color": color}
        arrow = make("geometry_msgs/Vector3", x=0.6, y=0.1, z=0.1)
        letter = make("geometry_msgs/Vector3", x=0.0, y=0.0, z=0.3)
        text = f"{probability:.0%}"
        markers.append(marker(_ARROW, 2 * number, scale=arrow, **shown))
        markers.append(marker(_TEXT, 2 * number + 1, scale=letter, text=text, **shown))
    return make("visualization_msgs/MarkerArray", markers=markers)


def laser_scan(make: Make, frame: str, scan: LaserScan) -> Any:
    """Build a ``sensor_msgs/LaserScan``; ``tf`` has the pose of the sensor.

    Parameters
    ----------
    make : Make
        Of the transport.
    frame : str
        Frame of the sensor.
    scan : LaserScan
        The scan.

    Returns
    -------
    message
        Without intensities and beam times.
    """
    n = len(scan.ranges)
    return make(
        "sensor_msgs/LaserScan",
        header=header(make, scan.stamp, frame),
        angle_min=scan.angle_min,
        angle_max=scan.angle_min + (n - 1) * scan.angle_increment,
        angle_increment=scan.angle_increment,
        time_increment=0.0,
        scan_time=0.0,
        range_min=scan.range_min,
        range_max=scan.range_max,
        ranges=np.asarray(scan.ranges, np.float32),
        intensities=np.empty(0, np.float32),
    )


def occupancy_grid(make: Make, stamp: float, frame: str, grid: OccupancyGrid) -> Any:
    """Build a ``nav_msgs/OccupancyGrid``.

    Parameters
    ----------
    make : Make
        Of the transport.
    stamp : float
        Time, s.
    frame : str
        Frame of the map.
    grid : OccupancyGrid
        The map.

    Returns
    -------
    message
        The map, row 0 at the bottom.
    """
    top = header(make, stamp, frame)
    info = make(
        "nav_msgs/MapMetaData",
        map_load_time=top.stamp,
        resolution=grid.resolution,
        width=grid.width,
        height=grid.height,
        origin=pose(make, grid.T_map_grid),
    )
    cells = np.where(grid.unknown, np.int8(-1), grid.cells)
    return make("nav_msgs/OccupancyGrid", header=top, info=info, data=cells.ravel())


def odometry(make: Make, stamp: float, odom: str, base: str, T_odom_base: SE2) -> Any:
    """Build a ``nav_msgs/Odometry`` without speeds and covariances."""
    still = make("geometry_msgs/Vector3", x=0.0, y=0.0, z=0.0)
    return make(
        "nav_msgs/Odometry",
        header=header(make, stamp, odom),
        child_frame_id=base,
        pose=make(
            "geometry_msgs/PoseWithCovariance",
            pose=pose(make, T_odom_base),
            covariance=np.zeros(36),
        ),
        twist=make(
            "geometry_msgs/TwistWithCovariance",
            twist=make("geometry_msgs/Twist", linear=still, angular=still),
            covariance=np.zeros(36),
        ),
    )


def _yaw_rotation(make: Make, yaw: float) -> Any:
    half = 0.5 * yaw
    return make("geometry_msgs/Quaternion", x=0.0, y=0.0, z=math.sin(half), w=math.cos(half))
