"""The body of ``POST /v1/locate``: one scan, or several scans with odometry and a prior."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta, Struct

from firstfix.belief.prior import All, AnyOf, Gaussian, Near, Region
from firstfix.core.errors import InputError
from firstfix.core.scan import MAX_BEAMS, LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.prior import Prior
from firstfix.web.commands import X, Y, Yaw
from firstfix.web.json_decoding import decode

MOST_SCANS = 64
_MOST_PLACES = 256

Pose = Annotated[tuple[X, Y, Yaw], Meta(description="x m, y m, yaw rad")]
Row = tuple[float, float, float]


class Scan(Struct, frozen=True, forbid_unknown_fields=True):
    """A scan, as `sensor_msgs/LaserScan` has it."""

    ranges: Annotated[
        list[float | None],
        Meta(min_length=1, max_length=MAX_BEAMS, description="m; null for no return"),
    ]
    angle_min: Annotated[
        float, Meta(ge=-100.0, le=100.0, description="bearing of the first beam, rad")
    ]
    angle_increment: Annotated[
        float, Meta(ge=-10.0, le=10.0, description="step between beams, rad")
    ]
    range_min: Annotated[float, Meta(ge=0.0, le=1e6, description="shortest valid range, m")]
    range_max: Annotated[float, Meta(ge=0.0, le=1e6, description="longest valid range, m")]
    T_base_laser: Annotated[
        tuple[X, Y, Yaw], Meta(description="pose of the sensor on the robot: x m, y m, yaw rad")
    ] = (0.0, 0.0, 0.0)
    map: Annotated[str | None, Meta(description="name of the map; any if null")] = None
    stamp: Annotated[float, Meta(ge=0.0, le=1e12, description="time, s")] = 0.0
    sensor: Annotated[str, Meta(max_length=256, description="name of the sensor")] = ""

    def laser_scan(self) -> LaserScan:
        """Convert it.

        Raises
        ------
        ScanError
            If its fields contradict each other.
        """
        metres = np.array([math.inf if r is None else r for r in self.ranges], np.float64)
        with np.errstate(over="ignore"):  # beyond the largest float32: infinity
            ranges = metres.astype(np.float32)
        return LaserScan(
            ranges=ranges,
            angle_min=self.angle_min,
            angle_increment=self.angle_increment,
            range_min=self.range_min,
            range_max=self.range_max,
            stamp=self.stamp,
            T_base_laser=SE2(*self.T_base_laser),
            sensor=self.sensor,
        )


class MeasuredPose(Struct, frozen=True, forbid_unknown_fields=True):
    """A pose with its covariance, such as a fiducial gives."""

    pose: Pose
    covariance: Annotated[
        tuple[Row, Row, Row], Meta(description="of x (m), y (m), yaw (rad), in the map frame")
    ]


class KnownPlace(Struct, frozen=True, forbid_unknown_fields=True):
    """What is known of the pose at the first scan; what is given adds up."""

    near: Annotated[
        list[Pose],
        Meta(max_length=_MOST_PLACES, description="the robot is near one of these poses"),
    ] = []
    radius: Annotated[float, Meta(gt=0.0, le=1e6, description="of near, m")] = 1.0
    angle: Annotated[float, Meta(gt=0.0, le=math.pi, description="of near, rad; pi: any")] = math.pi
    region: Annotated[
        list[tuple[X, Y]],
        Meta(max_length=_MOST_PLACES, description="corners of a polygon that the robot is in, m"),
    ] = []
    fix: MeasuredPose | None = None

    def prior(self) -> Prior | None:
        """Convert it; None if nothing is known.

        Raises
        ------
        InputError
            If the region has no area, or the covariance is none.
        """
        priors: list[Prior] = []
        if self.near:
            places = tuple(Near(SE2(*pose), self.radius, self.angle) for pose in self.near)
            priors.append(places[0] if len(places) == 1 else AnyOf(places))
        if self.region:
            priors.append(Region(self.region))
        if self.fix is not None:
            priors.append(Gaussian(SE2(*self.fix.pose), np.array(self.fix.covariance)))
        if len(priors) <= 1:
            return priors[0] if priors else None
        return All(tuple(priors))


class Query(Struct, frozen=True, forbid_unknown_fields=True):
    """Scans of one robot, of one sensor or several, oldest first."""

    scans: Annotated[list[Scan], Meta(min_length=1, max_length=MOST_SCANS)]
    T_odom_base: Annotated[
        list[Pose] | None,
        Meta(description="odometry at each scan; null if the robot stood"),
    ] = None
    prior: KnownPlace | None = None
    map: Annotated[str | None, Meta(description="name of the map; any if null")] = None

    def odometry(self) -> list[SE2] | None:
        """Return the odometry at each scan; None if the robot stood.

        Raises
        ------
        InputError
            If there is not one pose for each scan.
        """
        if self.T_odom_base is None:
            return None
        if len(self.T_odom_base) != len(self.scans):
            raise InputError(
                f"There are {len(self.scans)} scans and {len(self.T_odom_base)} poses T_odom_base. "
                "Give one pose for each scan."
            )
        return [SE2(*pose) for pose in self.T_odom_base]


def read_query(body: bytes) -> Query:
    """Decode a body of JSON: a `Query`, or a `Scan` alone.

    Raises
    ------
    InputError
        If it is neither.
    """
    fields = decode(body, dict[str, msgspec.Raw])
    if "scans" in fields:
        query: Query = decode(body, Query)
        return query
    scan: Scan = decode(body, Scan)
    return Query([scan], map=scan.map)
