"""`roslaunch firstfix firstfix.launch`, with the package laid out as pip installs it."""

from __future__ import annotations

import os
import shutil
import signal
import sys
from pathlib import Path

import pytest
from ros1_lab import Lab, wait_until

from firstfix.ros.parameters import parameters

pytestmark = pytest.mark.slow

ROS = Path(__file__).parents[3] / "ros"


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """Give an environment with the command and what belongs to ROS."""
    prefix = tmp_path / "prefix"
    share = prefix / "share" / "firstfix"
    for source, place in (
        ("package.xml", "package.xml"),
        ("ros1/firstfix.launch", "launch/firstfix.launch"),
        ("ros1/firstfix_ros1", "ros1/firstfix_ros1"),
    ):
        (share / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROS / source, share / place)
    command = prefix / "bin" / "firstfix"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m firstfix "$@"\n')
    command.chmod(0o755)
    return prefix


@pytest.mark.parametrize("name", sorted(path.name for path in (ROS / "ros1").glob("*.launch")))
def test_roslaunch_reads_it(ros1: Lab, name: str) -> None:
    launch = ros1.start("roslaunch", "--dump-params", ROS / "ros1" / name)
    assert launch.wait() == 0, launch.output
    found = {line.partition(":")[0].strip() for line in launch.output.splitlines() if ":" in line}
    known = {f"/firstfix/{parameter.name}" for parameter in parameters()}
    assert {"/firstfix/mode", "/firstfix/scan_topic"} <= found
    assert found <= known | {"/firstfix/use_map_topic"}


def test_the_launch_file_starts_a_node_and_starts_it_again(ros1: Lab, prefix: Path) -> None:
    ros1.master.environment["ROS_PACKAGE_PATH"] = str(prefix / "share")
    more = prefix / "more.yaml"
    more.write_text("max_particles: 1500\ninitial_pose: {x: 1.0}\n")
    watcher = ros1.watch("amcl_pose")
    ros1.robot("stand")
    ros1.master.publishers("/rosout")  # roslaunch would start a master where none answers
    launch = ros1.start(
        "roslaunch", "firstfix", "firstfix.launch", "mode:=full", f"params_file:={more}"
    )
    assert ros1.error_of(watcher.wait_for("amcl_pose")).is_small
    assert ros1.master.get("/firstfix/max_particles") == 1500

    first = ros1.master.pid_of("/firstfix")
    os.kill(first, signal.SIGKILL)
    second = wait_until(
        lambda: (
            ros1.master.pid_of("/firstfix") not in (0, first) and ros1.master.pid_of("/firstfix")
        ),
        lambda: launch.output,
    )
    last = watcher.lines("amcl_pose")[-1]["stamp"]
    assert ros1.error_of(watcher.wait_for("amcl_pose", about_after=last + 0.01)).is_small

    launch.send(signal.SIGINT)
    assert launch.wait() == 0
    assert not Path(f"/proc/{second}").exists()
    assert "Traceback" not in launch.output
