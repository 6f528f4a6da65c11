"""Recordings in one .npz file, the format of the evaluation cases."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.io.atomic_files import replace_file
from firstfix.io.logs.checks import (
    ascending,
    check_count,
    check_max_scans,
    located,
    sorting_notes,
    unreadable,
)
from firstfix.io.ros_messages.poses import chain

# Loggers write messages in the order of their arrival. A longer step back, s, means that a clock
# was set or logs were joined; sorting would mix two drives.
MAX_JITTER = 1.0

# Integers up to here are exact in float64.
MAX_RUN = 2.0**53

# 2**28 float32 ranges are a day of 360 beams at 8 Hz; an archive that unpacks to more is an attack,
# or does not fit into the memory of a robot.
MAX_BYTES = 2**30

_REQUIRED = ("ranges", "angle_min", "angle_increment", "range_min", "range_max")
_OPTIONAL = ("stamp", "true_pose", "odom", "run_id", "T_base_laser", "time_increment")

_Arrays = dict[str, NDArray[Any]]


def load_npz(path: str | Path, *, max_scans: int | None = None) -> Recording:
    """Read scans, odometry and truth from an .npz file.

    Arrays of the file: ``ranges`` [n, beams] or [beams] m, ``angle_min``, ``angle_increment``
    rad, ``range_min``, ``range_max`` m; optional ``true_pose`` [n, 3] and ``odom`` [n, 3]
    (x m, y m, yaw rad: poses of the *sensor*; NaN if unknown), ``stamp`` [n] s
    (ascending but for some jitter, which is sorted out and noted; without it the scan index
    counts as seconds), ``run_id`` [n], ``T_base_laser`` [3] (without it the base is the sensor),
    ``time_increment`` s.

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
    with located(f"{path}"):
        try:
            with path.open("rb") as file:
                arrays = _read_arrays(file, f"{path}", MAX_BYTES)
        except OSError as error:
            raise unreadable(path, "an .npz archive", error) from error
        ranges = _ranges(arrays)
        n = len(ranges)
        check_count(n, max_scans, path)
        stamps = _stamps(arrays, n)
        order = ascending(stamps)[:n_most]
        stamps = stamps[order]
        T_base_laser = _mounted_at(arrays)
        truth = _base_poses(arrays, "true_pose", n, T_base_laser)
        odometry = _base_poses(arrays, "odom", n, T_base_laser)
        runs = _runs(arrays, n)
        return Recording(
            scans=_scans(arrays, ranges[order], stamps, T_base_laser),
            odometry=None if odometry is None else _trajectory(stamps, odometry[order]),
            truth=None if truth is None else truth[order],
            runs=None if runs is None else runs[order],
            notes=sorting_notes(order),
        )


def read_scan(file: IO[bytes], max_bytes: int) -> LaserScan:
    """Read the only scan of an .npz file that a client sent.

    Parameters
    ----------
    file : binary file
        With the arrays of `load_npz`; those that do not describe the scan are ignored.
    max_bytes : int
        Limit of its unpacked arrays together.

    Returns
    -------
    LaserScan
        With its pose on the robot.

    Raises
    ------
    ScanError
        If an array is missing, damaged or too large, or there is not exactly one scan.
    """
    with located("the data sent"):
        arrays = _read_arrays(file, "the data sent", max_bytes)
        ranges = _ranges(arrays)
        if len(ranges) != 1:
            raise ScanError(
                expected="one scan",
                received=f"{len(ranges)} scans",
                remedy="send them one by one",
            )
        (scan,) = _scans(arrays, ranges, np.zeros(1), _mounted_at(arrays))
        return scan


def save_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording to an .npz file, completely or not at all.

    Odometry is interpolated at the stamps of the scans (NaN outside of it). Notes are not saved.
    An upside-down sensor becomes the upright one with the same measurements.

    Parameters
    ----------
    recording : Recording
        Scans of one sensor: equal number of beams, bearings, limits and pose on the robot.
    path : str or Path
        An existing file is replaced.

    Raises
    ------
    ScanError
        If the scans are not from one sensor.
    InputError
        If the file cannot be written.

    Examples
    --------
    >>> ff.save_recording(ff.Recording((scan,)), "scans.npz")
    """
    sensors = {_sensor(scan) for scan in recording.scans}
    if len(sensors) != 1:
        raise ScanError(
            expected="scans of one sensor with constant settings",
            received=f"{len(sensors)} different kinds of scans",
            remedy="save them in one file for each sensor",
        )
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **_to_arrays(recording))
    replace_file(Path(path), [buffer.getvalue()])


def _read_arrays(file: IO[bytes], name: str, max_bytes: int) -> _Arrays:
    """Unpack the arrays of this format, after a check of the sizes that the archive states."""
    wanted = (*_REQUIRED, *_OPTIONAL)
    try:
        with zipfile.ZipFile(file) as archive:
            sizes = {info.filename: info.file_size for info in archive.infolist()}
        found = [each for each in wanted if f"{each}.npy" in sizes]
        is_too_large = sum(sizes[f"{each}.npy"] for each in found) > max_bytes
        arrays: _Arrays = {}
        if not is_too_large:
            file.seek(0)
            with np.load(file, allow_pickle=False) as unpacked:
                arrays = {each: unpacked[each] for each in found}
    except Exception as error:
        raise unreadable(name, "an .npz archive", error) from error
    if is_too_large:
        raise ScanError(
            expected=f"arrays of at most {max_bytes} bytes in total",
            received=f"more in {name}",
            remedy="split the recording",
        )
    for each in (*_REQUIRED, *found):
        if each not in arrays:
            raise ScanError(
                expected=f"the array `{each}`",
                received=f"none in {name}",
                remedy="save ranges, angle_min, angle_increment, range_min and range_max",
            )
        if arrays[each].dtype.kind not in "biuf":
            raise ScanError(
                expected=f"numbers in the array `{each}`",
                received=f"{arrays[each].dtype} in {name}",
                remedy="save plain float or integer arrays",
            )
    return arrays


def _number(arrays: _Arrays, name: str) -> float:
    if arrays[name].size != 1:
        raise ScanError(
            expected=f"one number `{name}` for the whole sensor",
            received=f"shape {arrays[name].shape}",
            remedy="save the scans of different sensors in files of their own",
        )
    return float(_as_float64(arrays[name]).item())


def _column(arrays: _Arrays, name: str, shape: tuple[int, ...]) -> NDArray[np.float64] | None:
    """Return an optional array of this shape, None if it is missing."""
    if name not in arrays:
        return None
    if arrays[name].shape != shape:
        raise ScanError(
            expected=f"`{name}` of shape {shape}",
            received=f"shape {arrays[name].shape}",
            remedy="give one row for every scan",
        )
    return _as_float64(arrays[name])


def _as_float64(array: NDArray[Any]) -> NDArray[np.float64]:
    with np.errstate(over="ignore"):  # larger numbers become infinite, which is checked later
        return array.astype(np.float64)


def _ranges(arrays: _Arrays) -> NDArray[Any]:
    ranges = arrays["ranges"]
    if ranges.ndim not in (1, 2):
        raise ScanError(
            expected="ranges of shape (n, beams) or (beams,)",
            received=f"shape {ranges.shape}",
            remedy="save one row for every scan",
        )
    return np.atleast_2d(ranges)


def _stamps(arrays: _Arrays, n: int) -> NDArray[np.float64]:
    stamps = _column(arrays, "stamp", (n,))
    if stamps is None:
        return np.arange(n, dtype=np.float64)
    backwards = ~(np.diff(stamps) >= -MAX_JITTER)  # true for NaN
    if backwards.any():
        raise ScanError(
            expected="stamps in ascending order",
            received=f"a step back at scan {int(np.argmax(backwards)) + 1}",
            remedy="sort the scans by time, or save each log in a file of its own",
        )
    return stamps


def _mounted_at(arrays: _Arrays) -> SE2:
    pose = _column(arrays, "T_base_laser", (3,))
    return SE2.identity() if pose is None else SE2.from_array(pose)


def _base_poses(
    arrays: _Arrays, name: str, n: int, T_base_laser: SE2
) -> NDArray[np.float64] | None:
    poses = _column(arrays, name, (n, 3))
    if poses is None:
        return None
    if np.isinf(poses).any():
        raise ScanError(
            expected=f"finite poses in `{name}`, or NaN if unknown",
            received="infinity",
            remedy="write NaN for unknown poses",
        )
    return chain(poses, T_base_laser.inverse())


def _runs(arrays: _Arrays, n: int) -> NDArray[np.int64] | None:
    runs = _column(arrays, "run_id", (n,))
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
    arrays: _Arrays, ranges: NDArray[Any], stamps: NDArray[np.float64], T_base_laser: SE2
) -> tuple[LaserScan, ...]:
    names = [*_REQUIRED[1:], *(["time_increment"] if "time_increment" in arrays else [])]
    sensor: dict[str, Any] = {name: _number(arrays, name) for name in names}
    scans = []
    for i, (row, stamp) in enumerate(zip(ranges, stamps.tolist(), strict=False)):
        with located(f"scan {i}"):
            scans.append(LaserScan(ranges=row, stamp=stamp, T_base_laser=T_base_laser, **sensor))
    return tuple(scans)


def _to_arrays(recording: Recording) -> dict[str, Any]:
    scans = recording.scans
    first = scans[0]
    stamps = np.array([scan.stamp for scan in scans])
    arrays = {
        "ranges": np.stack([scan.ranges for scan in scans]),
        "angle_min": np.array(first.mounting.value * first.angle_min),
        "angle_increment": np.array(first.mounting.value * first.angle_increment),
        "range_min": np.array(first.range_min),
        "range_max": np.array(first.range_max),
        "time_increment": np.array(first.time_increment),
        "stamp": stamps,
        "T_base_laser": first.T_base_laser.as_array(),
    }
    if recording.truth is not None:
        arrays["true_pose"] = chain(recording.truth, first.T_base_laser)
    if recording.odometry is not None:
        poses = [recording.odometry.at(float(stamp)) for stamp in stamps]
        known = np.array([np.full(3, np.nan) if p is None else p.as_array() for p in poses])
        arrays["odom"] = chain(known, first.T_base_laser)
    if recording.runs is not None:
        arrays["run_id"] = recording.runs
    return arrays


def _sensor(scan: LaserScan) -> tuple[int, float, float, float, float, float, SE2, Mounting]:
    return (
        len(scan),
        scan.angle_min,
        scan.angle_increment,
        scan.range_min,
        scan.range_max,
        scan.time_increment,
        scan.T_base_laser,
        scan.mounting,
    )
