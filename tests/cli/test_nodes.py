"""``firstfix ros1``, ``ros2``, ``dds``: what they need, and what they pass on."""

import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest

from firstfix.cli.nodes import runner

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))

from ros2_lab import Lab

NEEDED = {"ros1": "rospy", "ros2": "rclpy", "dds": "cyclonedds"}


@pytest.mark.parametrize("command", NEEDED)
def test_a_missing_library_is_refused_with_a_remedy(cli, command: str) -> None:
    if importlib.util.find_spec(NEEDED[command]) is not None:
        pytest.skip(f"this Python has {NEEDED[command]}")
    ended = cli(command)
    assert ended.status == 2
    assert f"expected {NEEDED[command]} in this Python" in ended.err
    assert ended.err.count("\n") == 1


def test_ros2_passes_on_all_arguments(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    lab = Lab(monkeypatch)
    nodes: list[Any] = []
    given = ["-p", "mode:=full", "-r", "__ns:=/robot1", "-r", "scan:=base_scan", "-p", "z_hit:=0.6"]
    lab.world.during_spin = lambda node: nodes.append(node.get_parameter("z_hit").value)
    assert cli("ros2", "--ros-args", *given).status == 0
    assert nodes == [0.6]
    assert lab.world.arguments.remappings == {"__ns": "/robot1", "scan": "base_scan"}
    assert lab.world.arguments.parameters == {"mode": "full", "z_hit": 0.6}


def test_ros2_passes_on_its_site(cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lab = Lab(monkeypatch)
    monkeypatch.chdir(tmp_path)
    assert cli("ros2", "--site", "floors", "--ros-args", "-p", "mode:=full").status == 0
    assert lab.world.arguments.parameters == {"mode": "full", "site": str(tmp_path / "floors")}


def test_ros2_refuses_wrong_arguments_in_one_line(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    Lab(monkeypatch)
    ended = cli("ros2", "-p", "mode:=full")
    assert ended.status == 2
    assert "--ros-args -p mode:=full" in ended.err
    assert ended.err.count("\n") == 1


def test_beside_a_page_the_node_starts_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    lab = Lab(monkeypatch)
    seen: dict[str, Any] = {}
    lab.world.during_spin = lambda node: seen.update(lab.world.arguments.parameters)
    runner("ros2")({"yaml_filename": "nowhere.yaml"}, ["--ros-args", "-p", "mode:=full"], None)
    assert seen == {"mode": "full", "yaml_filename": "nowhere.yaml", "autostart": True}
