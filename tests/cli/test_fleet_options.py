"""Options of the bridge to a fleet control."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

BRIDGE = ("--vda5050", "mqtt://127.0.0.1:1", "--manufacturer", "ACME", "--serial-number", "0001")
MAP_ID = ("--map-id", "house")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (BRIDGE[:2], ("--manufacturer", "--serial-number", "--map-id")),
        (BRIDGE, ("needs --map-id",)),
        (MAP_ID, ("--map-id", "--vda5050 URL")),
        (("--vda5050-map", "a=b.yaml"), ("--vda5050-map", "--vda5050 URL")),
        ((*BRIDGE, "--map-id", "@"), ("map id", "'@'")),
        ((*BRIDGE, *MAP_ID, "--vda5050-map", "cellar"), ("ID=MAP.yaml", "cellar")),
        ((*BRIDGE, *MAP_ID, "--vda5050-map", "cellar=no.yaml"), ("no.yaml",)),
        ((*BRIDGE, *MAP_ID, "--manufacturer", "A/B"), ("manufacturer", "A/B")),
        ((*BRIDGE, *MAP_ID, "--serial-number", "0 1"), ("serial number", "0 1")),
        ((*BRIDGE, *MAP_ID, "--vda5050", "127.0.0.1"), ("mqtt://",)),
        ((*BRIDGE, *MAP_ID, "--vda5050", "mqtt://me:secret@h"), ("FIRSTFIX_MQTT_PASSWORD",)),
    ],
)
def test_options_that_cannot_be_used(cli: Any, options: tuple[str, ...], words: tuple[str, ...]):
    pytest.importorskip("aiomqtt")
    ended = cli("serve", "house", "--port", 0, *options)
    ended.assert_one_sentence(*words)
    assert "secret" not in ended.err


def test_a_version_that_is_none(cli: Any):
    assert cli("serve", "house", *BRIDGE, *MAP_ID, "--vda5050-version", "1.1").status == 2


def test_the_client_library_is_missing(cli: Any, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "aiomqtt", None)
    monkeypatch.delitem(sys.modules, "firstfix.vda5050.bridge", raising=False)
    cli("serve", "house", *BRIDGE, *MAP_ID).assert_one_sentence("aiomqtt", "firstfix[vda5050]")


@pytest.mark.parametrize("command", ["ros1", "ros2", "dds"])
def test_nodes_have_the_same_options(cli: Any, command: str, monkeypatch: pytest.MonkeyPatch):
    """The bridge of a node is made before the node, with the arguments of ROS left for it."""
    pytest.importorskip("aiomqtt")
    ran: list[Any] = []

    class Adapter:
        @staticmethod
        def run(*given: Any) -> None:
            ran.append(given)

    monkeypatch.setattr("firstfix.cli.nodes._load", lambda name: Adapter)
    given = () if command == "dds" else ("scan:=front", "_mode:=full")
    ended = cli(command, *given, *BRIDGE, *MAP_ID)
    assert ended.status == 0, ended
    assert len(ran) == 1
    if command != "dds":
        assert ran[0][0] == list(given)
    cli(command, *BRIDGE).assert_one_sentence("needs --map-id")


def test_the_node_of_a_bridge_is_watched_and_takes_poses(ros2: Any):
    from firstfix.cli.nodes import _maker
    from firstfix.ros.node_config import NodeConfig

    sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))
    from recorder import Recorder

    class Bridge:
        def attach(self, give: Any) -> None:
            self.give = give

    bridge: Any = Bridge()
    node = _maker(bridge)(NodeConfig(), Recorder(ros2))
    assert list(node._watchers) == [bridge]
    assert bridge.give == node.give
