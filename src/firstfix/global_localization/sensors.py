"""Several sensors of one robot as one observation; beams keep their own origins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from firstfix.core.angles import FULL_TURN
from firstfix.core.arguments import as_pose
from firstfix.core.errors import InputError
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import LONGEST_M, Beams, usable_beams

# Odometry is taken at its word between the scans of one observation: a short way only.
MOST_MOTION_M = 1.0

_SAME_DIRECTION_RAD = 0.1

# A sensor that covers this area sees enough for one scan to decide. UNIQUE answers to single scans,
# cut to smaller sensors, are wrong in 0.3 % at 360 degrees x 8 m (201 m²), in 0.6 % at 180 degrees
# x 8 m (100 m²), in 1.5 % at 360 degrees x 3.5 m (38 m²) and in 5 % at 60 degrees x 5 m (13 m²).
_ENOUGH_M2 = 150.0

# So does a scan of a sensor that covers a third of this, if it looks to all sides and has walls
# around it: decisions/0005 has the measurements.
_SMALLER_M2 = 50.0
_ALL_SIDES_RAD = math.radians(200.0)
_ENOUGH_CONTOUR_M = 6.0


def at_one_time(scans: Sequence[LaserScan], T_odom_base: Sequence[SE2]) -> tuple[LaserScan, ...]:
    """Move the sensors to where they were, seen from the base at the newest scan.

    Parameters
    ----------
    scans : sequence of LaserScan
        Of one robot, in any order.
    T_odom_base : sequence of SE2
        Odometry at each of them.

    Returns
    -------
    tuple of LaserScan
        The same measurements; poses of the sensors in the base frame at the newest stamp.

    Raises
    ------
    InputError
        If the numbers of scans and poses differ, or the robot has moved more than `MOST_MOTION_M`.
    """
    if len(scans) != len(T_odom_base):
        raise InputError(
            expected="one pose T_odom_base for each scan",
            received=f"{len(scans)} scans and {len(T_odom_base)} poses",
            remedy="take the odometry at the stamp of each scan",
        )
    poses = [as_pose(pose, "T_odom_base") for pose in T_odom_base]
    newest = max(range(len(scans)), key=lambda i: (scans[i].stamp, i))
    farthest = max(pose.distance_to(poses[newest]) for pose in poses)
    if farthest > MOST_MOTION_M:
        raise InputError(
            expected=f"scans of one place, at most {MOST_MOTION_M:g} m from each other",
            received=f"odometry over {farthest:.1f} m",
            remedy="pass one scan of each sensor, taken at about the same time",
        )
    T_base_odom = poses[newest].inverse()
    return tuple(
        scan
        if pose == poses[newest]
        else replace(scan, T_base_laser=T_base_odom @ pose @ scan.T_base_laser)
        for scan, pose in zip(scans, poses, strict=True)
    )


def instants(scans: Sequence[LaserScan]) -> list[list[int]]:
    """Put scans that follow each other together, up to the next one of a sensor that they have.

    Parameters
    ----------
    scans : sequence of LaserScan
        Of one robot, in the order of time.

    Returns
    -------
    list of list of int
        Indices; no sensor twice in a group.
    """
    groups: list[list[int]] = []
    for i, scan in enumerate(scans):
        if groups and not any(_is_same_sensor(scans[j], scan) for j in groups[-1]):
            groups[-1].append(i)
        else:
            groups.append([i])
    return groups


def _is_same_sensor(a: LaserScan, b: LaserScan) -> bool:
    """Compare name, pose and direction; the number of beams of one sensor may vary."""
    if a.sensor or b.sensor:
        return a.sensor == b.sensor
    middle_a, middle_b = (float(scan.bearings[[0, -1]].mean()) for scan in (a, b))
    return a.T_base_laser == b.T_base_laser and abs(middle_a - middle_b) < _SAME_DIRECTION_RAD


def joint_beams(scans: Sequence[LaserScan]) -> tuple[LaserScan, Beams]:
    """Put the valid beams of several sensors together; each keeps its own origin.

    Parameters
    ----------
    scans : sequence of LaserScan
        Of one robot at one time; at least one, in any order.

    Returns
    -------
    LaserScan
        The scan with most hits. Its sensor frame is the frame of the beams.
    Beams
        Of all scans.
    """
    reference, *others = sorted(scans, key=_by_hits_and_place)
    parts = [usable_beams(reference)]
    if not others:
        return reference, parts[0]
    origins = [parts[0].starts]
    T_laser_base = reference.T_base_laser.inverse()
    for scan in others:
        T_laser_other, beams = T_laser_base @ scan.T_base_laser, usable_beams(scan)
        parts.append(Beams(beams.bearings + T_laser_other.yaw, beams.ranges, beams.hit))
        origins.append(np.tile([T_laser_other.x, T_laser_other.y], (len(beams), 1)))
    return reference, Beams(
        bearings=np.concatenate([beams.bearings for beams in parts]),
        ranges=np.concatenate([beams.ranges for beams in parts]),
        hit=np.concatenate([beams.hit for beams in parts]),
        origins=np.concatenate(origins),
        turns=sum(map(covered_angle, scans)) / FULL_TURN,
    )


def _by_hits_and_place(scan: LaserScan) -> tuple[float, ...]:
    # The place decides between equals, so that the order of the scans never counts.
    return -float(np.count_nonzero(scan.hit)), *scan.T_base_laser, float(scan.bearings[0])


def covered_angle(scan: LaserScan) -> float:
    """Return the angle in which a scan has valid beams, with or without a return, rad."""
    return abs(scan.angle_increment) * int(np.count_nonzero(scan.hit | scan.no_return))


def see_enough(scans: Sequence[LaserScan]) -> bool:
    """Tell whether sensors cover so much that one scan of each can be enough for UNIQUE."""
    return covered_m2(scans) >= _ENOUGH_M2


def are_surrounded(scans: Sequence[LaserScan]) -> bool:
    """Tell whether scans of smaller sensors show so much of the walls around that they can be, too.

    The length of what a scan shows is the sum over its hits of range and angle between beams.
    """
    angle = sum(covered_angle(scan) for scan in scans)
    contour = sum(
        abs(scan.angle_increment) * float(scan.ranges[scan.hit].clip(max=LONGEST_M).sum())
        for scan in scans
    )
    sides = angle >= _ALL_SIDES_RAD and contour >= _ENOUGH_CONTOUR_M
    return sides and covered_m2(scans) >= _SMALLER_M2


def covered_m2(scans: Sequence[LaserScan]) -> float:
    """Return the area that sensors cover in an open space, m²."""
    return sum(0.5 * covered_angle(s) * min(s.range_max, LONGEST_M) ** 2 for s in scans)
