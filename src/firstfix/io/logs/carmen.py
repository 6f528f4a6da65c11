"""Recordings from CARMEN logs, the format of the classic public data sets."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.io.logs.carmen_log import KINDS, CarmenLog, ScanLine, read_log
from firstfix.io.logs.checks import (
    SORTED_AHEAD,
    ascending,
    check_count,
    check_max_scans,
    located,
    sorting_notes,
)
from firstfix.io.ros_messages.poses import alike

# Poses in logs are rounded; a SLAM correction soon exceeds this.
SAME_M = 0.01
SAME_RAD = math.radians(0.5)


def load_carmen(
    path: str | Path, *, kind: str | None = None, max_scans: int | None = None
) -> Recording:
    """Read the scans of one laser, and the odometry, from a CARMEN log.

    Odometry is the robot pose of the scan lines, or, if that never changes, the ODOM lines. A
    reading from 80 m up, or from PARAM ``robot_front_laser_max``, means no return.
    Malformed lines are skipped and counted in the notes.

    Parameters
    ----------
    path : str or Path
        The log; gzipped if its name ends in ``.gz``.
    kind : str or None
        FLASER, ROBOTLASER1 or RLASER; None for the first of these in the log.
    max_scans : int or None
        Only the first ones by stamp.

    Returns
    -------
    Recording
        Without truth; what had to be assumed is in its notes.

    Raises
    ------
    ScanError
        If the file cannot be read or has no scan of that kind.
    """
    path = Path(path)
    if kind is not None and kind not in KINDS:
        raise ScanError(
            expected=f"a kind of scan line among {', '.join(KINDS)}",
            received=f"{kind!r} for {path}",
            remedy="choose one of them, or leave it out to read the first one in the log",
        )
    n_most = check_max_scans(max_scans)
    # More than requested: scans may be late, and in a single line the pose of a sensor and a SLAM
    # correction cannot be distinguished.
    log = read_log(path, KINDS if kind is None else (kind,), n_most + SORTED_AHEAD)
    check_count(len(log.scans), max_scans, path)
    T_base_laser, mounting_notes = _mounted_at(log)
    stamps, stamp_notes = _stamps(log.scans)
    order = ascending(stamps)
    first = order[:n_most]
    with located(f"{path}"):
        return Recording(
            scans=_scans(log, stamps, first, T_base_laser),
            odometry=_odometry(log, stamps, first),
            notes=(*_log_notes(log), *mounting_notes, *stamp_notes, *sorting_notes(order)),
        )


def _mounted_at(log: CarmenLog) -> tuple[SE2, tuple[str, ...]]:
    """Return T_base_laser: offsets in PARAM lines, else laser pose minus robot pose; and notes.

    The poses of a line determine it only if their difference is constant: after SLAM the laser
    pose is a corrected one. A rear laser looks backwards.
    """
    side = "rear" if log.kind == "RLASER" else "front"
    name = f"robot_{side}laser"
    offsets = ("offset", "side_offset", "angular_offset")
    x, y, yaw = (log.params.get(f"{name}_{offset}", 0.0) for offset in offsets)
    default = SE2(x, y, yaw + (math.pi if side == "rear" else 0.0))
    if any((x, y, yaw)):
        return default, ()
    seen = [scan.robot_pose.inverse() @ scan.laser_pose for scan in log.scans]
    is_constant = all(_same(pose, seen[0]) for pose in seen)
    if is_constant and not _same(seen[0], SE2.identity()):
        return seen[0], ()
    if is_constant or f"{name}_offset" in log.params:
        return default, ()
    note = (
        "the log does not contain the pose of the laser on the robot (its laser poses are "
        "corrected by SLAM): the poses found are those of the laser"
    )
    return default, (note,)


def _same(a: SE2, b: SE2) -> bool:
    return alike(a, b, distance=SAME_M, angle=SAME_RAD)


def _scans(
    log: CarmenLog, stamps: NDArray[np.float64], order: NDArray[np.intp], T_base_laser: SE2
) -> tuple[LaserScan, ...]:
    side = "rear" if log.kind == "RLASER" else "front"
    limit = log.params.get(f"robot_{side}_laser_max", np.inf)
    scans = []
    for i in order.tolist():
        line = log.scans[i]
        with located(f"scan {i}"):
            scans.append(
                LaserScan(
                    ranges=line.ranges,
                    angle_min=line.angle_min,
                    angle_increment=line.angle_increment,
                    range_min=0.0,
                    range_max=min(line.range_max, limit),
                    stamp=float(stamps[i]),
                    T_base_laser=T_base_laser,
                )
            )
    return tuple(scans)


def _stamps(scans: list[ScanLine]) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    for column in np.array([scan.stamps for scan in scans]).T:
        # Converters write one constant if the time is unknown.
        if np.isfinite(column).all() and (np.ptp(column) > 0.0 or len(column) == 1):
            return column, ()
    note = "the log has no times: the index of a scan counts as its seconds"
    return np.arange(len(scans), dtype=np.float64), (note,)


def _odometry(log: CarmenLog, stamps: NDArray[np.float64], order: NDArray[np.intp]) -> Trajectory:
    poses = np.array([log.scans[i].robot_pose.as_array() for i in order.tolist()])
    drives = log.odometry
    if _moves(poses) or not _moves(drives[:, 1:]):
        return Trajectory(stamps[order], poses)
    drives = drives[ascending(drives[:, 0])]
    return Trajectory(drives[:, 0], drives[:, 1:])


def _moves(poses: NDArray[np.float64]) -> bool:
    return bool((poses != poses[:1]).any())


def _log_notes(log: CarmenLog) -> tuple[str, ...]:
    notes = []
    if log.malformed:
        notes.append(f"{log.malformed} of {log.seen} lines are malformed and were skipped")
    if log.cut:
        notes.append("the compressed log is cut off: later scans are missing")
    if log.slam:
        notes.append("GMapping wrote this log: its odometry was corrected by SLAM")
    return tuple(notes)
