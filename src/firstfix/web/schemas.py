"""What the API sends and takes, in JSON Schema."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from firstfix.core.scan import MAX_BEAMS
from firstfix.localizer.states import State
from firstfix.web.commands import Entry
from firstfix.web.locate_queue import SENSOR
from firstfix.web.request_body import MOST_BYTES

Schema = dict[str, Any]

_BOOLEAN: Schema = {"type": "boolean"}
_NUMBER: Schema = {"type": "number"}
_SHARE: Schema = {"type": "number", "minimum": 0, "maximum": 1}
_TEXT: Schema = {"type": "string"}
_COUNT: Schema = {"type": "integer", "minimum": 0}


def ref(name: str) -> Schema:
    """Refer to one of `schemas`."""
    return {"$ref": f"#/components/schemas/{name}"}


def entries(table: Mapping[str, Entry], *others: str) -> Schema:
    """Describe an object that needs these entries, and others that are described elsewhere."""
    return {
        "type": "object",
        "properties": {name: entry.schema() for name, entry in table.items()},
        "required": [*table, *others],
    }


def _numbers(count: int, description: str) -> Schema:
    return {
        "type": "array",
        "items": _NUMBER,
        "minItems": count,
        "maxItems": count,
        "description": description,
    }


def _record(properties: Schema) -> Schema:
    """Describe an object of the server, which always has all of its entries."""
    return {"type": "object", "properties": properties, "required": [*properties]}


def _or_null(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


_POSE = _numbers(3, "x m, y m, yaw rad")
_COVARIANCE: Schema = {
    "type": "array",
    "items": _numbers(3, "a row"),
    "minItems": 3,
    "maxItems": 3,
}


def schemas() -> Schema:
    """Return the schema of each thing that has a name."""
    evidence = dict.fromkeys(("explained", "short", "through_wall", "unknown"), _SHARE)
    return {
        "Scan": _scan(),
        "Evidence": _record(evidence | {"beams": _COUNT}),
        "Hypothesis": _record(
            {
                "pose": _POSE,
                "covariance": _COVARIANCE,
                "score": _NUMBER,
                "probability": _SHARE,
                "evidence": ref("Evidence"),
            }
        ),
        "Answer": _record(
            {
                "index": _COUNT,
                "verdict": {"enum": ["UNIQUE", "AMBIGUOUS", "NO_MATCH"]},
                "reason": _TEXT,
                "pose": _or_null(_POSE),
                "covariance": _or_null(_COVARIANCE),
                "hypotheses": {"type": "array", "items": ref("Hypothesis")},
                "search": _record({"poses": _COUNT, "searched": _SHARE, "proven": _BOOLEAN}),
                "elapsed_s": _NUMBER,
                "error": {"type": "null"},
            }
        ),
        "Status": _status(),
        "Map": _record(
            {
                "name": _TEXT,
                "width": _COUNT,
                "height": _COUNT,
                "resolution": _NUMBER,
                "origin": _POSE,
                "image": _record(
                    {"width": _COUNT, "height": _COUNT, "resolution": _NUMBER, "url": _TEXT}
                ),
            }
        ),
        "Accepted": _record({"detail": _TEXT}),
        "Problem": _record({"type": _TEXT, "title": _TEXT, "status": _COUNT, "detail": _TEXT}),
        "Document": {"type": "object"},
    }


def _scan() -> Schema:
    scan = entries(SENSOR, "ranges")
    scan["properties"] |= {
        "ranges": {
            "type": "array",
            "items": {"type": ["number", "null"]},
            "minItems": 1,
            "maxItems": MAX_BEAMS,
            "description": "m; null where nothing returned",
        },
        "T_base_laser": _numbers(3, "place of the sensor on the robot: x, y, yaw"),
        "map": {"type": "string", "description": "its name, if it must be that one"},
    }
    scan["additionalProperties"] = False
    scan["description"] = f"at most {MOST_BYTES} bytes"
    return scan


def _status() -> Schema:
    place = {"pose": _POSE, "probability": _SHARE, "explained": _SHARE}
    return _record(
        {
            "type": {"const": "state"},
            "stamp": _NUMBER,
            "state": {"enum": [state.value for state in State]},
            "reason": _TEXT,
            "pose": _or_null(_POSE),
            "covariance": _or_null(_numbers(4, "xx, xy, yy, yaw yaw")),
            "hypotheses": {"type": "array", "items": _record(place)},
            "evidence": _or_null(ref("Evidence")),
            "particles": _COUNT,
            "cpu_ms": _or_null(_NUMBER),
            "time_to_fix_s": _or_null(_NUMBER),
            "motion": _or_null(_record({"turn": _NUMBER, "ahead": _NUMBER})),
            "truth": _or_null(_POSE),
            "paused": _BOOLEAN,
            "viewers": _COUNT,
        }
    )
