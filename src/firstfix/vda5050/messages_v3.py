"""The messages of VDA 5050 version 3.0, where they differ from those of version 2.1."""

from __future__ import annotations

from firstfix.vda5050.messages import AnyState, Header, Position, Velocity, Wire


class MobileRobotPosition(Position, frozen=True, kw_only=True):
    """Where the robot is."""

    localized: bool


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


class State(AnyState, frozen=True, kw_only=True):
    """The state of the robot."""

    action_states: list[ActionState]
    instant_action_states: list[ActionState]
    power_supply: PowerSupply
    safety_state: SafetyState
    mobile_robot_position: MobileRobotPosition
    information: list[Info]
