"""The OpenAPI 3.1 document. Its schemas come from the structs that decode and encode."""

from __future__ import annotations

from typing import Any

from firstfix.fleet.messages import (
    ROBOT_NAME,
    Health,
    LocateScans,
    Maps,
    Robots,
    RobotScans,
    SiteAnswer,
)
from firstfix.web.locate_request import Scan
from firstfix.web.openapi import document_of
from firstfix.web.problem_details import MEDIA_TYPE, Problem
from firstfix.web.request_body import JSON, NPZ

Schema = dict[str, Any]

_STRUCTS = (Health, LocateScans, Maps, Problem, RobotScans, Robots, Scan, SiteAnswer)
_BODY = (400, 404, 408, 413, 415, 422, 503)


def document() -> Schema:
    """Return the document."""
    description = (
        "Which map, and where on it? Metres, radians, seconds. Poses are [x, y, yaw] of the "
        "robot's base in the frame of its map."
    )
    return document_of("firstfix fleet", description, _STRUCTS, _paths())


def _paths() -> Schema:
    name = {
        "name": "robot",
        "in": "path",
        "required": True,
        "schema": {"type": "string", "pattern": f"^{ROBOT_NAME}$"},
    }
    map_id = {
        "name": "map",
        "in": "query",
        "description": "the map of the robot, if it is known and the body does not have it",
        "schema": {"type": "string"},
    }
    scans = {
        JSON: {"schema": {"anyOf": [_ref(LocateScans), _ref(Scan)]}},
        NPZ: {"schema": {"description": "an .npz file with the arrays of Scan"}},
    }
    return {
        "/v1/locate": {
            "post": _operation("Find the map and the place of a robot", SiteAnswer, *_BODY)
            | {"parameters": [map_id], "requestBody": {"required": True, "content": scans}}
        },
        "/v1/robots/{robot}/scans": {
            "parameters": [name],
            "post": _operation("Judge scans together with the last ones", SiteAnswer, *_BODY)
            | {"requestBody": {"required": True, "content": _json(RobotScans)}},
        },
        "/v1/robots/{robot}": {
            "parameters": [name],
            "get": _operation("The last answer to a robot", SiteAnswer, 404, 422),
            "delete": _operation("Forget a robot", None, 404, 422),
        },
        "/v1/robots": {"get": _operation("The robots that are remembered", Robots)},
        "/v1/maps": {"get": _operation("All maps, and why some cannot be used", Maps)},
        "/healthz": {"get": _operation("The service runs", Health)},
        "/readyz": {"get": _ready()},
        "/metrics": {"get": _operation("Figures for Prometheus", "text/plain")},
        "/openapi.json": {"get": _operation("This document", JSON)},
    }


def _ready() -> Schema:
    operation = _operation("All maps are prepared", Health)
    answer = {"description": "some maps are not prepared yet", "content": _json(Health)}
    operation["responses"]["503"] = answer
    return operation


def _operation(summary: str, answer: type | str | None, *refusals: int) -> Schema:
    responses: Schema = {}
    if answer is None:
        responses["204"] = {"description": summary}
    else:
        content: Schema = {answer: {}} if isinstance(answer, str) else _json(answer)
        responses["200"] = {"description": summary, "content": content}
    for status in (*refusals, 401, 403, 421, 429):
        problem = {MEDIA_TYPE: {"schema": _ref(Problem)}}
        responses[str(status)] = {"description": "refused, with the reason", "content": problem}
    return {"summary": summary, "responses": responses}


def _json(struct: type) -> Schema:
    return {JSON: {"schema": _ref(struct)}}


def _ref(struct: type) -> Schema:
    return {"$ref": f"#/components/schemas/{struct.__name__}"}
