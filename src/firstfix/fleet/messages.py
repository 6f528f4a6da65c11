"""The messages of the service: one struct declares, checks and documents each."""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

from firstfix.belief.prior import Near
from firstfix.belief.several import distinct_views
from firstfix.belief.view import View
from firstfix.core.errors import InputError
from firstfix.core.estimate import Evidence, Verdict
from firstfix.core.scan import MAX_BEAMS, LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.logs.npz import read_scan
from firstfix.site.query import SitePrior, SiteQuery
from firstfix.web.commands import X, Y, Yaw
from firstfix.web.json_decoding import decode
from firstfix.web.locate_request import Scan
from firstfix.web.messages import Pose, Row, Share
from firstfix.web.request_body import JSON

MOST_SCANS = 16
ROBOT_NAME = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}"
# Of an unpacked .npz: sixteen bytes a beam, and 1 MiB for everything else.
_UNPACKED_BYTES = 16 * MAX_BEAMS + 2**20

PoseOfBase = Annotated[tuple[X, Y, Yaw], Meta(description="x m, y m, yaw rad")]


class NearPose(Struct, frozen=True, forbid_unknown_fields=True):
    """The robot is near a pose; the scans can overrule it."""

    pose: PoseOfBase
    radius: Annotated[float, Meta(gt=0.0, le=1e6, description="m")]
    angle: Annotated[float, Meta(gt=0.0, le=10.0, description="rad; by default any heading")] = (
        math.pi
    )


_MapId = Annotated[str, Meta(max_length=200)]
PriorOfMaps = (
    Annotated[
        dict[_MapId, NearPose | None],
        Meta(
            max_length=1000,
            description="maps in which the robot may be, each with what is known of its pose there",
        ),
    ]
    | None
)
Zone = (
    Annotated[
        str,
        Meta(
            max_length=200,
            description="the robot is in this zone of site.yaml, instead of a prior",
        ),
    ]
    | None
)
Zones = Callable[[str], SitePrior]
"""Returns the prior of a zone by its name."""

Scans = Annotated[list[Scan], Meta(min_length=1, max_length=MOST_SCANS)]


class LocateScans(Struct, frozen=True, forbid_unknown_fields=True):
    """Scans of a robot, oldest first, and what is known of it."""

    scans: Scans
    odometry: Annotated[
        list[PoseOfBase] | None,
        Meta(description="odometry at each scan; without it, all were taken at one place"),
    ] = None
    prior: PriorOfMaps = None
    map: Annotated[str | None, Meta(description="the map of the robot, if it is known")] = None
    zone: Zone = None


class RobotScans(Struct, frozen=True, forbid_unknown_fields=True):
    """The scans of one time, and the odometry then."""

    scans: Scans
    odometry: PoseOfBase
    prior: PriorOfMaps = None
    zone: Zone = None


class SamePlace(Struct, frozen=True):
    """The same place in another map, which overlaps or is a copy."""

    map_id: str
    pose: Pose


class MapPlace(Struct, frozen=True):
    """A place in one of the maps."""

    map_id: str
    pose: Pose
    covariance: tuple[Row, Row, Row]
    score: float
    probability: Share
    evidence: Evidence
    also: list[SamePlace]


class SiteAnswer(Struct, frozen=True):
    """One verdict over all maps, as docs/json.md describes it."""

    index: int
    verdict: Verdict
    reason: str
    map_id: str | None
    pose: Pose | None
    covariance: tuple[Row, Row, Row] | None
    hypotheses: list[MapPlace]
    maps: Annotated[dict[str, Share], Meta(description="probability of each map")]
    elsewhere: Share
    searched: Annotated[int, Meta(ge=0, description="maps that were searched")]
    faults: Annotated[list[str], Meta(description="a sentence for each map that is not used")]
    elapsed_s: float
    views: Annotated[
        int | None, Meta(description="views of the robot that were judged together")
    ] = None


class MapState(Struct, frozen=True):
    """One map of the site."""

    map_id: str
    ready: bool
    fault: str | None


class Maps(Struct, frozen=True):
    """All maps of the site."""

    maps: list[MapState]


class Robots(Struct, frozen=True):
    """The robots that are remembered."""

    robots: list[str]


class Health(Struct, frozen=True):
    """The state of the service."""

    ready: bool
    maps: int
    prepared: int
    faults: int
    robots: int
    waiting: int
    version: str


@dataclass(frozen=True, eq=False, slots=True)
class Asked:
    """A query, and the map that it is restricted to.

    Parameters
    ----------
    query : SiteQuery
        What is asked.
    only : str or None
        The map of the robot, where it is known.
    """

    query: SiteQuery
    only: str | None = None


def read_query(body: bytes, kind: str, map_id: str | None, zones: Zones) -> Asked:
    """Read the body of ``POST /v1/locate``.

    Parameters
    ----------
    body : bytes
        `LocateScans` or `Scan` as JSON, or one scan as .npz.
    kind : str
        Media type.
    map_id : str or None
        The map of the robot, where the body does not have it.
    zones : callable
        Returns the prior of a zone.

    Raises
    ------
    InputError
        If the body is something else.
    """
    if kind != JSON:
        return Asked(SiteQuery.of(read_scan(io.BytesIO(body), _UNPACKED_BYTES)), map_id)
    if "scans" not in decode(body, dict[str, msgspec.Raw]):
        scan: Scan = decode(body, Scan)
        return Asked(SiteQuery.of(scan.laser_scan()), scan.map or map_id)
    asked: LocateScans = decode(body, LocateScans)
    odometry = None if asked.odometry is None else [SE2(*pose) for pose in asked.odometry]
    query = SiteQuery.of(_laser_scans(asked.scans), odometry, _prior(asked, zones))
    return Asked(query, asked.map or map_id)


def read_robot_view(body: bytes, zones: Zones) -> tuple[View, SitePrior | None]:
    """Read the body of ``POST /v1/robots/{id}/scans``: what was seen, and what is known."""
    asked: RobotScans = decode(body, RobotScans)
    scans, T_odom_base = _laser_scans(asked.scans), SE2(*asked.odometry)
    return distinct_views(scans, [T_odom_base] * len(scans))[-1], _prior(asked, zones)


def _prior(asked: LocateScans | RobotScans, zones: Zones) -> SitePrior | None:
    if asked.zone is None:
        return prior_of(asked.prior)
    if asked.prior is not None:
        raise InputError("Give either a zone or a prior of maps.")
    return zones(asked.zone)


def prior_of(given: dict[str, NearPose | None] | None) -> SitePrior | None:
    """Convert a prior."""
    if given is None:
        return None
    return {
        name: None if near is None else Near(SE2(*near.pose), near.radius, near.angle)
        for name, near in given.items()
    }


def _laser_scans(scans: list[Scan]) -> tuple[LaserScan, ...]:
    return tuple(scan.laser_scan() for scan in scans)


def encode(content: Any) -> bytes:
    """Encode as JSON; NaN and infinity become null."""
    return msgspec.json.encode(content)
