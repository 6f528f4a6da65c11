"""A recording into one .npz file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.poses import chain


def save_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording to an .npz file, all or nothing.

    Odometry is kept at the stamps of the scans only (NaN where it does not reach); notes are not
    kept, and an upside-down sensor becomes the upright one that sees the same.

    Parameters
    ----------
    recording : Recording
        Scans of one sensor: equal number of beams, bearings, limits and place on the robot.
    path : str or Path
        Where to; an existing file is replaced.

    Raises
    ------
    ScanError
        If the scans are not of one sensor.
    """
    path = Path(path)
    sensors = {_sensor(scan) for scan in recording.scans}
    if len(sensors) != 1:
        raise ScanError(
            expected="scans of one sensor that stays as it is",
            received=f"{len(sensors)} different kinds of scans",
            remedy="save them in one file for each sensor",
        )
    arrays = _arrays(recording)
    # Renaming is atomic only within one folder, and the name must not be anybody else's.
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as stream:
            np.savez_compressed(stream, **arrays)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _arrays(recording: Recording) -> dict[str, Any]:
    scans = recording.scans
    first = scans[0]
    stamps = np.array([scan.stamp for scan in scans])
    arrays = {
        "ranges": np.stack([scan.ranges for scan in scans]),
        "angle_min": np.array(first.mounting.value * first.angle_min),
        "angle_increment": np.array(first.mounting.value * first.angle_increment),
        "range_min": np.array(first.range_min),
        "range_max": np.array(first.range_max),
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


def _sensor(scan: LaserScan) -> tuple[int, float, float, float, float, SE2, Mounting]:
    return (
        len(scan),
        scan.angle_min,
        scan.angle_increment,
        scan.range_min,
        scan.range_max,
        scan.T_base_laser,
        scan.mounting,
    )
