"""The OpenAPI 3.1 document. Its schemas come from the structs that decode and encode."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

from firstfix import __version__
from firstfix.web.commands import Pose
from firstfix.web.dropped_files import MOST_FILES
from firstfix.web.incidents import Incidents, SavedIncident
from firstfix.web.locate_request import Query, Scan
from firstfix.web.map_changes import Changes
from firstfix.web.map_png import LEAST_PIXELS, MOST_PIXELS
from firstfix.web.messages import Accepted, Answer, LocatedFiles, Map, Status
from firstfix.web.problem_details import MEDIA_TYPE, Problem
from firstfix.web.request_body import JSON, NPZ

Schema = dict[str, Any]

_STRUCTS = (
    Incidents,
    SavedIncident,
    Pose,
    Query,
    Scan,
    Accepted,
    Answer,
    LocatedFiles,
    Map,
    Changes,
    Status,
    Problem,
)
# Refusals of requests with a body.
_BODY = (400, 408, 413, 415, 422)


def document() -> Schema:
    """Return the document."""
    description = (
        "Where is the robot? Metres, radians, seconds. Poses are [x, y, yaw] of the robot's base "
        "in the map frame."
    )
    return document_of("firstfix", description, _STRUCTS, _paths())


def document_of(title: str, description: str, structs: Sequence[type], paths: Schema) -> Schema:
    """Return the document of a server: its paths, and the schemas of its messages."""
    template = "#/components/schemas/{name}"
    _, schemas = msgspec.json.schema_components(structs, ref_template=template)
    return {
        "openapi": "3.1.0",
        "info": {
            "title": title,
            "version": __version__,
            "description": description,
            "license": {"name": "Apache-2.0", "identifier": "Apache-2.0"},
        },
        "servers": [{"url": "/"}],
        "paths": paths,
        "components": {
            "schemas": schemas,
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
        # The token is needed only if the server was started with one.
        "security": [{}, {"token": []}],
    }


def _paths() -> Schema:
    scan_body = {
        JSON: {"schema": {"anyOf": [_ref(Scan), _ref(Query)]}},
        NPZ: {"schema": {"description": "an .npz file with the arrays of Scan"}},
    }
    pixels = _query("max", f"longer side, pixels; larger values mean {MOST_PIXELS}")
    pixels["schema"] = {"type": "integer", "minimum": LEAST_PIXELS, "maximum": 99999}
    pixels["schema"]["default"] = MOST_PIXELS
    version = _query("v", "ignored; it changes with the map, so that caches do not keep old ones")
    map_name = _query("map", "name of the expected map, if the body does not have it")
    return {
        "/v1/status": {"get": _operation("State, pose, and why", _json(Status))},
        "/v1/map": {"get": _operation("The map in use", _json(Map), 503)},
        "/v1/map.png": {
            "get": _operation("The map as an 8-bit grey PNG", {"image/png": {}}, 422, 503)
            | {"parameters": [pixels, version]}
        },
        "/v1/map/changes": {
            "get": _operation("What has changed in the map", _json(Changes), 404, 503)
        },
        "/v1/map/changes.png": {
            "get": _operation(
                "What has changed as a PNG with alpha, over the map",
                {"image/png": {}},
                404,
                422,
                503,
            )
            | {"parameters": [pixels]}
        },
        "/v1/locate": {
            "post": _operation("Search scans in the map", _json(Answer), *_BODY, 404, 503)
            | {"parameters": [map_name], "requestBody": {"required": True, "content": scan_body}}
        },
        "/v1/locate-files": {
            "post": _operation(
                "Search a scan of a log in a map, both in the body",
                _json(LocatedFiles),
                *_BODY,
                503,
            )
            | {"parameters": _file_parameters(), "requestBody": _files_body()}
        },
        "/v1/pose": {
            "post": _operation("Set a pose hint", _json(Accepted), *_BODY, 403, 503, success=202)
            | {"requestBody": {"required": True, "content": _json(Pose)}}
        },
        "/v1/relocalize": {
            "post": _operation(
                "Discard the pose and search", _json(Accepted), 403, 503, success=202
            )
        },
        "/v1/incidents": {
            "get": _operation("The saved incidents, newest first", _json(Incidents), 409),
            "post": _operation(
                "Save the last seconds", _json(SavedIncident), 403, 422, 409, success=201
            ),
        },
        "/v1/incidents/{name}": {
            "get": _operation("An incident, for `firstfix replay`", {NPZ: {}}, 404, 409)
            | {"parameters": [_in_path("name", "one of the names of /v1/incidents")]}
        },
        "/openapi.json": {
            "get": _operation("This document", {JSON: {"schema": {"type": "object"}}})
        },
    }


def _file_parameters() -> list[Schema]:
    files = _query("file", "NAME:BYTES of each file, in the order of the body")
    files |= {"required": True, "explode": True}
    files["schema"] = {"type": "array", "items": {"type": "string"}, "maxItems": MOST_FILES}
    index = _query("index", "which scan of the log")
    index["schema"] = {"type": "integer", "minimum": 0, "maximum": 999_999, "default": 0}
    return [files, index]


def _files_body() -> Schema:
    content = {NPZ: {"schema": {"description": "the files, one after another"}}}
    return {"required": True, "content": content}


def _operation(summary: str, content: Schema, *refusals: int, success: int = 200) -> Schema:
    responses: Schema = {str(success): {"description": summary, "content": content}}
    if "image/png" in content:
        responses["304"] = {"description": "not modified"}
    for status in (*refusals, 401, 403, 421, 429):
        problem = {MEDIA_TYPE: {"schema": _ref(Problem)}}
        responses[str(status)] = {"description": "refused, with the reason", "content": problem}
    return {"summary": summary, "responses": responses}


def _json(struct: type) -> Schema:
    return {JSON: {"schema": _ref(struct)}}


def _ref(struct: type) -> Schema:
    return {"$ref": f"#/components/schemas/{struct.__name__}"}


def _query(name: str, description: str) -> Schema:
    return {"name": name, "in": "query", "description": description, "schema": {"type": "string"}}


def _in_path(name: str, description: str) -> Schema:
    return _query(name, description) | {"in": "path", "required": True}
