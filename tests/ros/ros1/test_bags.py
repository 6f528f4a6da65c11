"""`firstfix ros1` and bags played by ROS itself."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from ros1_bag import record
from ros1_lab import Lab, apart, wait_until

from firstfix.core.se2 import SE2

pytestmark = pytest.mark.slow


@pytest.fixture
def player(ros1: Lab) -> Lab:
    """Give a ROS 1 in the time of the bags."""
    ros1.master.set("/use_sim_time", True)
    return ros1


def test_a_restarted_bag_is_detected_and_the_robot_found_again(player: Lab, tmp_path: Path) -> None:
    truth = record(tmp_path / "stand.bag", "stand", seconds=6.0, began=1000.0)
    watcher = player.watch("initialpose")
    node = player.node()
    player.start("rosbag", "play", "--clock", "--loop", "--quiet", tmp_path / "stand.bag")

    again = re.compile("LOCALIZED.*time went back by.*SEARCHING.*LOCALIZED", re.DOTALL)
    wait_until(lambda: again.search(node.output), lambda: node.output)
    reported = again.search(node.output)
    assert reported is not None
    assert reported[0].count("time went back by") == 1
    wait_until(lambda: len(watcher.lines("initialpose")) > 1, lambda: node.output)
    for found in watcher.lines("initialpose"):
        assert 1000.0 <= found["stamp"] <= 1006.0
        assert apart(found, truth).is_small
    assert "Traceback" not in node.output


@pytest.mark.shared
def test_a_recorded_robot_is_found(player: Lab, shared: Path) -> None:
    case, bag = shared / "cases" / "uob_cs_test0", shared / "bags" / "uob_trace0.bag"
    if not case.exists() or not bag.exists():
        pytest.skip(f"no {case} or no {bag}")
    watcher = player.watch("initialpose", "/tf")
    node = player.node(
        "scan:=base_scan", "_base_frame_id:=base_link", f"_yaml_filename:={case / 'map.yaml'}"
    )
    node.wait_for_output("SEARCHING")
    player.start("rosbag", "play", "--clock", "--quiet", "-u", "20", bag)
    found = watcher.wait_for("initialpose")

    # The estimate of the AMCL of that robot at that time.
    links = []
    for frames in (["map", "odom"], ["odom", "base_link"]):
        lines = watcher.lines("/tf", frames=frames)
        nearest = min(lines, key=lambda line: abs(line["stamp"] - found["stamp"]))
        assert abs(nearest["stamp"] - found["stamp"]) < 0.2
        links.append(SE2(*nearest["pose"]))
    off = apart(found, links[0] @ links[1])
    assert off.metres < 0.3
    assert off.degrees < 6.0
