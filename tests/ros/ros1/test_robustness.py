"""`firstfix ros1` with faults, on a real master: it reports them, continues and ends cleanly."""

from __future__ import annotations

import re
import signal
import time
from pathlib import Path

import pytest
from ros1_lab import WITH_ROSOUT, Lab, Program, wait_until

pytestmark = pytest.mark.slow


def test_missing_topics_are_reported_and_awaited(ros1: Lab) -> None:
    watcher = ros1.watch("initialpose")
    node = ros1.node()
    flaws = ["no map", "no scan", "no stamp", "no odometry", "no laser frame", "map elsewhere"]
    robot = ros1.robot("stand", "--flaws", *flaws)
    for mended, warning in (
        ("", "no message on map (nav_msgs/OccupancyGrid)"),
        ("", "no message on scan (sensor_msgs/LaserScan)"),
        ("no scan", "a scan has no stamp: its driver must write one"),
        ("no stamp", "odometry (odom -> base_footprint) is unknown: no transform has the frame"),
        ("no odometry", "the pose of the laser is unknown: no transform has the frame laser;"),
        ("no map", "the map is in 'second_floor', not in 'map': used as it is"),
    ):
        flaws = [flaw for flaw in flaws if flaw != mended]
        robot.command(flaws=flaws)
        node.wait_for_output(warning)
    assert not watcher.lines("initialpose")
    robot.command(flaws=["map elsewhere"])
    found = watcher.wait_for("initialpose")
    assert ros1.error_of(found).is_small
    assert found["frame"] == "map"
    assert "Traceback" not in node.output
    assert_throttled(node)


def assert_throttled(node: Program) -> None:
    """Check that no warning is repeated within ten seconds."""
    said_at: dict[str, float] = {}
    for stamp, text in re.findall(r"\[WARN\] \[([\d.]+)\]: (.*)", node.output):
        about = re.sub(r"\d+", "", text)[:50]
        assert float(stamp) - said_at.get(about, 0.0) > 9.9, node.output
        said_at[about] = float(stamp)


def test_a_base_frame_without_transforms_is_reported_with_the_known_frames(ros1: Lab) -> None:
    node = ros1.node("_base_frame_id:=base_lynk")
    ros1.robot("stand")
    node.wait_for_output(
        "no transform has the frame base_lynk; known frames: base_footprint, laser, odom"
    )
    time.sleep(2.0)
    assert_throttled(node)
    node.send(signal.SIGINT)
    assert node.wait() == 0


def test_a_restarted_node_finds_the_robot_and_signals_end_it_cleanly(ros1: Lab) -> None:
    watcher = ros1.watch("initialpose")
    node = ros1.node()
    ros1.robot("stand")
    watcher.wait_for("initialpose")
    node.send(signal.SIGKILL)
    node.wait()
    for how in (signal.SIGINT, signal.SIGTERM):
        since = time.time()
        node = ros1.node()
        assert ros1.error_of(watcher.wait_for("initialpose", since)).is_small
        node.send(how)
        assert node.wait() == 0
        assert "Traceback" not in node.output


def test_a_node_ends_cleanly_while_its_kernels_are_compiled(ros1: Lab, tmp_path: Path) -> None:
    ros1.master.environment["NUMBA_CACHE_DIR"] = str(tmp_path / "nothing compiled yet")
    node = ros1.node("_mode:=full")
    wait_until(lambda: ros1.master.publishers("/amcl_pose"), lambda: node.output)
    time.sleep(2.0)
    node.send(signal.SIGINT)
    assert node.wait() == 0
    assert "Traceback" not in node.output
    # It took leave, and did not take the goodbye for a new master.
    assert not ros1.master.publishers("/amcl_pose")
    assert "registering anew" not in node.output


def test_the_node_registers_again_with_another_master(ros1: Lab) -> None:
    ros1.master.end()
    watcher = ros1.watch("amcl_pose")
    node = ros1.node("_mode:=full")
    robot = ros1.robot("stand")
    node.wait_for_output("waiting for the ROS master")
    ros1.master.start()
    watcher.wait_for("amcl_pose")

    ros1.master.end()
    gone = time.time()
    # What is connected stays so.
    watcher.wait_for("amcl_pose", after=gone + 1.0)
    ros1.master.start(WITH_ROSOUT)
    node.wait_for_output("the master was restarted: registering anew")
    for topic in ("/amcl_pose", "/localization_status", "/rosout"):
        wait_until(lambda topic=topic: ros1.master.publishers(topic), lambda: node.output)
    back = time.time()
    assert watcher.wait_for("amcl_pose", after=back)

    # The old robot is gone, and comes back by the new master; so do viewers and services.
    robot.end()
    again = ros1.watch("amcl_pose", "localization_status", "/rosout_agg")
    since = time.time()
    robot = ros1.robot("stand")
    assert ros1.error_of(again.wait_for("amcl_pose", about_after=since)).is_small
    robot.command(ask="reinitialize_global_localization")
    lost = again.wait_for("localization_status", about_after=since, state="SEARCHING")
    again.wait_for("localization_status", about_after=lost["stamp"], state="LOCALIZED")
    again.wait_for("/rosout_agg", after=since, node="/firstfix")
    assert "Traceback" not in node.output


def test_an_unusable_parameter_ends_the_node_with_one_sentence(ros1: Lab) -> None:
    nodes = [
        (ros1.node(f"__name:=node{i}", argument), expected)
        for i, (argument, expected) in enumerate(
            (
                ("_mode:=nonsense", "mode as one of bootstrap, full"),
                ("_pf_err:=-1", "pf_err"),
                ("_laser_max_beams:=30", "Nav2 calls it max_beams"),
                ("_base_frame:=base_link", "the nearest is base_frame_id"),
                ("_use_map_topic:=perhaps", "use_map_topic as true or false"),
                ("_yaml_filename:=/nowhere/map.yaml", "/nowhere/map.yaml"),
            )
        )
    ]
    for node, expected in nodes:
        assert node.wait() == 2
        reported = [
            line for line in node.output.splitlines() if "waiting for the ROS master" not in line
        ]
        assert len(reported) == 1, reported
        assert reported[0].startswith("firstfix: ")
        assert expected in reported[0]
