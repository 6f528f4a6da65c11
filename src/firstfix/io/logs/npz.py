"""Recordings in one .npz file, the format of the evaluation cases."""

from __future__ import annotations

from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.io.logs.npz_archive import NpzArchive
from firstfix.io.logs.npz_writer import save_recording
from firstfix.io.logs.scan_errors import check_max_scans, located, too_many_scans
from firstfix.io.logs.stamps import ascending, sorting_notes
from firstfix.io.ros_messages.poses import chain

__all__ = ["MAX_JITTER", "load_npz", "read_scan", "save_recording"]

# Loggers write messages in the order of their arrival. A longer step back, s, means that a clock
# was set or logs were joined, and sorting would shuffle two drives.
MAX_JITTER = 1.0

# Whole numbers up to here are exact in float64.
MAX_RUN = 2.0**53


def load_npz(path: str | Path, *, max_scans: int | None = None) -> Recording:
    """Read scans, and what is known beside them, from an .npz file.

    Arrays of the file: ``ranges`` [n, beams] or [beams] m, ``angle_min``, ``angle_increment``
    rad, ``range_min``, ``range_max`` m; optional ``true_pose`` [n, 3] and ``odom`` [n, 3]
    (x m, y m, yaw rad: poses of the *sensor*; rows with NaN are not known), ``stamp`` [n] s
    (ascending but for some jitter, which is sorted out and noted; without it the scan index
    counts as seconds), ``run_id`` [n], ``T_base_laser`` [3] (without it the base is the sensor).

    Parameters
    ----------
    path : str or Path
        The file.
    max_scans : int or None
        Only the first ones by stamp.

    Returns
    -------
    Recording
        With ``T_map_base`` and ``T_odom_base``, not the sensor's poses.

    Raises
    ------
    ScanError
        If an array is missing, damaged, too large, or does not fit the others.
    """
    path = Path(path)
    n_most = check_max_scans(max_scans)
    with NpzArchive(path) as archive, located(f"{path}"):
        ranges = _ranges(archive)
        if max_scans is None and len(ranges) > n_most:
            raise too_many_scans(path)
        n = len(ranges)
        stamps = _stamps(archive, n)
        order = ascending(stamps)[:n_most]
        stamps = stamps[order]
        T_base_laser = _mounted_at(archive)
        truth = _base_poses(archive, "true_pose", n, T_base_laser)
        odometry = _base_poses(archive, "odom", n, T_base_laser)
        runs = _runs(archive, n)
        scans = _scans(archive, ranges[order], stamps, T_base_laser)
        return Recording(
            scans=scans,
            odometry=None if odometry is None else _trajectory(stamps, odometry[order]),
            truth=None if truth is None else truth[order],
            runs=None if runs is None else runs[order],
            notes=sorting_notes(order),
        )


def read_scan(file: IO[bytes], max_bytes: int) -> LaserScan:
    """Read the only scan of an .npz file that somebody has sent.

    Parameters
    ----------
    file : binary file
        With the arrays of `load_npz`; those that are not about the scan are passed over.
    max_bytes : int
        What its arrays may unpack to together.

    Returns
    -------
    LaserScan
        With its place on the robot.

    Raises
    ------
    ScanError
        If an array is missing, damaged or too large, or there is not one scan.
    """
    with NpzArchive(file, max_bytes) as archive, located("what was sent"):
        ranges = _ranges(archive)
        if len(ranges) != 1:
            raise ScanError(
                expected="one scan",
                received=f"{len(ranges)} scans",
                remedy="send them one by one",
            )
        (scan,) = _scans(archive, ranges, np.zeros(1), _mounted_at(archive))
        return scan


def _ranges(archive: NpzArchive) -> NDArray[np.generic]:
    ranges = archive.array("ranges")
    if ranges.ndim not in (1, 2):
        raise ScanError(
            expected="ranges of shape (n, beams) or (beams,)",
            received=f"shape {ranges.shape}",
            remedy="save one row for every scan",
        )
    return np.atleast_2d(ranges)


def _stamps(archive: NpzArchive, n: int) -> NDArray[np.float64]:
    stamps = archive.column("stamp", (n,))
    if stamps is None:
        return np.arange(n, dtype=np.float64)
    backwards = ~(np.diff(stamps) >= -MAX_JITTER)  # NaN is a step back too
    if backwards.any():
        raise ScanError(
            expected="stamps in ascending order",
            received=f"a step back at scan {int(np.argmax(backwards)) + 1}",
            remedy="sort the scans by time, or save each log in a file of its own",
        )
    return stamps


def _mounted_at(archive: NpzArchive) -> SE2:
    pose = archive.column("T_base_laser", (3,))
    return SE2.identity() if pose is None else SE2.from_array(pose)


def _base_poses(
    archive: NpzArchive, name: str, n: int, T_base_laser: SE2
) -> NDArray[np.float64] | None:
    poses = archive.column(name, (n, 3))
    if poses is None:
        return None
    if np.isinf(poses).any():
        raise ScanError(
            expected=f"finite poses in `{name}`, or NaN where they are not known",
            received="infinity",
            remedy="write NaN where a pose is not known",
        )
    return chain(poses, T_base_laser.inverse())


def _runs(archive: NpzArchive, n: int) -> NDArray[np.int64] | None:
    runs = archive.column("run_id", (n,))
    if runs is None:
        return None
    if not (np.abs(runs) < MAX_RUN).all():
        raise ScanError(
            expected=f"run_id below {MAX_RUN:.0f}",
            received="others",
            remedy="number the drives of the recording from 0",
        )
    return runs.astype(np.int64)


def _trajectory(stamps: NDArray[np.float64], poses: NDArray[np.float64]) -> Trajectory | None:
    known = np.isfinite(poses).all(axis=1)
    return Trajectory(stamps[known], poses[known]) if known.any() else None


def _scans(
    archive: NpzArchive,
    ranges: NDArray[np.generic],
    stamps: NDArray[np.float64],
    T_base_laser: SE2,
) -> tuple[LaserScan, ...]:
    angle_min, angle_increment = archive.number("angle_min"), archive.number("angle_increment")
    range_min, range_max = archive.number("range_min"), archive.number("range_max")
    scans = []
    for i, (row, stamp) in enumerate(zip(ranges, stamps.tolist(), strict=False)):
        with located(f"scan {i}"):
            scans.append(
                LaserScan(
                    ranges=row,
                    angle_min=angle_min,
                    angle_increment=angle_increment,
                    range_min=range_min,
                    range_max=range_max,
                    stamp=stamp,
                    T_base_laser=T_base_laser,
                )
            )
    return tuple(scans)
