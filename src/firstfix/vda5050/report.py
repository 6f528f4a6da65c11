"""What is reported to the fleet control, whatever the version of VDA 5050."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class ActionStatus(Enum):
    """Progress of an instant action."""

    RUNNING = "RUNNING"
    FINISHED = "FINISHED"
    FAILED = "FAILED"


class Problem(Enum):
    """Kinds of errors: the name in version 2.1, the name in version 3.0, and the level in both."""

    NOT_LOCALIZED = ("localizationError", "LOCALIZATION_ERROR", "FATAL")
    BAD_ACTION = ("instantActionError", "INVALID_INSTANT_ACTION", "WARNING")
    DUPLICATE_MAP = ("duplicateMap", "DUPLICATE_MAP", "WARNING")
    UNKNOWN_MAP = ("unknownMapId", "UNKNOWN_MAP_ID", "WARNING")


@dataclass(frozen=True, slots=True)
class Position:
    """Where the robot is.

    Parameters
    ----------
    x, y : float
        In the map frame, m.
    theta : float
        Heading, rad, -π to π.
    map_id : str
        The map in use.
    is_localized : bool
        False if the pose is only the last or the most likely one.
    score : float
        Beams that the pose explains, times the probability of the place, 0 to 1.
    deviation_m : float or None
        The position is within this distance with a probability of 95 %.
    """

    x: float
    y: float
    theta: float
    map_id: str
    is_localized: bool
    score: float
    deviation_m: float | None


@dataclass(frozen=True, slots=True)
class Velocity:
    """Velocity of the base in its own frame: m/s, m/s, rad/s."""

    vx: float
    vy: float
    omega: float


@dataclass(frozen=True, slots=True)
class MapEntry:
    """A map that can be used, and whether it may be."""

    id: str
    version: str
    is_enabled: bool


@dataclass(frozen=True, slots=True)
class ActionReport:
    """An instant action and what came of it, in words."""

    id: str
    type: str
    status: ActionStatus
    result: str = ""


@dataclass(frozen=True, slots=True)
class ErrorReport:
    """An active error; references are pairs of a key and a value."""

    problem: Problem
    text: str
    hint: str = ""
    references: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Report:
    """Everything that a localizer can report; the status is in words, for people."""

    position: Position
    status: str
    velocity: Velocity | None
    is_driving: bool
    last_node_id: str
    maps: tuple[MapEntry, ...]
    actions: tuple[ActionReport, ...]
    errors: tuple[ErrorReport, ...]
