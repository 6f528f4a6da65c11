"""The messages of the server: one struct declares, encodes and documents each (docs/live.md)."""

from __future__ import annotations

from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from firstfix import __version__
from firstfix.core.estimate import Evidence, Hypothesis, SearchReport, Verdict
from firstfix.core.se2 import SE2
from firstfix.localizer.states import State
from firstfix.web.map_png import png_layout
from firstfix.web.snapshot import ActiveMap, AmclStart, SimulationStatus, Snapshot
from firstfix.web.timeline import Event

Count = Annotated[int, Meta(ge=0)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Pose = Annotated[tuple[float, float, float], Meta(description="x m, y m, yaw rad")]
Row = tuple[float, float, float]


class MapImage(Struct, frozen=True):
    """The PNG of a map; its lower-left corner is that of the map."""

    width: Count
    height: Count
    resolution: Annotated[float, Meta(description="m per pixel")]
    url: str


class Map(Struct, frozen=True):
    """The map in use."""

    name: str
    width: Count
    height: Count
    resolution: Annotated[float, Meta(description="m per cell")]
    origin: Pose
    image: MapImage
    changes: Annotated[str | None, Meta(description="URL of a PNG of what has changed, if kept")]

    @classmethod
    def of(cls, active_map: ActiveMap) -> Map:
        """Describe a map."""
        grid = active_map.grid
        width, height, resolution = png_layout(active_map)
        return cls(
            name=active_map.name,
            width=grid.width,
            height=grid.height,
            resolution=grid.resolution,
            origin=as_tuple(grid.T_map_grid),
            image=MapImage(width, height, resolution, f"/v1/map.png?v={active_map.key[:12]}"),
            changes=None if active_map.changes is None else "/v1/map/changes.png",
        )


class Place(Struct, frozen=True):
    """A hypothesis: one place where the robot may be."""

    id: Annotated[int | None, Meta(description="stays the same while the place is listed")]
    pose: Pose
    probability: Share
    explained: Annotated[Share, Meta(description="share of the beams that the map explains here")]

    @classmethod
    def of(cls, hypothesis: Hypothesis) -> Place:
        """Describe a hypothesis."""
        return cls(
            hypothesis.id,
            as_tuple(hypothesis.pose),
            hypothesis.probability,
            hypothesis.evidence.explained,
        )


class Motion(Struct, frozen=True):
    """A motion that would decide between the hypotheses."""

    turn: Annotated[float, Meta(description="turn first, rad, counter-clockwise")]
    ahead: Annotated[float, Meta(description="then drive straight, m")]


class Simulation(Struct, frozen=True):
    """World and sensor of a simulated robot, whether the sensor is covered, and plain AMCL."""

    world: str
    sensor: str
    covered: bool
    amcl: AmclStart
    path: Annotated[
        tuple[tuple[float, float], ...], Meta(description="corners of the way to a goal, m")
    ]


class Amcl(Struct, frozen=True):
    """What a plain AMCL believes, which runs beside the localizer of a simulated robot."""

    pose: Pose
    covariance: Annotated[
        tuple[float, float, float, float], Meta(description="xx, xy, yy, yaw yaw")
    ]


class Menus(Struct, frozen=True):
    """The choices of the `world` and `sensor` commands."""

    worlds: tuple[str, ...]
    sensors: tuple[str, ...]


class BeliefSummary(Struct, frozen=True):
    """The belief over the whole map; the heat map is a binary message."""

    places: Annotated[Count, Meta(description="number of places that are still possible")]
    elsewhere: Annotated[Share, Meta(description="probability that the robot is at no such place")]


class Hello(Struct, frozen=True, tag_field="type", tag="hello"):
    """The first message: what the robot is and what can be done."""

    robot: str
    may_steer: bool
    abilities: tuple[str, ...]
    map: Map | None
    menus: Menus | None
    events: list[Event]
    version: str = __version__


class Status(Struct, frozen=True, tag_field="type", tag="state"):
    """The state of the localizer and everything that explains it."""

    stamp: float
    state: State
    reason: str
    pose: Pose | None
    covariance: Annotated[
        tuple[float, float, float, float] | None, Meta(description="xx, xy, yy, yaw yaw")
    ]
    hypotheses: list[Place]
    rivals: Annotated[Count, Meta(description="places that fit about equally well")]
    chosen_by: Annotated[
        str | None, Meta(description="who chose among them, until evidence decides")
    ]
    evidence: Evidence | None
    belief: BeliefSummary | None
    particles: Count
    cpu_ms: float | None
    time_to_fix_s: float | None
    motion: Motion | None
    truth: Pose | None
    paused: bool
    simulation: Simulation | None
    amcl: Amcl | None
    viewers: Count

    @classmethod
    def of(cls, snapshot: Snapshot, viewers: int) -> Status:
        """Describe a snapshot."""
        pose, motion, cloud = snapshot.pose, snapshot.motion, snapshot.particles
        sim = snapshot.simulation
        return cls(
            stamp=snapshot.stamp,
            state=snapshot.state,
            reason=snapshot.reason,
            pose=None if pose is None else as_tuple(pose),
            covariance=None if snapshot.covariance is None else _upper(snapshot.covariance),
            hypotheses=[Place.of(hypothesis) for hypothesis in snapshot.hypotheses],
            rivals=snapshot.rivals,
            chosen_by=snapshot.chosen_by,
            evidence=snapshot.evidence,
            belief=_belief(snapshot),
            particles=0 if cloud is None else len(cloud.particles),
            cpu_ms=snapshot.cpu_ms,
            time_to_fix_s=snapshot.time_to_fix_s,
            motion=None if motion is None else Motion(motion.turn, motion.ahead),
            truth=None if snapshot.truth is None else as_tuple(snapshot.truth),
            paused=sim is not None and sim.is_paused,
            simulation=_simulation(sim),
            amcl=_amcl(snapshot),
            viewers=viewers,
        )


class Refusal(Struct, frozen=True, tag_field="type", tag="error"):
    """Why a command of this viewer was not executed."""

    detail: str
    command: Annotated[str | None, Meta(description="its type, where it could be read")] = None


class Accepted(Struct, frozen=True):
    """A command was handed to the localizer."""

    detail: str


class LocatedPlace(Struct, frozen=True):
    """A hypothesis of `POST /v1/locate`."""

    pose: Pose
    covariance: tuple[Row, Row, Row]
    score: float
    probability: Share
    evidence: Evidence


class Answer(Struct, frozen=True):
    """The answer of `POST /v1/locate`, as docs/json.md describes it."""

    index: Count
    verdict: Verdict
    reason: str
    pose: Pose | None
    covariance: tuple[Row, Row, Row] | None
    hypotheses: list[LocatedPlace]
    probability_without_prior: Annotated[
        Share | None, Meta(description="of the best place, by the scans alone")
    ]
    search: SearchReport
    elapsed_s: float
    error: None


class LocatedFiles(Struct, frozen=True):
    """The answer of `POST /v1/locate-files`."""

    map: Map
    png: Annotated[str, Meta(description="the map as in GET /v1/map.png, base64")]
    log: Annotated[str, Meta(description="name of the log")]
    scans: Annotated[Count, Meta(description="scans that index can choose")]
    notes: Annotated[list[str], Meta(description="assumptions of the reader")]
    ends: Annotated[list[tuple[float, float]], Meta(description="of the beams, map frame, m")]
    classes: Annotated[list[Count], Meta(description="of the beams, as in binary kind 1")]
    answer: Answer


def as_tuple(pose: SE2) -> tuple[float, float, float]:
    """Write a pose as x (m), y (m), yaw (rad)."""
    return pose.x, pose.y, pose.yaw


def encode_text(message: Struct) -> str:
    """Encode a message as JSON; NaN and infinity become null."""
    return msgspec.json.encode(message).decode()


def _belief(snapshot: Snapshot) -> BeliefSummary | None:
    belief = snapshot.belief
    if belief is None:
        return None
    return BeliefSummary(belief.possible, belief.elsewhere)


def _simulation(status: SimulationStatus | None) -> Simulation | None:
    if status is None:
        return None
    return Simulation(status.world, status.sensor, status.is_covered, status.amcl, status.path)


def _amcl(snapshot: Snapshot) -> Amcl | None:
    amcl = snapshot.amcl
    return None if amcl is None else Amcl(as_tuple(amcl.T_map_base), _upper(amcl.covariance))


def _upper(P: NDArray[np.float64]) -> tuple[float, float, float, float]:
    return float(P[0, 0]), float(P[0, 1]), float(P[1, 1]), float(P[2, 2])
