"""The planar pose of a sensor on its robot."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import ScanError
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


def unknown_place(frame: str) -> SensorPlace:
    """Return the place of a sensor without transforms: its frame is the base."""
    note = (
        f"no fixed transforms lead from the base to {frame or 'the unnamed frame'} of the scans: "
        "poses are those of the sensor, and odometry is left out; --laser-pose gives its pose"
    )
    return SensorPlace(SE2.identity(), Mounting.UPRIGHT, (note,))
