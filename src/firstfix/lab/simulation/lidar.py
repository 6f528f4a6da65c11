"""A simulated LIDAR that measures a map."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.arguments import as_instance, as_member, as_pose
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import MAX_BEAMS, LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges


class NoReturn(Enum):
    """What a sensor reports for a beam without return; the values are the ranges."""

    OPEN_SPACE = np.inf  # nothing within range, as LIDARs do
    UNKNOWN = np.nan  # no reading, as depth cameras do, and scans made of point clouds


@dataclass(frozen=True, slots=True)
class Lidar:
    """A sensor on a robot; the defaults are those of a cheap one that turns all round.

    Parameters
    ----------
    beams : int
        Beams of a scan, at least 1.
    fov : float
        Field of view, rad, centred on the sensor's x axis; up to a full turn.
    range_min, range_max : float
        Limits, m; a surface beyond gives no return, a nearer one an invalid reading.
    sigma_m : float
        Standard deviation of a range, m.
    dropout : float
        Share of beams whose return is lost (black paint, glass), 0 to 1.
    T_base_laser : SE2
        Pose of the sensor on the robot.
    mounting : Mounting
        Upright or upside down.
    no_return : NoReturn
        What a beam without return reports.

    Raises
    ------
    InputError
        If no sensor can be like this.

    Examples
    --------
    >>> lidar = ff.Lidar(beams=90, sigma_m=0.01)
    >>> lidar.scan(grid, ff.SE2(2.0, 1.5, 0.5), np.random.default_rng(0))
    <LaserScan 90 beams over 360°, 90 hits, stamp 0.000>
    """

    beams: int = 360
    fov: float = FULL_TURN
    range_min: float = 0.1
    range_max: float = 12.0
    sigma_m: float = 0.02
    dropout: float = 0.0
    T_base_laser: SE2 = field(default_factory=SE2.identity)
    mounting: Mounting = Mounting.UPRIGHT
    no_return: NoReturn = NoReturn.OPEN_SPACE

    def __post_init__(self) -> None:
        for name, value, holds, expected in (
            ("beams", self.beams, 1 <= self.beams <= MAX_BEAMS, f"1 to {MAX_BEAMS}"),
            ("fov", self.fov, 0.0 < self.fov <= FULL_TURN, "above 0 and at most a full turn (rad)"),
            ("sigma_m", self.sigma_m, 0.0 <= self.sigma_m < np.inf, "at least 0 m"),
            ("dropout", self.dropout, 0.0 <= self.dropout <= 1.0, "a share from 0 to 1"),
        ):
            if not holds:
                raise InputError(
                    expected=f"{name} to be {expected}",
                    received=f"{value}",
                    remedy=f"choose another {name} for the simulated sensor",
                )
        object.__setattr__(self, "T_base_laser", as_pose(self.T_base_laser, "T_base_laser"))
        object.__setattr__(self, "mounting", as_member(Mounting, self.mounting, "mounting"))

    @property
    def angle_increment(self) -> float:
        """Step from beam to beam, rad."""
        # All round, the last beam must not fall on the first one again.
        steps = self.beams if self.fov == FULL_TURN else self.beams - 1
        return self.fov / max(1, steps)

    def scan(
        self, grid: OccupancyGrid, T_map_base: SE2, rng: np.random.Generator, stamp: float = 0.0
    ) -> LaserScan:
        """Take one sweep.

        Parameters
        ----------
        grid : OccupancyGrid
            The world.
        T_map_base : SE2
            Pose of the robot.
        rng : numpy.random.Generator
            Source of noise and dropouts.
        stamp : float
            Time of the scan, s.

        Returns
        -------
        LaserScan
            The scan; inf or NaN for beams without return.
        """
        as_instance(OccupancyGrid, grid, "grid")
        T_map_laser = as_pose(T_map_base, "T_map_base") @ self.T_base_laser
        true = expected_ranges(grid, T_map_laser, self.bearings, self.range_max)
        return self.measure(true, rng, stamp)

    @property
    def bearings(self) -> NDArray[np.float64]:
        """Directions of the beams seen from above in the upright sensor frame, shape (n,), rad."""
        return self._as_scan(np.full(self.beams, np.inf), 0.0).bearings

    def measure(
        self, true: NDArray[np.float64], rng: np.random.Generator, stamp: float
    ) -> LaserScan:
        """Return the scan that this sensor measures, given the true ranges.

        Parameters
        ----------
        true : ndarray, shape (beams,)
            Ranges of an ideal sensor, m; inf where nothing is within range.
        rng : numpy.random.Generator
            Source of noise and dropouts.
        stamp : float
            Time of the scan, s.
        """
        measured = true + self.sigma_m * rng.standard_normal(self.beams)
        lost = rng.random(self.beams) < self.dropout
        # Noise must not push a return beyond the limit, where it would mean open space to a reader.
        measured = np.minimum(measured, np.nextafter(np.float32(self.range_max), np.float32(0.0)))
        return self._as_scan(np.where(np.isinf(true) | lost, self.no_return.value, measured), stamp)

    def _as_scan(self, ranges: NDArray[np.float64], stamp: float) -> LaserScan:
        first = -self.angle_increment * (self.beams - 1) / 2
        if self.fov == FULL_TURN:
            first = -self.fov / 2
        return LaserScan(
            ranges.astype(np.float32),
            angle_min=first,
            angle_increment=self.angle_increment,
            range_min=self.range_min,
            range_max=self.range_max,
            stamp=stamp,
            T_base_laser=self.T_base_laser,
            mounting=self.mounting,
        )
