"""The scan lines of a CARMEN log."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.scan import MAX_BEAMS
from firstfix.core.se2 import SE2

# CARMEN's own limit for the SICK lasers of its time (`maximum_range = 80.0` where it reads
# FLASER). They report codes from 81.83 m (0x1FF7) up when nothing came back.
SICK_RANGE_MAX = 80.0


@dataclass(frozen=True, eq=False, slots=True)
class ScanLine:
    """What one line says about one scan.

    Parameters
    ----------
    ranges : ndarray of float32, shape (n,)
        m.
    angle_min, angle_increment : float
        rad.
    range_max : float
        m.
    laser_pose, robot_pose : SE2
        In the odometry frame; the laser's may be one that a SLAM program corrected.
    stamps : tuple of float
        Time of the scan and of its logging, s; NaN where the line has none.
    """

    ranges: NDArray[np.float32]
    angle_min: float
    angle_increment: float
    range_max: float
    laser_pose: SE2
    robot_pose: SE2
    stamps: tuple[float, float]


def parse_old_laser(fields: list[str]) -> ScanLine:
    """Parse FLASER or RLASER: n, ranges, laser pose, robot pose, stamp, host, stamp.

    The line does not say where the beams point. As CARMEN does, 180 beams are 181 at 1° from
    -90° without the last one, 360 are 361 at 0.5°; 400 and 401 are the 100° mode at 0.25°, here
    centred (CARMEN starts that at -90° too, which no SICK does); any other number spans 180°.

    Parameters
    ----------
    fields : list of str
        The words of the line.

    Returns
    -------
    ScanLine
        The scan.

    Raises
    ------
    ValueError, LookupError, InputError
        If the line is malformed.
    """
    n = _count(fields[1], least=1)
    field_of_view, steps = {
        180: (180.0, 180),
        360: (180.0, 360),
        400: (100.0, 400),
        401: (100.0, 400),
    }.get(n, (180.0, max(n - 1, 1)))
    return _scan_line(
        ranges=fields[2 : 2 + n],
        angles=(-math.radians(field_of_view) / 2.0, math.radians(field_of_view) / steps),
        range_max=SICK_RANGE_MAX,
        poses=fields[2 + n : 8 + n],
        tail=fields[8 + n :],
    )


def parse_robot_laser(fields: list[str]) -> ScanLine:
    """Parse ROBOTLASER1: config, n, ranges, m, remissions, poses, motion, stamp, host, stamp.

    Parameters
    ----------
    fields : list of str
        The words of the line.

    Returns
    -------
    ScanLine
        The scan.

    Raises
    ------
    ValueError, LookupError, InputError
        If the line is malformed.
    """
    n = _count(fields[8], least=1)
    m = _count(fields[9 + n], least=0)
    after = 10 + n + m
    return _scan_line(
        ranges=fields[9 : 9 + n],
        angles=(float(fields[2]), float(fields[4])),
        # Logs declare 81.92 m for a SICK, above its own codes for "nothing".
        range_max=min(float(fields[5]), SICK_RANGE_MAX),
        poses=fields[after : after + 6],
        tail=fields[after + 11 :],
    )


PARSERS: dict[str, Callable[[list[str]], ScanLine]] = {
    "FLASER": parse_old_laser,
    "ROBOTLASER1": parse_robot_laser,
    "RLASER": parse_old_laser,
}


def _scan_line(
    *,
    ranges: list[str],
    angles: tuple[float, float],
    range_max: float,
    poses: list[str],
    tail: list[str],
) -> ScanLine:
    x, y, yaw, robot_x, robot_y, robot_yaw = map(float, poses)
    with np.errstate(over="ignore"):
        return ScanLine(
            ranges=np.array(ranges, dtype=np.float32),
            angle_min=angles[0],
            angle_increment=angles[1],
            range_max=range_max,
            laser_pose=SE2(x, y, yaw),
            robot_pose=SE2(robot_x, robot_y, robot_yaw),
            stamps=(_stamp(tail, 0), _stamp(tail, 2)),
        )


def _count(word: str, *, least: int) -> int:
    n = int(word)
    if not least <= n <= MAX_BEAMS:
        raise ValueError(f"{n} readings")
    return n


def _stamp(tail: list[str], index: int) -> float:
    return float(tail[index]) if index < len(tail) else math.nan
