"""Scans of a moving robot, straightened by odometry."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory

# A longer sweep is a wrong time_increment.
LONGEST_SWEEP_S = 1.0

# Past its end, odometry is continued for this long by its last motion.
_EXTRAPOLATED_S = 0.2


def deskew(scan: LaserScan, odometry: Trajectory) -> LaserScan:
    """Straighten a scan whose beams were taken one after another while the robot moved.

    Parameters
    ----------
    scan : LaserScan
        With ``stamp`` at its first beam, as in ``sensor_msgs/LaserScan``, and ``time_increment``.
    odometry : Trajectory
        ``T_odom_base`` over time. Up to 0.2 s after its end, the robot is taken to move on as
        before.

    Returns
    -------
    LaserScan
        What a sensor at the place of the first beam would have measured all at once: beams with
        other ranges and uneven bearings. The scan itself where ``time_increment`` is 0, or the
        odometry is unknown.

    Examples
    --------
    >>> path = ff.Trajectory([0.0, 1.0], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    >>> wall = ff.LaserScan([3.0, 2.95], -0.01, 0.02, 0.1, 10.0, stamp=0.5, time_increment=0.05)
    >>> ff.deskew(wall, path).ranges.round(2)  # ahead, while the robot drives 5 cm towards it
    array([3., 3.], dtype=float32)
    """
    sweep_s = scan.time_increment * (len(scan) - 1)
    if not 0.0 < sweep_s <= LONGEST_SWEEP_S:
        return scan
    motion = _motion(odometry, scan.stamp, sweep_s)
    return scan if motion is None else straighten(scan, motion)


def straighten(scan: LaserScan, motion: SE2) -> LaserScan:
    """Straighten a scan by the motion of the base from its first beam to its last.

    Parameters
    ----------
    scan : LaserScan
        Its beams are evenly spaced in time.
    motion : SE2
        Pose of the base at the last beam, seen from the base at the first; velocities are taken as
        constant.

    Returns
    -------
    LaserScan
        Seen from the place of the first beam.
    """
    # Float32 is good to 0.01 mm at 30 m, and takes half the time.
    share = np.linspace(0.0, 1.0, len(scan), dtype=np.float32)
    turn = share * np.float32(motion.yaw)
    bearings = scan.bearings.astype(np.float32) + turn
    # Where the sensor is at each beam, in the frame of the sensor at the first beam.
    x, y, _ = scan.T_base_laser
    cos, sin = np.cos(turn), np.sin(turn)
    moved_x = share * motion.x + (cos - 1.0) * x - sin * y
    moved_y = share * motion.y + sin * x + (cos - 1.0) * y
    c, s = math.cos(scan.T_base_laser.yaw), math.sin(scan.T_base_laser.yaw)
    reach = np.where(scan.hit, scan.ranges, np.float32(0.0))
    ends_x = c * moved_x + s * moved_y + reach * np.cos(bearings)
    ends_y = c * moved_y - s * moved_x + reach * np.sin(bearings)
    # A hit stays one, however near it is to a limit of the sensor.
    farthest = np.nextafter(np.float32(scan.range_max), np.float32(0.0))
    nearest = max(scan.range_min, float(np.finfo(np.float32).tiny))
    ranges = np.clip(np.sqrt(ends_x**2 + ends_y**2), nearest, farthest)
    return replace(
        scan,
        ranges=np.where(scan.hit, ranges, scan.ranges),
        directions=np.where(scan.hit, np.arctan2(ends_y, ends_x), bearings),
        time_increment=0.0,
    )


def _motion(odometry: Trajectory, stamp: float, sweep_s: float) -> SE2 | None:
    """Return the motion of the base during a sweep; None where it is unknown."""
    start, end = odometry.at(stamp), odometry.at(stamp + sweep_s)
    if start is not None and end is not None:
        return start.inverse() @ end
    last = float(odometry.stamps[-1]) if len(odometry) else -np.inf
    if not 0.0 < stamp + sweep_s - last <= _EXTRAPOLATED_S:
        return None
    before, newest = odometry.at(last - sweep_s), odometry.at(last)
    return None if before is None or newest is None else before.inverse() @ newest
