"""The planar pose of a sensor on its robot."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
from firstfix.core.points import pose_matrix
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.transforms import flat

# At 5° a range of 10 m is off by 4 cm, about a cell, and the beam has climbed 0.9 m.
NOTED_TILT = math.radians(5.0)
# Beyond that a scan is no cut through the walls at one height any more.
MAX_TILT = math.radians(30.0)


class SensorPlace(NamedTuple):
    """A sensor's pose on the floor plan of its robot.

    Parameters
    ----------
    T_base_laser : SE2
        Its pose.
    mounting : Mounting
        Which way up it is.
    notes : tuple of str
        What had to be assumed.
    """

    T_base_laser: SE2
    mounting: Mounting
    notes: tuple[str, ...] = ()


def place_of(frame: str, T_base_laser: NDArray[np.float64]) -> SensorPlace:
    """Project the 3D pose of a sensor onto the floor.

    Parameters
    ----------
    frame : str
        Name of the sensor's frame, for messages.
    T_base_laser : ndarray, shape (4, 4)
        Its pose in the frame of the base.

    Returns
    -------
    SensorPlace
        Upside down if its z axis points to the floor.

    Raises
    ------
    ScanError
        If it is tilted by more than `MAX_TILT`.
    """
    up = float(np.clip(T_base_laser[2, 2], -1.0, 1.0))
    tilt = math.acos(abs(up))
    if not tilt <= MAX_TILT:
        raise ScanError(
            expected=f"a sensor that scans level, within {math.degrees(MAX_TILT):.0f}°",
            received=f"{frame} tilted by {math.degrees(tilt):.0f}°",
            remedy="choose the topic of another sensor, or correct its static transform",
        )
    notes: tuple[str, ...] = ()
    if tilt > NOTED_TILT:
        notes = (f"{frame} is tilted by {math.degrees(tilt):.0f}°, which was ignored",)
    mounting = Mounting.UPRIGHT if up > 0.0 else Mounting.UPSIDE_DOWN
    return SensorPlace(flat(T_base_laser), mounting, notes)


def given_poses(text: str) -> dict[str, NDArray[np.float64]]:
    """Read the poses of sensors that a person gives in place of transforms.

    Parameters
    ----------
    text : str
        One or several, separated by spaces: ``X,Y,YAW``, ``X,Y,YAW,ROLL`` or
        ``X,Y,Z,ROLL,PITCH,YAW`` (m, rad), each perhaps behind ``frame=``. A roll of 3.14 is upside
        down.

    Returns
    -------
    dict of str to ndarray, shape (4, 4)
        By frame; an empty frame stands for all others.

    Raises
    ------
    ScanError
        If one is no pose, or a laser is not level.
    """
    poses: dict[str, NDArray[np.float64]] = {}
    for part in text.split():
        frame, _, numbers = part.rpartition("=")
        try:
            values = [float(number) for number in numbers.split(",")]
        except ValueError:
            values = []
        if len(values) not in (3, 4, 6) or not all(map(math.isfinite, values)):
            raise ScanError(
                f"laser_pose {part} is not a pose. Write X,Y,YAW or X,Y,YAW,ROLL in metres and "
                "radians, such as 0.2,0,1.57, or X,Y,Z,ROLL,PITCH,YAW; for one of several sensors "
                "like front_laser=0.2,0,1.57."
            )
        if len(values) < 6:
            x, y, yaw, roll = (*values, 0.0)[:4]
            values = [x, y, 0.0, roll, 0.0, yaw]
        poses[frame] = pose_matrix(values)
        if len(numbers.split(",")) < 6:
            place_of(frame or "laser_pose", poses[frame])
    return poses


def unknown_place(frame: str) -> SensorPlace:
    """Return the place of a sensor without transforms: its frame is the base."""
    note = (
        f"no fixed transforms lead from the base to {frame or 'the unnamed frame'} of the scans: "
        "poses are those of the sensor, and odometry is left out; --laser-pose gives its pose"
    )
    return SensorPlace(SE2.identity(), Mounting.UPRIGHT, (note,))
