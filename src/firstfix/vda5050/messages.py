"""The messages of VDA 5050 version 2.1: one struct declares, encodes or decodes each."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import Meta, Struct

# Longer texts of a fleet control are refused; those of the specification's examples have 40.
LONGEST = 256
# Larger than any building, and small enough for indices of cells.
FARTHEST_M = 1e6

Text = Annotated[str, Meta(max_length=LONGEST)]
Metres = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M)]
Radians = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M)]


class Wire(Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """An object of a message; what has its default is left out."""


class Header(Wire, frozen=True, kw_only=True):
    """The first fields of each message."""

    header_id: int
    timestamp: str
    version: str
    manufacturer: str
    serial_number: str


class Connection(Header, frozen=True, kw_only=True):
    """Whether the robot is connected to the broker."""

    connection_state: str


class Position(Wire, frozen=True, kw_only=True):
    """Where the robot is, in all versions."""

    x: float
    y: float
    theta: float
    map_id: str
    localization_score: float
    deviation_range: float | None = None


class AgvPosition(Position, frozen=True, kw_only=True):
    """Where the robot is."""

    position_initialized: bool


class Velocity(Wire, frozen=True, kw_only=True):
    """Velocity of the base in its own frame."""

    vx: float
    vy: float
    omega: float


class Visualization(Header, frozen=True, kw_only=True):
    """The pose, at a higher rate than the state."""

    agv_position: AgvPosition
    velocity: Velocity | None = None


class Map(Wire, frozen=True, kw_only=True):
    """A map on the robot."""

    map_id: str
    map_version: str
    map_status: str


class ActionState(Wire, frozen=True, kw_only=True):
    """Progress of an action."""

    action_id: str
    action_type: str
    action_status: str
    result_description: str = ""


class Reference(Wire, frozen=True, kw_only=True):
    """What an error is about."""

    reference_key: str
    reference_value: str


class Error(Wire, frozen=True, kw_only=True):
    """An active error."""

    error_type: str
    error_level: str
    error_description: str
    error_references: list[Reference] = []
    error_hint: str = ""


class Info(Wire, frozen=True, kw_only=True):
    """For people; no program may depend on it."""

    info_type: str
    info_description: str
    info_level: str


class BatteryState(Wire, frozen=True, kw_only=True):
    """Required, but unknown to a localizer."""

    battery_charge: float
    charging: bool


class SafetyState(Wire, frozen=True, kw_only=True):
    """Required, but unknown to a localizer."""

    e_stop: str
    field_violation: bool


class AnyState(Header, frozen=True, kw_only=True):
    """The state of the robot: what all versions have."""

    order_id: str
    order_update_id: int
    last_node_id: str
    last_node_sequence_id: int
    driving: bool
    operating_mode: str
    node_states: list[Any]
    edge_states: list[Any]
    errors: list[Error]
    maps: list[Map]
    velocity: Velocity | None = None


class State(AnyState, frozen=True, kw_only=True):
    """The state of the robot."""

    action_states: list[ActionState]
    battery_state: BatteryState
    safety_state: SafetyState
    agv_position: AgvPosition
    information: list[Info]


class Parameter(Wire, frozen=True, kw_only=True):
    """A parameter of an action."""

    key: Text
    value: Any


class Action(Wire, frozen=True, kw_only=True):
    """An action of a fleet control."""

    action_type: Text
    action_id: Annotated[str, Meta(min_length=1, max_length=LONGEST)]
    action_parameters: Annotated[list[Parameter], Meta(max_length=64)] = []


class InstantActions(Wire, frozen=True, kw_only=True):
    """Actions to be executed as soon as they arrive."""

    actions: Annotated[list[Action], Meta(max_length=64)]


class NewPosition(Wire, frozen=True, kw_only=True):
    """Parameters of ``initPosition``."""

    x: Metres
    y: Metres
    theta: Radians
    map_id: Text
    last_node_id: Text = ""


class MapVersion(Wire, frozen=True, kw_only=True):
    """Parameters of the actions on maps."""

    map_id: Text
    map_version: Text
