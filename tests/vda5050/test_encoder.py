"""Messages have the fields of the official schemas of 2.1.0 and 3.0.0, transcribed here."""

from __future__ import annotations

import json
import math
import re
from datetime import datetime, timedelta, timezone
from typing import Any

import pytest

from firstfix.vda5050.encoder import Encoder
from firstfix.vda5050.identity import Identity, Version
from firstfix.vda5050.report import (
    ActionReport,
    ActionStatus,
    ErrorReport,
    MapEntry,
    Position,
    Problem,
    Report,
    Velocity,
)

NOW = datetime(2026, 1, 2, 3, 4, 5, 678901, tzinfo=timezone.utc)
V2, V3 = Version.V2, Version.V3

# A field is required if its name has no question mark. Numbers have a range, texts an enumeration.
TEXT, NUMBER, INTEGER, BOOLEAN = str, (int, float), int, bool
FRACTION, POSITIVE, PERCENT = (0.0, 1.0), (0.0, math.inf), (0.0, 100.0)
HEADER = {
    "headerId": INTEGER,
    "timestamp": TEXT,
    "version": TEXT,
    "manufacturer": TEXT,
    "serialNumber": TEXT,
}
VELOCITY = {"vx?": NUMBER, "vy?": NUMBER, "omega?": NUMBER}
MAP = {
    "mapId": TEXT,
    "mapVersion": TEXT,
    "mapDescription?": TEXT,
    "mapStatus": {"ENABLED", "DISABLED"},
}
REFERENCE = {"referenceKey": TEXT, "referenceValue": TEXT}
ERROR_V2 = {
    "errorType": TEXT,
    "errorReferences?": [REFERENCE],
    "errorDescription?": TEXT,
    "errorHint?": TEXT,
    "errorLevel": {"WARNING", "FATAL"},
}
ERROR_V3 = ERROR_V2 | {"errorLevel": {"WARNING", "URGENT", "CRITICAL", "FATAL"}}
STATUS_V2 = {"WAITING", "INITIALIZING", "RUNNING", "FINISHED", "FAILED"}
ACTION_V2 = {
    "actionId": TEXT,
    "actionType?": TEXT,
    "actionDescription?": TEXT,
    "actionStatus": STATUS_V2,
    "resultDescription?": TEXT,
}
ACTION_V3 = {
    "actionId": TEXT,
    "actionType?": TEXT,
    "actionDescriptor?": TEXT,
    "actionStatus": STATUS_V2 | {"PAUSED", "RETRIABLE"},
    "actionResult?": TEXT,
}
AGV_POSITION = {
    "x": NUMBER,
    "y": NUMBER,
    "theta": NUMBER,
    "mapId": TEXT,
    "positionInitialized": BOOLEAN,
    "localizationScore?": FRACTION,
    "deviationRange?": NUMBER,
}
ROBOT_POSITION = {
    "x": NUMBER,
    "y": NUMBER,
    "theta": (-3.14159265359, 3.14159265359),
    "mapId": TEXT,
    "localized": BOOLEAN,
    "localizationScore?": FRACTION,
    "deviationRange?": POSITIVE,
}
STATE = HEADER | {
    "maps?": [MAP],
    "orderId": TEXT,
    "orderUpdateId": INTEGER,
    "lastNodeId": TEXT,
    "lastNodeSequenceId": INTEGER,
    "driving": BOOLEAN,
    "nodeStates": [{}],
    "edgeStates": [{}],
    "velocity?": VELOCITY,
}
STATE_V2 = STATE | {
    "operatingMode": {"AUTOMATIC", "SEMIAUTOMATIC", "MANUAL", "SERVICE", "TEACHIN"},
    "agvPosition?": AGV_POSITION | {"mapDescription?": TEXT},
    "actionStates": [ACTION_V2],
    "batteryState": {"batteryCharge": NUMBER, "charging": BOOLEAN},
    "errors": [ERROR_V2],
    "information?": [{"infoType": TEXT, "infoDescription?": TEXT, "infoLevel": {"INFO", "DEBUG"}}],
    "safetyState": {"eStop": {"AUTOACK", "MANUAL", "REMOTE", "NONE"}, "fieldViolation": BOOLEAN},
}
STATE_V3 = STATE | {
    "maps?": [
        {"mapId": TEXT, "mapVersion": TEXT, "mapDescriptor?": TEXT, "mapStatus": MAP["mapStatus"]}
    ],
    "operatingMode": {
        *("STARTUP", "AUTOMATIC", "SEMIAUTOMATIC", "INTERVENED", "MANUAL", "SERVICE", "TEACH_IN")
    },
    "mobileRobotPosition?": ROBOT_POSITION,
    "actionStates": [ACTION_V3],
    "instantActionStates": [ACTION_V3],
    "powerSupply": {"stateOfCharge": PERCENT, "charging": BOOLEAN},
    "errors": [ERROR_V3],
    "information?": [{"infoType": TEXT, "infoDescriptor?": TEXT, "infoLevel": {"INFO", "DEBUG"}}],
    "safetyState": {
        "activeEmergencyStop": {"MANUAL", "REMOTE", "NONE"},
        "fieldViolation": BOOLEAN,
    },
}
VISUALIZATION_V2 = HEADER | {"agvPosition?": AGV_POSITION, "velocity?": VELOCITY}
VISUALIZATION_V3 = HEADER | {
    "referenceStateHeaderId": INTEGER,
    "mobileRobotPosition?": ROBOT_POSITION,
    "velocity?": VELOCITY,
}
CONNECTION = {
    V2: HEADER | {"connectionState": {"ONLINE", "OFFLINE", "CONNECTIONBROKEN"}},
    V3: HEADER | {"connectionState": {"ONLINE", "OFFLINE", "HIBERNATING", "CONNECTION_BROKEN"}},
}


def violations(value: Any, schema: Any, path: str = "") -> list[str]:
    """Compare a value with a schema written as above."""
    if isinstance(schema, dict):
        if not isinstance(value, dict):
            return [f"{path} is no object"]
        names = {name.rstrip("?"): inner for name, inner in schema.items()}
        wrong = [
            f"{path}.{name} is missing" for name in schema if name[-1] != "?" and name not in value
        ]
        wrong += [f"{path}.{name} is not in the schema" for name in value if name not in names]
        known = value.keys() & names.keys()
        return wrong + [w for n in known for w in violations(value[n], names[n], f"{path}.{n}")]
    if isinstance(schema, list):
        if not isinstance(value, list):
            return [f"{path} is no array"]
        return [w for each in value for w in violations(each, schema[0], f"{path}[]")]
    if isinstance(schema, set):
        return [] if value in schema else [f"{path}: {value} is none of {schema}"]
    if isinstance(schema, tuple) and isinstance(schema[0], float):
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return [] if is_number and schema[0] <= value <= schema[1] else [f"{path}: {value}"]
    is_right = isinstance(value, schema) and (schema is bool or not isinstance(value, bool))
    return [] if is_right else [f"{path}: {value!r} is no {schema}"]


FULL = Report(
    position=Position(1.0, -2.5, -math.pi, "floor 1", True, 0.97, 0.08),
    status="LOCALIZED: 97% of the beams fit",
    velocity=Velocity(0.5, 0.0, -0.1),
    is_driving=True,
    last_node_id="n7",
    maps=(MapEntry("floor 1", "3", True), MapEntry("floor 2", "1", False)),
    actions=tuple(
        ActionReport(f"id {status}", "initPosition", status, "done") for status in ActionStatus
    ),
    errors=tuple(ErrorReport(problem, "text", "hint", (("actionId", "a"),)) for problem in Problem),
)
EMPTY = Report(
    position=Position(0.0, 0.0, 0.0, "floor 1", False, 0.0, None),
    status="NO_MAP: no map yet",
    velocity=None,
    is_driving=False,
    last_node_id="",
    maps=(),
    actions=(),
    errors=(),
)


def encoder(version: Version) -> Encoder:
    return Encoder(Identity("ACME", "0001", version))


def test_the_checker_finds_each_kind_of_violation():
    good = json.loads(encoder(V2).state(FULL, NOW))
    assert violations(good, STATE_V2) == []
    for change, word in [
        ({"orderId": 1}, "orderId"),
        ({"headerId": True}, "headerId"),
        ({"maps": {}}, "no array"),
        ({"maps": [{}]}, "mapId is missing"),
        ({"operatingMode": "ASLEEP"}, "none of"),
        ({"agvPosition": good["agvPosition"] | {"localizationScore": 1.1}}, "localizationScore"),
        ({"surprise": 1}, "not in the schema"),
    ]:
        (found, *_) = violations(good | change, STATE_V2)
        assert word in found


@pytest.mark.parametrize("report", [FULL, EMPTY], ids=["full", "empty"])
@pytest.mark.parametrize(
    ("version", "state", "visualization"),
    [(V2, STATE_V2, VISUALIZATION_V2), (V3, STATE_V3, VISUALIZATION_V3)],
    ids=["2.1", "3.0"],
)
def test_messages_fit_the_schemas(report: Report, version: Version, state: Any, visualization: Any):
    made = encoder(version)
    assert violations(json.loads(made.state(report, NOW)), state) == []
    assert violations(json.loads(made.visualization(report, NOW)), visualization) == []


@pytest.mark.parametrize("version", Version)
@pytest.mark.parametrize("state", ["ONLINE", "OFFLINE", "BROKEN"])
def test_connections_fit_the_schemas(version: Version, state: str):
    message = json.loads(encoder(version).connection(state, NOW))
    assert violations(message, CONNECTION[version]) == []
    assert message["connectionState"].replace("_", "").endswith(state)


def test_the_values_of_a_state():
    state = json.loads(encoder(V2).state(FULL, NOW))
    assert state["agvPosition"] == {
        "x": 1.0,
        "y": -2.5,
        "theta": -math.pi,
        "mapId": "floor 1",
        "positionInitialized": True,
        "localizationScore": 0.97,
        "deviationRange": 0.08,
    }
    assert state["lastNodeId"] == "n7"
    assert state["driving"] is True
    assert [each["mapStatus"] for each in state["maps"]] == ["ENABLED", "DISABLED"]
    errors = {each["errorType"]: each["errorLevel"] for each in state["errors"]}
    assert errors["localizationError"] == "FATAL"
    assert state["actionStates"][0]["resultDescription"] == "done"


def test_the_values_of_a_state_of_version_3():
    state = json.loads(encoder(V3).state(FULL, NOW))
    assert state["mobileRobotPosition"]["localized"] is True
    assert state["actionStates"] == []  # those of an order
    assert state["instantActionStates"][0]["actionResult"] == "done"
    assert {"LOCALIZATION_ERROR", "INVALID_INSTANT_ACTION", "DUPLICATE_MAP", "UNKNOWN_MAP_ID"} == {
        each["errorType"] for each in state["errors"]
    }


@pytest.mark.parametrize("version", Version)
def test_the_header(version: Version):
    made = encoder(version)
    zone = timezone(timedelta(hours=2))
    for number in range(3):
        message = json.loads(made.state(EMPTY, NOW.astimezone(zone)))
        assert message["headerId"] == number
        assert message["timestamp"] == "2026-01-02T03:04:05.678Z"
        assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", message["timestamp"])
        assert message["version"] == {V2: "2.1.0", V3: "3.0.0"}[version]
    # Each topic has its own numbers.
    assert json.loads(made.visualization(EMPTY, NOW))["headerId"] == 0
    assert json.loads(made.connection("ONLINE", NOW))["headerId"] == 0


def test_a_visualization_of_version_3_names_the_last_state():
    made = encoder(V3)
    for _ in range(4):
        made.state(EMPTY, NOW)
    assert json.loads(made.visualization(EMPTY, NOW))["referenceStateHeaderId"] == 3


def test_header_ids_begin_again_after_32_bits():
    made = encoder(V2)
    made._next["state"] = 2**32 - 1
    ids = [json.loads(made.state(EMPTY, NOW))["headerId"] for _ in range(2)]
    assert ids == [2**32 - 1, 0]
