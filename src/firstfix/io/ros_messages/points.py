"""Messages of 3D LIDARs and depth cameras to points."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.core.points import DEFAULT_BAND_M, points_from_depth, scan_from_points
from firstfix.core.scan import LaserScan

# Nobody builds a depth camera that reaches farther.
_DEPTH_RANGE_MAX_M = 10.0

# sensor_msgs/PointField: FLOAT32 and FLOAT64.
_FLOATS = {7: "f4", 8: "f8"}

# Encodings of sensor_msgs/Image that are distances: the type, and its unit, m (REP 118).
_DEPTHS = {"16UC1": ("u2", 1e-3), "mono16": ("u2", 1e-3), "32FC1": ("f4", 1.0)}


def to_points(message: Any) -> NDArray[np.float32]:
    """Convert a ``sensor_msgs/PointCloud2``.

    Parameters
    ----------
    message : message
        The cloud: organised or not, of either byte order, with any other fields.

    Returns
    -------
    ndarray of float32, shape (n, 3)
        x, y, z in the frame of the sensor, m; NaN where the cloud has NaN.

    Raises
    ------
    ScanError
        If x, y or z is missing or is no float, or the data is shorter than the sizes it states.
    """
    order = ">" if message.is_bigendian else "<"
    step, width, height = int(message.point_step), int(message.width), int(message.height)
    formats, offsets = [], []
    fields = {field.name: field for field in message.fields}
    for name in "xyz":
        field = fields.get(name)
        if field is None or field.datatype not in _FLOATS:
            there = ", ".join(fields) or "none"
            raise ScanError(
                f"The point cloud has no float field {name} (its fields: {there}). Choose the "
                "topic of a cloud with x, y and z."
            )
        formats.append(order + _FLOATS[field.datatype])
        offsets.append(int(field.offset))
    ends = [o + np.dtype(f).itemsize for o, f in zip(offsets, formats, strict=True)]
    if max(ends) > step:
        raise ScanError(
            f"A point of {step} bytes cannot hold fields up to byte {max(ends)}. Look for the node "
            "that publishes the point cloud."
        )
    rows = _rows(message.data, height, int(message.row_step), width * step, "point cloud")
    kind = np.dtype(
        {"names": list("xyz"), "formats": formats, "offsets": offsets, "itemsize": step}
    )
    cloud = np.ascontiguousarray(rows).view(kind).ravel()
    return np.stack([cloud[name].astype(np.float32) for name in "xyz"], axis=-1)


def to_depth_points(image: Any, info: Any) -> tuple[NDArray[np.float32], tuple[float, float]]:
    """Convert a depth ``sensor_msgs/Image`` by its ``sensor_msgs/CameraInfo``.

    Parameters
    ----------
    image : message
        Encoding 16UC1 (mm) or 32FC1 (m), of either byte order.
    info : message
        Of the same camera; its matrix K is used. The image is taken as rectified.

    Returns
    -------
    points : ndarray of float32, shape (height, width, 3)
        In the optical frame (x to the right, y down, z forward), m; NaN where unknown.
    view : tuple of float
        Angles from the optical axis to the left edge and to the right edge, rad, both positive.

    Raises
    ------
    ScanError
        If the encoding is another, the camera info is that of another image or not calibrated, or
        the data is shorter than the sizes it states.
    """
    if image.encoding not in _DEPTHS:
        raise ScanError(
            f"The encoding {image.encoding!r:.40} is not that of a depth image. Choose a topic "
            f"with one of {', '.join(_DEPTHS)}."
        )
    width, height = int(image.width), int(image.height)
    if (width, height) != (int(info.width), int(info.height)):
        raise ScanError(
            f"The depth image has {width} x {height} pixels, its camera info {info.width} x "
            f"{info.height}. Use the camera info of the same topic."
        )
    # Named K in ROS 1 and k in ROS 2.
    matrix = info.k if hasattr(info, "k") else info.K
    fx, _, cx, _, fy, cy, *_ = (float(number) for number in matrix)
    if not (fx > 0.0 and fy > 0.0 and math.isfinite(fx + fy + cx + cy)):
        raise ScanError("The camera info has no focal length. Calibrate the camera first.")
    kind, unit = _DEPTHS[image.encoding]
    pixel = np.dtype((">" if image.is_bigendian else "<") + kind)
    row_bytes = width * pixel.itemsize
    rows = _rows(image.data, height, int(image.step), row_bytes, "depth image")
    depth = np.ascontiguousarray(rows).view(pixel).astype(np.float32) * np.float32(unit)
    points = points_from_depth(depth.reshape(height, width), (fx, fy), (cx, cy))
    return points, (math.atan2(cx + 0.5, fx), math.atan2(width - 0.5 - cx, fx))


def scan_from_depth(
    image: Any,
    info: Any,
    T_base_sensor: NDArray[np.float64],
    band: tuple[float, float] = DEFAULT_BAND_M,
    stamp: float = 0.0,
) -> LaserScan:
    """Cut a depth image to a scan with the field of view of its camera.

    Parameters
    ----------
    image, info : message
        As in `to_depth_points`.
    T_base_sensor : ndarray, shape (4, 4)
        Pose of the optical frame in the base frame.
    band : tuple of float
        Lowest and highest height above the base frame, m.
    stamp : float
        Time of the scan, s.

    Raises
    ------
    ScanError
        If the image cannot be used.
    """
    points, (left, right) = to_depth_points(image, info)
    # The optical axis in the base frame: z of the optical frame.
    heading = math.atan2(T_base_sensor[1, 2], T_base_sensor[0, 2])
    return scan_from_points(
        points,
        T_base_sensor,
        band,
        view=(heading - right, heading + left),
        range_max=_DEPTH_RANGE_MAX_M,
        stamp=stamp,
    )


def _rows(data: Any, height: int, row_step: int, row_bytes: int, what: str) -> NDArray[np.uint8]:
    """Return the bytes of each row without the padding behind it, shape (height, row_bytes)."""
    raw = np.frombuffer(data, np.uint8) if not isinstance(data, np.ndarray) else data
    row_step = row_step if height > 1 else max(row_step, row_bytes)
    needed = row_step * (height - 1) + row_bytes if height * row_bytes else 0
    if row_step < row_bytes or len(raw) < needed:
        raise ScanError(
            f"The {what} states {height} rows of {row_bytes} bytes each {row_step} bytes, but has "
            f"{len(raw)} bytes. Look for the node that publishes it."
        )
    if needed == 0:
        return np.empty((0, row_bytes), np.uint8)
    padded = np.zeros(height * row_step, np.uint8)
    padded[:needed] = raw.view(np.uint8)[:needed]
    return padded.reshape(height, row_step)[:, :row_bytes]
