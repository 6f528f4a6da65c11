"""The behaviour trees for Nav2: well-formed, of Nav2's own nodes, with services of the node."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from firstfix.ros.node_config import NodeConfig
from firstfix.ros.services import WAIT, ros2_services

TREES = Path(__file__).parents[2] / "ros" / "behavior_trees"
# Nodes in nav2_behavior_tree/nav2_tree_nodes.xml of Humble, Jazzy, Kilted and Lyrical, with ports
# that all four have; then those of BehaviorTree.CPP 3 and 4.
NODES = {
    "BackUp": {"backup_dist", "backup_speed"},
    "ClearEntireCostmap": {"service_name", "server_timeout"},
    "ComputePathToPose": {"goal", "path", "planner_id"},
    "FollowPath": {"path", "controller_id"},
    "GoalUpdated": set(),
    "InitialPoseReceived": set(),
    "PipelineSequence": set(),
    "RateController": {"hz"},
    "RecoveryNode": {"number_of_retries"},
    "ReinitializeGlobalLocalization": {"service_name", "server_timeout"},
    "RoundRobin": set(),
    "Spin": {"spin_dist"},
    "Wait": {"wait_duration"},
    "Fallback": set(),
    "ReactiveFallback": set(),
    "Sequence": set(),
}
DECORATORS = {"RateController": 1, "RecoveryNode": 2}
FILES = sorted(TREES.glob("*.xml"))


def tree(file: Path) -> ET.Element:
    root = ET.parse(file).getroot()  # noqa: S314 - our own file
    assert (root.tag, root.get("BTCPP_format")) == ("root", "4")
    (behaviour,) = root
    assert behaviour.tag == "BehaviorTree"
    assert behaviour.get("ID") == root.get("main_tree_to_execute")
    (top,) = behaviour
    return top


def test_there_are_a_recovery_and_a_whole_tree() -> None:
    assert [file.name for file in FILES] == ["navigate_when_localized.xml", "relocalize.xml"]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_nodes_and_ports_are_those_of_nav2(file: Path) -> None:
    for node in tree(file).iter():
        assert set(node.attrib) - {"name"} <= NODES[node.tag], node.tag
        if node.tag in DECORATORS:
            assert len(node) == DECORATORS[node.tag]
        for port in ("hz", "number_of_retries", "server_timeout", "wait_duration"):
            assert float(node.get(port, "1")) > 0.0
    assert "wait_duration=5." not in file.read_text()  # Humble takes whole seconds


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_services_are_those_of_the_node(file: Path) -> None:
    offered = {service.name: service.type_name for service in (*ros2_services(NodeConfig()), WAIT)}
    called = [
        node.get("service_name") for node in tree(file).iter("ReinitializeGlobalLocalization")
    ]
    assert set(called) == {"reinitialize_global_localization", "wait_until_localized"}
    assert {offered[name] for name in called} == {"std_srvs/Empty"}


def test_the_recovery_of_the_whole_tree_is_the_one_to_paste() -> None:
    recovery = tree(TREES / "relocalize.xml")
    whole = tree(TREES / "navigate_when_localized.xml")
    (pasted,) = [node for node in whole.iter("Fallback") if node.get("name") == "Relocalize"]
    assert shape(pasted) == shape(recovery)


def shape(node: ET.Element) -> tuple:
    return node.tag, sorted(node.attrib.items()), [shape(child) for child in node]
