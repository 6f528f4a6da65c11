"""Recordings from CARMEN logs, the format of the classic public data sets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.io.logs.carmen_lines import PARSERS, ScanLine
from firstfix.io.logs.carmen_log import CarmenLog, read_log
from firstfix.io.logs.carmen_mounting import mounted_at
from firstfix.io.logs.scan_errors import MAX_SCANS, check_max_scans, located, too_many_scans
from firstfix.io.logs.stamps import SORTED_AHEAD, ascending, sorting_notes

KINDS = tuple(PARSERS)


def load_carmen(
    path: str | Path, *, kind: str | None = None, max_scans: int | None = None
) -> Recording:
    """Read the scans of one laser, and the odometry, from a CARMEN log.

    Odometry is the robot pose of the scan lines, or, where that never changes, the ODOM lines.
    A reading from 80 m up, or from PARAM ``robot_front_laser_max``, means nothing within range.
    Malformed lines are skipped and counted in the notes.

    Parameters
    ----------
    path : str or Path
        The log; gzipped if its name ends in ``.gz``.
    kind : str or None
        FLASER, ROBOTLASER1 or RLASER; None for the first of these that the log has.
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
            remedy="choose one of them, or none for the first that the log has",
        )
    n_most = check_max_scans(max_scans)
    # Some more than are wanted: scans may be late, and in a single line the place of a sensor and
    # a SLAM correction look alike.
    log = read_log(path, KINDS if kind is None else (kind,), n_most + SORTED_AHEAD)
    if max_scans is None and len(log.scans) > MAX_SCANS:
        raise too_many_scans(path)
    T_base_laser, mounting_notes = mounted_at(log.kind, log.scans, log.params)
    stamps, stamp_notes = _stamps(log.scans)
    order = ascending(stamps)
    first = order[:n_most]
    with located(f"{path}"):
        return Recording(
            scans=_scans(log, stamps, first, T_base_laser),
            odometry=_odometry(log, stamps, first),
            notes=(*_log_notes(log), *mounting_notes, *stamp_notes, *sorting_notes(order)),
        )


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
        # Converters write one constant where the time is not known.
        if np.isfinite(column).all() and (np.ptp(column) > 0.0 or len(column) == 1):
            return column, ()
    note = "the log has no times: the number of a scan counts as its seconds"
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
        notes.append("the compressed log is cut off: scans after the cut are missing")
    if log.slam:
        notes.append("GMapping wrote this log: its odometry was corrected by SLAM")
    return tuple(notes)
