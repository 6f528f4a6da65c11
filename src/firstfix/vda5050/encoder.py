"""Reports to messages of VDA 5050, in version 2.1 or 3.0."""

from __future__ import annotations

from collections import Counter
from datetime import datetime, timezone
from typing import Any

import msgspec

from firstfix.vda5050 import messages as v2
from firstfix.vda5050 import messages_v3 as v3
from firstfix.vda5050.identity import Identity, Version
from firstfix.vda5050.report import ActionReport, ErrorReport, MapEntry, Position, Report, Velocity

# Header ids are unsigned numbers of 32 bits.
_IDS = 2**32

_BROKEN = {Version.V2: "CONNECTIONBROKEN", Version.V3: "CONNECTION_BROKEN"}
# No order is accepted, so the fleet control is not in control of the robot.
_MODE = "MANUAL"
_NOT_MEASURED = (
    "This state is of the localizer alone: orders, power supply, safety state and operating mode "
    "are placeholders."
)


class Encoder:
    """Makes the messages of one robot, and counts those of each topic.

    Parameters
    ----------
    identity : Identity
        Who the robot is.

    Examples
    --------
    >>> from datetime import datetime, timezone
    >>> from firstfix.vda5050.identity import Identity
    >>> encoder = Encoder(Identity("ACME", "0001"))
    >>> message = encoder.connection("ONLINE", datetime(2026, 1, 2, tzinfo=timezone.utc))
    >>> b'"timestamp":"2026-01-02T00:00:00.000Z"' in message
    True
    """

    def __init__(self, identity: Identity) -> None:
        self._identity = identity
        self._next: Counter[str] = Counter()

    def connection(self, state: str, now: datetime) -> bytes:
        """Return a message of the topic ``connection``.

        Parameters
        ----------
        state : str
            ONLINE, OFFLINE, or BROKEN for the last will.
        now : datetime
            With its time zone.
        """
        if state == "BROKEN":
            state = _BROKEN[self._identity.version]
        header = self._header("connection", now)
        return msgspec.json.encode(v2.Connection(**header, connection_state=state))

    def visualization(self, report: Report, now: datetime) -> bytes:
        """Return a message of the topic ``visualization``."""
        header, velocity = self._header("visualization", now), _velocity(report.velocity)
        if self._identity.version is Version.V2:
            position = _position_v2(report.position)
            message: Any = v2.Visualization(**header, agv_position=position, velocity=velocity)
        else:
            message = v3.Visualization(
                **header,
                reference_state_header_id=max(0, self._next["state"] - 1),
                mobile_robot_position=_position_v3(report.position),
                velocity=velocity,
            )
        return msgspec.json.encode(message)

    def state(self, report: Report, now: datetime) -> bytes:
        """Return a message of the topic ``state``."""
        common = self._header("state", now) | {
            "order_id": "",
            "order_update_id": 0,
            "last_node_id": report.last_node_id,
            "last_node_sequence_id": 0,
            "driving": report.is_driving,
            "operating_mode": _MODE,
            "node_states": [],
            "edge_states": [],
            "maps": [_map(entry) for entry in report.maps],
            "velocity": _velocity(report.velocity),
            "errors": [_error(error, self._identity.version) for error in report.errors],
        }
        make = self._state_v2 if self._identity.version is Version.V2 else self._state_v3
        return msgspec.json.encode(make(common, report))

    def _state_v2(self, common: dict[str, Any], report: Report) -> v2.State:
        infos = (("localization", report.status), ("localizerOnly", _NOT_MEASURED))
        return v2.State(
            **common,
            agv_position=_position_v2(report.position),
            action_states=[_action_v2(action) for action in report.actions],
            battery_state=v2.BatteryState(battery_charge=0.0, charging=False),
            safety_state=v2.SafetyState(e_stop="NONE", field_violation=False),
            information=[
                v2.Info(info_type=name, info_description=text, info_level="INFO")
                for name, text in infos
            ],
        )

    def _state_v3(self, common: dict[str, Any], report: Report) -> v3.State:
        infos = (("LOCALIZATION", report.status), ("LOCALIZER_ONLY", _NOT_MEASURED))
        return v3.State(
            **common,
            mobile_robot_position=_position_v3(report.position),
            action_states=[],
            instant_action_states=[_action_v3(action) for action in report.actions],
            power_supply=v3.PowerSupply(state_of_charge=0.0, charging=False),
            safety_state=v3.SafetyState(active_emergency_stop="NONE", field_violation=False),
            information=[
                v3.Info(info_type=name, info_descriptor=text, info_level="INFO")
                for name, text in infos
            ],
        )

    def _header(self, topic: str, now: datetime) -> dict[str, Any]:
        number = self._next[topic]
        self._next[topic] = (number + 1) % _IDS
        utc = now.astimezone(timezone.utc).isoformat(timespec="milliseconds")
        return {
            "header_id": number,
            "timestamp": utc.replace("+00:00", "Z"),
            "version": self._identity.version.value,
            "manufacturer": self._identity.manufacturer,
            "serial_number": self._identity.serial_number,
        }


def _position_v2(position: Position) -> v2.AgvPosition:
    return v2.AgvPosition(**_place(position), position_initialized=position.is_localized)


def _position_v3(position: Position) -> v3.MobileRobotPosition:
    return v3.MobileRobotPosition(**_place(position), localized=position.is_localized)


def _place(position: Position) -> dict[str, Any]:
    return {
        "x": position.x,
        "y": position.y,
        "theta": position.theta,
        "map_id": position.map_id,
        "localization_score": position.score,
        "deviation_range": position.deviation_m,
    }


def _velocity(velocity: Velocity | None) -> v2.Velocity | None:
    if velocity is None:
        return None
    return v2.Velocity(vx=velocity.vx, vy=velocity.vy, omega=velocity.omega)


def _map(entry: MapEntry) -> v2.Map:
    status = "ENABLED" if entry.is_enabled else "DISABLED"
    return v2.Map(map_id=entry.id, map_version=entry.version, map_status=status)


def _action_v2(action: ActionReport) -> v2.ActionState:
    return v2.ActionState(**_progress(action), result_description=action.result)


def _action_v3(action: ActionReport) -> v3.ActionState:
    return v3.ActionState(**_progress(action), action_result=action.result)


def _progress(action: ActionReport) -> dict[str, str]:
    return {
        "action_id": action.id,
        "action_type": action.type,
        "action_status": action.status.value,
    }


def _error(error: ErrorReport, version: Version) -> v2.Error:
    name_v2, name_v3, level = error.problem.value
    return v2.Error(
        error_type=name_v2 if version is Version.V2 else name_v3,
        error_level=level,
        error_description=error.text,
        error_hint=error.hint,
        error_references=[
            v2.Reference(reference_key=key, reference_value=value)
            for key, value in error.references
        ],
    )
