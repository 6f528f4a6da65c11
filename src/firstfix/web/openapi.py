"""The API described for programs, from the tables that check what they send."""

from __future__ import annotations

from firstfix import __version__
from firstfix.web.commands import POSE
from firstfix.web.map_png import LEAST_PIXELS, MOST_PIXELS
from firstfix.web.problem_details import MEDIA_TYPE
from firstfix.web.request_body import JSON, NPZ
from firstfix.web.schemas import Schema, entries, ref, schemas

# What can be wrong with a body.
_BODY = (400, 408, 413, 415, 422)


def document() -> Schema:
    """Return the OpenAPI 3.1 document."""
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "firstfix",
            "version": __version__,
            "description": "Where is the robot? Metres, radians, seconds; poses are "
            "[x, y, yaw] of the robot's base in the map frame.",
            "license": {"name": "Apache-2.0", "identifier": "Apache-2.0"},
        },
        "servers": [{"url": "/"}],
        "paths": _paths(),
        "components": {
            "schemas": schemas(),
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
        # None is needed unless the server was started with one.
        "security": [{}, {"token": []}],
    }


def _paths() -> Schema:
    pose_body = {JSON: {"schema": entries(POSE)}}
    scan_body = {
        JSON: {"schema": ref("Scan")},
        NPZ: {"schema": {"description": "an .npz file of arrays with the names of Scan"}},
    }
    pixels = _query("max", "longer side, pixels; more than the most is the most")
    pixels["schema"] = {"type": "integer", "minimum": LEAST_PIXELS, "maximum": 99999}
    pixels["schema"]["default"] = MOST_PIXELS
    version = _query("v", "passed over: a new map has a new URL")
    named = _query("map", "name of the map that is meant, where the body does not say it")
    return {
        "/v1/status": {"get": _operation("Where the robot is, and why", "Status")},
        "/v1/map": {"get": _operation("The map in use", "Map", 503)},
        "/v1/map.png": {
            "get": {
                **_operation("The map as an 8-bit grey PNG", None, 422, 503),
                "parameters": [pixels, version],
            }
        },
        "/v1/locate": {
            "post": {
                **_operation("Find a scan in the map", "Answer", *_BODY, 404, 503),
                "parameters": [named],
                "requestBody": {"required": True, "content": scan_body},
            }
        },
        "/v1/pose": {
            "post": {
                **_operation("A person says where the robot is", "Accepted", *_BODY, 403, 503),
                "requestBody": {"required": True, "content": pose_body},
            }
        },
        "/v1/relocalize": {
            "post": _operation("Forget, and search", "Accepted", 403, 503),
        },
        "/openapi.json": {"get": _operation("This document", "Document")},
    }


def _operation(summary: str, answer: str | None, *refusals: int) -> Schema:
    refused = {"content": {MEDIA_TYPE: {"schema": ref("Problem")}}}
    content = {"image/png": {}} if answer is None else {JSON: {"schema": ref(answer)}}
    done: Schema = {"description": summary, "content": content}
    responses: Schema = {"202" if answer == "Accepted" else "200": done}
    if answer is None:
        responses["304"] = {"description": "as the client has it already"}
    for status in (*refusals, 401, 403, 421, 429):
        responses[str(status)] = {"description": "refused, and why", **refused}
    return {"summary": summary, "responses": responses}


def _query(name: str, description: str) -> Schema:
    return {"name": name, "in": "query", "description": description, "schema": {"type": "string"}}
