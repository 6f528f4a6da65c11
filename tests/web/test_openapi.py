"""The OpenAPI document is valid, and the server conforms to it."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest
from live_lab import drive, fed

from firstfix.web.api import Api
from firstfix.web.broadcaster import Broadcaster
from firstfix.web.openapi import document

REFS = "#/components/schemas/"


def references(node: object) -> set[str]:
    """Return all references of a document."""
    if isinstance(node, dict):
        own = {node["$ref"]} if "$ref" in node else set()
        return own.union(*(references(value) for value in node.values()))
    if isinstance(node, list):
        return set().union(*(references(value) for value in node))
    return set()


def test_every_reference_is_defined_and_every_schema_is_used():
    described = document()
    schemas = {REFS + name for name in described["components"]["schemas"]}
    assert references(described) == schemas


def test_every_route_is_described_with_its_method():
    begun = drive("house")
    broadcaster = Broadcaster(begun.store, str, lambda: None)
    routes = Api(None, broadcaster).routes()
    served = {(route.path, method) for route in routes for method in route.methods - {"HEAD"}}
    described = {
        (path, method.upper())
        for path, methods in document()["paths"].items()
        for method in methods
    }
    assert described == served


def test_every_refusal_is_a_problem():
    for path, methods in document()["paths"].items():
        for method, operation in methods.items():
            for status, answer in operation["responses"].items():
                if int(status) >= 400:
                    assert [*answer["content"]] == ["application/problem+json"], (path, method)


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("schemathesis") is None, reason="schemathesis is not installed"
)
def test_schemathesis_finds_no_deviation_from_the_document():
    begun = drive("house")
    begun.step(25)
    arguments = (
        *("--seed", "1", "--max-examples", "10", "--generation-deterministic"),
        *("--rate-limit", "30/s", "--workers", "1", "--no-color"),
        # For a schema, any bytes may be an .npz.
        *("--exclude-checks", "positive_data_acceptance"),
    )
    with fed(store=begun.store) as site:
        command = [sys.executable, "-m", "schemathesis.cli", "run", site.url + "openapi.json"]
        ended = subprocess.run(
            [*command, *arguments], capture_output=True, text=True, timeout=240, check=False
        )
    assert ended.returncode == 0, ended.stdout[-4000:] + ended.stderr[-2000:]
    assert "Tested: 12" in ended.stdout
