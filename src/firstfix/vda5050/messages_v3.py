"""The messages of VDA 5050 version 3.0, where they differ from those of version 2.1."""

from __future__ import annotations

from typing import Any

from firstfix.vda5050.messages import Error, Header, Map, Velocity, Wire


class MobileRobotPosition(Wire, frozen=True, kw_only=True):
    """Where the robot is."""

    x: float
    y: float
    theta: float
    map_id: str
    localized: bool
    localization_score: float
    deviation_range: float | None = None


class Visualization(Header, frozen=True, kw_only=True):
    """The pose, at a higher rate than the state."""

    reference_state_header_id: int
    mobile_robot_position: MobileRobotPosition
    velocity: Velocity | None = None


class ActionState(Wire, frozen=True, kw_only=True):
    """Progress of an action."""

    action_id: str
    action_type: str
    action_status: str
    action_result: str = ""


class Info(Wire, frozen=True, kw_only=True):
    """For people; no program may depend on it."""

    info_type: str
    info_descriptor: str
    info_level: str


class PowerSupply(Wire, frozen=True, kw_only=True):
    """Required, but unknown to a localizer."""

    state_of_charge: float
    charging: bool


class SafetyState(Wire, frozen=True, kw_only=True):
    """Required, but unknown to a localizer."""

    active_emergency_stop: str
    field_violation: bool


class State(Header, frozen=True, kw_only=True):
    """The state of the robot."""

    order_id: str
    order_update_id: int
    last_node_id: str
    last_node_sequence_id: int
    driving: bool
    operating_mode: str
    node_states: list[Any]
    edge_states: list[Any]
    action_states: list[ActionState]
    instant_action_states: list[ActionState]
    power_supply: PowerSupply
    errors: list[Error]
    safety_state: SafetyState
    maps: list[Map]
    mobile_robot_position: MobileRobotPosition
    information: list[Info]
    velocity: Velocity | None = None
