"""One scan of a 2D LIDAR."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.arguments import as_instance, as_member, as_pose
from firstfix.core.errors import InputError, ScanError
from firstfix.core.se2 import SE2

MAX_BEAMS = 100_000


class Mounting(Enum):
    """Which way up the sensor is mounted.

    Examples
    --------
    >>> ff.Lidar(mounting="upside_down").mounting
    <Mounting.UPSIDE_DOWN: -1>
    """

    UPRIGHT = 1
    UPSIDE_DOWN = -1


@dataclass(frozen=True, eq=False)
class LaserScan:
    """A scan with the meaning of ``sensor_msgs/LaserScan``, and the pose of the sensor.

    Parameters
    ----------
    ranges : ndarray of float32, shape (n,)
        Measured distances, m. ``+inf`` or at least ``range_max``: nothing within range (REP 117).
        NaN, ``-inf``, zero, negative or below ``range_min``: no valid reading. Made read-only.
    angle_min : float
        Bearing of the first beam in the sensor frame, rad.
    angle_increment : float
        Step from beam to beam, rad; negative for sensors that turn clockwise.
    range_min, range_max : float
        Limits of the sensor, m.
    stamp : float
        Time of the scan, s.
    T_base_laser : SE2
        Pose of the sensor on the robot. A tuple (x, y, yaw) in metres and radians is accepted.
    mounting : Mounting or str
        ``UPSIDE_DOWN`` mirrors the bearings.
    time_increment : float
        Time from beam to beam, s; 0 for a sensor that looks everywhere at once, or if it is
        unknown. ``stamp`` is that of the first beam.
    directions : ndarray, shape (n,), or None
        Bearings of a scan that was straightened (`deskew`), seen from above, rad; None for equal
        angles. Made read-only.
    sensor : str
        Name of the sensor, such as its frame, where a robot has several. Scans of different sensors
        that were taken at about the same time are judged together.

    Raises
    ------
    ScanError
        If the numbers are not those of a scan. A valid scan without hits is accepted.
    InputError
        If ``T_base_laser`` is not a pose, or ``mounting`` has another name.

    Examples
    --------
    >>> ranges = np.full(360, 2.0)
    >>> scan = ff.LaserScan(
    ...     ranges,
    ...     angle_min=-np.pi,
    ...     angle_increment=np.pi / 180,
    ...     range_min=0.1,
    ...     range_max=12.0,
    ...     T_base_laser=(0.1, 0.0, 0.0),
    ... )
    >>> scan
    <LaserScan 360 beams over 360°, 360 hits, stamp 0.000>
    >>> scan.points().shape
    (360, 2)
    """

    ranges: NDArray[np.float32]
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    stamp: float = 0.0
    T_base_laser: SE2 = field(default_factory=SE2.identity)
    mounting: Mounting = Mounting.UPRIGHT
    time_increment: float = 0.0
    directions: NDArray[np.float64] | None = None
    sensor: str = ""

    def __post_init__(self) -> None:
        ranges = _as_ranges(self.ranges)
        n = len(ranges)
        _check(
            math.isfinite(self.angle_min) and abs(self.angle_min) <= 2 * FULL_TURN,
            "a finite angle_min within two turns",
            f"angle_min {self.angle_min}",
            "give bearings in radians",
        )
        _check(
            math.isfinite(self.angle_increment) and (self.angle_increment != 0.0 or n == 1),
            "a finite angle_increment other than 0",
            f"angle_increment {self.angle_increment}",
            "give the step between two beams in radians",
        )
        _check(
            abs(self.angle_increment) * (n - 1) <= FULL_TURN * 1.01,
            "beams that span at most one turn",
            f"{n} beams of {self.angle_increment} rad each",
            "check that angle_increment is in radians and fits the number of ranges",
        )
        _check(
            math.isfinite(self.range_min) and self.range_min >= 0.0,
            "a finite range_min of at least 0 m",
            f"range_min {self.range_min}",
            "take the limits from the sensor's data sheet",
        )
        _check(
            self.range_max > self.range_min,
            "a range_max above range_min",
            f"range_max {self.range_max} with range_min {self.range_min}",
            "take the limits from the sensor's data sheet",
        )
        _check(
            math.isfinite(self.stamp),
            "a finite stamp in seconds",
            f"stamp {self.stamp}",
            "use 0 if the time is unknown",
        )
        _check(
            math.isfinite(self.time_increment) and self.time_increment >= 0.0,
            "a finite time_increment of at least 0 s",
            f"time_increment {self.time_increment}",
            "use 0 if it is unknown",
        )
        if self.directions is not None:
            object.__setattr__(self, "directions", _as_directions(self.directions, n))
        object.__setattr__(self, "ranges", ranges)
        object.__setattr__(self, "T_base_laser", as_pose(self.T_base_laser, "T_base_laser"))
        object.__setattr__(self, "mounting", as_member(Mounting, self.mounting, "mounting"))

    def __len__(self) -> int:
        return len(self.ranges)

    def __repr__(self) -> str:
        fov = math.degrees(abs(self.angle_increment) * len(self))
        hits = np.count_nonzero(self.hit)
        return f"<LaserScan {len(self)} beams over {fov:.0f}°, {hits} hits, stamp {self.stamp:.3f}>"

    @cached_property
    def bearings(self) -> NDArray[np.float64]:
        """Bearing of each beam, seen from above, in the upright sensor frame, shape (n,), rad."""
        if self.directions is not None:
            return self.directions
        bearings = self.angle_min + self.angle_increment * np.arange(
            len(self.ranges), dtype=np.float64
        )
        return bearings if self.mounting is Mounting.UPRIGHT else -bearings

    @cached_property
    def hit(self) -> NDArray[np.bool_]:
        """Beams that measured a surface, shape (n,)."""
        r = self.ranges
        with np.errstate(invalid="ignore", over="ignore"):
            return (r >= self.range_min) & (r > 0.0) & (r < self.range_max)

    @cached_property
    def no_return(self) -> NDArray[np.bool_]:
        """Beams without an obstacle within range, shape (n,): evidence of open space."""
        with np.errstate(invalid="ignore", over="ignore"):
            return (self.ranges >= self.range_max) & (self.ranges > 0.0)

    def points(self) -> NDArray[np.float64]:
        """End points of the beams that hit, in the base frame, shape (n_hit, 2), m."""
        r = self.ranges[self.hit].astype(np.float64)
        a = self.bearings[self.hit]
        return self.T_base_laser.apply(np.column_stack([r * np.cos(a), r * np.sin(a)]))


Scans = LaserScan | Sequence[LaserScan]
"""One scan, or one of each sensor of a robot, taken at one time."""


def as_scans(scans: Scans) -> tuple[LaserScan, ...]:
    """Return one scan or several as a tuple.

    Raises
    ------
    InputError
        If there is none, or one is not a LaserScan.
    """
    if not isinstance(scans, Sequence):
        return (as_instance(LaserScan, scans, "scan"),)
    if len(scans) == 0:
        raise InputError("There is no scan in the list. Pass one scan of each sensor.")
    return tuple(as_instance(LaserScan, scan, "scan") for scan in scans)


def _as_ranges(ranges: ArrayLike) -> NDArray[np.float32]:
    array = np.asarray(ranges)
    _check(
        array.ndim == 1 and 1 <= array.size <= MAX_BEAMS and array.dtype.kind in "fiu",
        f"a list of 1 to {MAX_BEAMS} ranges",
        f"{array.dtype} of shape {array.shape}",
        "pass one scan at a time, as numbers",
    )
    with np.errstate(over="ignore"):  # beyond float32 is infinitely far
        array = array.astype(np.float32)
    array.flags.writeable = False
    return array


def _as_directions(directions: ArrayLike, n: int) -> NDArray[np.float64]:
    array = np.array(directions, np.float64)
    _check(
        array.shape == (n,) and np.isfinite(array).all(),
        f"{n} finite directions",
        f"directions of shape {array.shape}",
        "give one for each beam, or None",
    )
    array.flags.writeable = False
    return array


def _check(holds: object, expected: str, received: str, remedy: str) -> None:
    if not holds:
        raise ScanError(expected=expected, received=received, remedy=remedy)
