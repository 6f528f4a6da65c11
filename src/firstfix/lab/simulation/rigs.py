"""The sensors of a simulated robot, by name."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar, NoReturn
from firstfix.lab.simulation.sweep import NOBODY, sweep

SWEEP_S = 0.1
"""Time that a LIDAR takes for one turn."""


class Shutter(Enum):
    """When the beams of a scan are measured."""

    AT_ONCE = "at once"
    ROLLING = "rolling"  # one after another, while the sensor turns: motion skews the scan


@dataclass(frozen=True, slots=True)
class Rig:
    """All sensors of one robot.

    Parameters
    ----------
    lidars : tuple of Lidar
        At least one, each with its own pose on the robot.
    words : str
        For people: what it is, field of view and range.
    shutter : Shutter
        Whether motion skews the scans.

    Raises
    ------
    InputError
        If there is no sensor.
    """

    lidars: tuple[Lidar, ...]
    words: str = ""
    shutter: Shutter = Shutter.AT_ONCE

    def __post_init__(self) -> None:
        if not self.lidars:
            raise InputError("A robot without a sensor cannot be simulated. Add a Lidar.")

    def scans(
        self, grid: OccupancyGrid, T_map_base: SE2, rng: np.random.Generator, stamp: float = 0.0
    ) -> tuple[LaserScan, ...]:
        """Take one scan of each sensor of a robot at rest; arguments as of `Lidar.scan`."""
        return self.named(lidar.scan(grid, T_map_base, rng, stamp) for lidar in self.lidars)

    def sweeps(
        self,
        floor: Floor,
        T_map_base: SE2,
        T_map_base_after: SE2,
        rng: np.random.Generator,
        stamp: float = 0.0,
        circles: NDArray[np.float64] = NOBODY,
    ) -> tuple[LaserScan, ...]:
        """Take one scan of each sensor of a robot that moves meanwhile.

        Parameters
        ----------
        floor : Floor
            Walls and furniture.
        T_map_base, T_map_base_after : SE2
            Pose at the first beam, and `SWEEP_S` later.
        rng : numpy.random.Generator
            Source of noise and dropouts.
        stamp : float
            Time of the first beam, s.
        circles : ndarray, shape (n, 3)
            People: x, y in the map frame, radius; m.
        """
        rolling = self.shutter is Shutter.ROLLING
        after = T_map_base_after if rolling else None
        scans = self.named(
            sweep(
                lidar, floor, T_map_base, rng, stamp=stamp, circles=circles, T_map_base_after=after
            )
            for lidar in self.lidars
        )
        if not rolling:
            return scans
        return tuple(
            replace(scan, time_increment=SWEEP_S * lidar.angle_increment / FULL_TURN)
            for scan, lidar in zip(scans, self.lidars, strict=True)
        )

    def named(self, scans: Iterable[LaserScan]) -> tuple[LaserScan, ...]:
        """Give the scans of several sensors, in their order, the names of the sensors."""
        if len(self.lidars) == 1:
            return tuple(scans)
        return tuple(replace(scan, sensor=f"sensor {i + 1}") for i, scan in enumerate(scans))


_USUAL = Lidar(dropout=0.01, T_base_laser=SE2(0.07, 0.0, 0.0))
# A safety laser on a corner sees three quarters of the floor; the robot hides the rest.
_CORNER = replace(_USUAL, beams=541, fov=math.radians(270.0), range_max=8.0)
_CAMERA = replace(_USUAL, beams=121, fov=math.radians(60.0), range_max=5.0, range_min=0.3)

RIGS: dict[str, Rig] = {
    "lidar": Rig((_USUAL,), "360° x 12 m"),
    "half-lidar": Rig(
        (replace(_USUAL, beams=361, fov=math.radians(180.0), range_max=8.0),), "180° x 8 m"
    ),
    "two-lasers": Rig(
        (
            replace(_CORNER, T_base_laser=SE2(0.12, 0.12, math.radians(45.0))),
            replace(_CORNER, T_base_laser=SE2(-0.12, -0.12, math.radians(-135.0))),
        ),
        "two lasers, 270° x 8 m each",
    ),
    "depth-camera": Rig(
        # Depth from images is rougher, and a pixel without depth says nothing about the floor.
        (replace(_CAMERA, sigma_m=0.03, no_return=NoReturn.UNKNOWN),),
        "depth camera, 60° x 5 m",
    ),
    "3d-lidar": Rig(
        # As `scan_from_points` makes it of a cloud: every half degree, NaN without a point.
        (Lidar(beams=720, range_min=0.3, range_max=30.0, no_return=NoReturn.UNKNOWN),),
        "3D LIDAR, 360° x 30 m",
    ),
    "skewed-lidar": Rig((_USUAL,), "360° x 12 m, one beam after another", Shutter.ROLLING),
}
"""Sensors that robots have; the first is the default."""


def find_rig(name: str) -> Rig:
    """Return the sensors of this name.

    Raises
    ------
    InputError
        If there are none of this name.
    """
    if name in RIGS:
        return RIGS[name]
    near = difflib.get_close_matches(name, RIGS, 1)
    hint = f" Did you mean {near[0]}?" if near else ""
    raise InputError(f"There is no sensor {name!r:.40}. Choose one of {', '.join(RIGS)}.{hint}")


def parse_rig(text: str) -> Rig:
    """Read sensors: a name, ``FOV,RANGE`` (degrees, m), or ``2xFOV,RANGE`` for two at the corners.

    Raises
    ------
    InputError
        If it is none of these.
    """
    count, times, numbers = text.rpartition("x")
    try:
        fov_deg, range_max = (float(part) for part in numbers.split(","))
    except ValueError:
        return find_rig(text)
    if count + times not in ("", "2x") or not (
        1.0 <= fov_deg <= 360.0 and 0.5 <= range_max <= 1000.0
    ):
        raise InputError(
            f"{text!r:.40} is no sensor. Write FOV,RANGE with 1 to 360 degrees and 0.5 to 1000 m, "
            f"2xFOV,RANGE for two at opposite corners, or one of {', '.join(RIGS)}."
        )
    beams = round(fov_deg) + (fov_deg < 360.0)  # one a degree
    lidar = replace(_USUAL, beams=beams, fov=math.radians(fov_deg), range_max=range_max)
    words = f"{fov_deg:g}° x {range_max:g} m"
    if count == "":
        return Rig((lidar,), words)
    places = [corner.T_base_laser for corner in RIGS["two-lasers"].lidars]
    return Rig(
        tuple(replace(lidar, T_base_laser=place) for place in places), f"two lasers, {words} each"
    )
