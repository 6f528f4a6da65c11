"""A node of ROS 1 that is killed, and finds its place after a restart."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from ros1_lab import Lab, wait_until

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_in_one_of_four_equal_rooms_a_restarted_node_finds_its_room(
    ros1: Lab, tmp_path: Path, end: signal.Signals
) -> None:
    file = tmp_path / "pose.json"
    watcher = ros1.watch("scan", "initialpose", "localization_status")
    arguments = (f"_saved_pose_file:={file}", "_save_pose_rate:=5.0")
    first = ros1.node(*arguments)
    robot = ros1.robot("twins")
    watcher.wait_for("localization_status", state="DISAMBIGUATING")
    assert not watcher.lines("initialpose")

    here = ros1.truth_at(watcher.wait_for("scan")["stamp"])
    robot.command(hint=[here.x, here.y, here.yaw])
    watcher.wait_for("localization_status", state="LOCALIZED")
    robot.command(gone=True)
    wait_until(file.exists, lambda: f"no {file}; {first.output}")
    first.send(end)
    first.wait()

    killed = watcher.lines("scan")[-1]["at"]
    second = ros1.node(*arguments)
    found = watcher.wait_for("initialpose", after=killed)
    assert ros1.error_of(found).is_small
    # It has not moved since it was switched on.
    assert "the saved pose is used as it was saved: saved " in second.output
    assert "LOCALIZED: chosen by the saved pose; " in second.output
