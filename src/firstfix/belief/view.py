"""A view: what the sensors saw at one time, and where odometry put the robot then."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.at_rest import longest_consistent
from firstfix.belief.planar import between, compose, in_cells, inverse
from firstfix.core.errors import InputError
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import Beams
from firstfix.global_localization.refine import refine_on_field, refine_on_rays
from firstfix.global_localization.sensors import (
    covered_angle,
    covered_m2,
    joint_beams,
    see_enough,
)
from firstfix.global_localization.verify import verify

# More scans at rest add nothing: what moves has moved.
MOST_AT_REST = 10

# A sensor that is seen from a moving base is at the same place up to this.
_SAME_MOUNT_M = 0.01
_SAME_MOUNT_RAD = math.radians(0.5)


class Link(Enum):
    """How a view goes on from the one before."""

    UNKNOWN = "unknown"
    GOES_ON = "goes on"
    BROKEN = "broken"


@dataclass(frozen=True, eq=False)
class View:
    """The scans of one time and the odometry at that time.

    Parameters
    ----------
    scans : tuple of LaserScan
        One scan of each sensor; at least one.
    T_odom_base : SE2
        Pose of the base in the odometry frame.
    link : Link
        Whether all scans since the view before go on from each other: `link.link`.
    unconfirmed : int or None
        Steps of the odometry so far that no two scans have confirmed; None if nobody counts them.

    Raises
    ------
    InputError
        If there is no scan.
    """

    scans: tuple[LaserScan, ...]
    T_odom_base: SE2
    link: Link = Link.UNKNOWN
    unconfirmed: int | None = None

    def __post_init__(self) -> None:
        if not self.scans:
            raise InputError(
                expected="a view of at least one scan",
                received="none",
                remedy="wait for the first scan",
            )

    @property
    def stamp(self) -> float:
        """Time of the newest scan, s."""
        return max(scan.stamp for scan in self.scans)

    @classmethod
    def of(cls, scan: LaserScan, T_odom_base: SE2) -> View:
        """Make the view of a robot with one sensor."""
        return cls((scan,), T_odom_base)


@dataclass(frozen=True, eq=False)
class Sensor:
    """All beams of a view in the frame of one sensor, and its pose in cells, shape (3,)."""

    scan: LaserScan
    beams: Beams
    T_base_laser: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Observation:
    """A view in the units of a map, or several at rest as one.

    Parameters
    ----------
    views : tuple of View
        Taken at one place, oldest first.
    resolution : float
        Side of a cell, m.
    rival_cost : float
        Mean cost of a beam, nats, at the third best place of the view's own search; infinite before
        that, or if there is none.
    link : Link
        Of the first of the views.
    """

    views: tuple[View, ...]
    resolution: float
    rival_cost: float = math.inf
    link: Link = Link.UNKNOWN

    @cached_property
    def scans(self) -> tuple[LaserScan, ...]:
        """One scan of each sensor; where several were taken at rest, without what moved."""
        return tuple(
            longest_consistent(scans)
            for scans in zip(*(view.scans for view in self.views), strict=True)
        )

    @cached_property
    def sensor(self) -> Sensor:
        """The beams of all sensors, in the frame of the one with most hits."""
        scan, beams = joint_beams(self.scans)
        return Sensor(scan, beams, in_cells(scan.T_base_laser, self.resolution))

    @property
    def beams(self) -> Beams:
        """The beams of all sensors."""
        return self.sensor.beams

    @cached_property
    def odometry(self) -> NDArray[np.float64]:
        """Pose of the base in the odometry frame at the newest scan, cells and rad, shape (3,)."""
        return in_cells(self.views[-1].T_odom_base, self.resolution)

    @cached_property
    def hits(self) -> int:
        """Number of beams on surfaces."""
        return int(np.count_nonzero(self.beams.hit))

    @cached_property
    def field_of_view(self) -> float:
        """Angle in which there are beams, all sensors together, rad, at most a full turn."""
        return min(2.0 * math.pi, sum(covered_angle(scan) for scan in self.scans))

    @cached_property
    def covered_m2(self) -> float:
        """Area that the sensors cover in an open space, m²."""
        return covered_m2(self.scans)

    @property
    def decides_alone(self) -> bool:
        """True if one look can be enough."""
        return see_enough(self.scans)

    def joined_by(self, view: View) -> Observation:
        """Add a view from the same place."""
        views = (*self.views, view)[-MOST_AT_REST:]
        return Observation(views, self.resolution, link=self.link)

    def same_sensors(self, view: View) -> bool:
        """Tell whether a view comes from the same sensors, beam by beam."""
        mine = self.views[-1].scans
        return len(mine) == len(view.scans) and all(
            _same_geometry(a, b) for a, b in zip(mine, view.scans, strict=True)
        )


def costs(
    poses: NDArray[np.float64], seen: Observation, beams: int, fields: MapFields
) -> NDArray[np.float64]:
    """Return the mean cost of a beam at poses of the base, shape (n,), nats.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad) of the base in the grid.
    seen : Observation
        What was seen.
    beams : int
        Number of beams to compare.
    fields : MapFields
        The prepared map.
    """
    sensor = seen.sensor
    return verify(compose(poses, sensor.T_base_laser), sensor.beams.thinned(beams), fields).scores


def settle(poses: NDArray[np.float64], seen: Observation, fields: MapFields) -> NDArray[np.float64]:
    """Move poses of the base, shape (n, 3), to where the end points lie on walls."""
    sensor = seen.sensor
    settled = refine_on_field(compose(poses, sensor.T_base_laser), sensor.beams, fields)
    return compose(settled, inverse(sensor.T_base_laser))


def settle_on_rays(
    poses: NDArray[np.float64], seen: Observation, fields: MapFields
) -> NDArray[np.float64]:
    """Move poses of the base, shape (n, 3), to where measured and cast ranges agree."""
    sensor = seen.sensor
    settled, _ = refine_on_rays(compose(poses, sensor.T_base_laser), sensor.beams, fields)
    return compose(settled, inverse(sensor.T_base_laser))


def motion(start: Observation, end: Observation) -> tuple[float, float]:
    """Return the distance (cells) and the turn (rad, never negative) between two observations."""
    step = between(start.odometry, end.odometry)
    return math.hypot(step[0], step[1]), abs(math.remainder(step[2], 2.0 * math.pi))


def _same_geometry(a: LaserScan, b: LaserScan) -> bool:
    # Sensors that are moved to one time by odometry come to rest in slightly different places.
    apart = a.T_base_laser.inverse() @ b.T_base_laser
    same_place = math.hypot(apart.x, apart.y) <= _SAME_MOUNT_M and abs(apart.yaw) <= _SAME_MOUNT_RAD
    return same_place and _beams_of(a) == _beams_of(b)


def _beams_of(scan: LaserScan) -> tuple[object, ...]:
    return (scan.sensor, len(scan), scan.angle_min, scan.angle_increment, scan.mounting)
