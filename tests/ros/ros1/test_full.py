"""`firstfix ros1` in the place of AMCL, on a real master: it follows the robot."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from ros1_lab import Lab, apart, wait_until

from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.lab.worlds.catalog import WORLDS

pytestmark = pytest.mark.slow

DRIVE_S = 15.0


def test_a_drive_is_followed_at_the_rate_of_the_scans(ros1: Lab) -> None:
    watcher = ros1.watch("scan", "amcl_pose", "/tf", "particle_cloud", "initialpose")
    ros1.node("_mode:=full", "_cloud_rate:=2.0", "_transform_tolerance:=0.5")
    ros1.robot("drive")
    first = watcher.wait_for("amcl_pose")
    wait_until(
        lambda: watcher.lines("scan", after=first["at"] + DRIVE_S), lambda: "the robot stopped"
    )
    poses = watcher.lines("amcl_pose", after=first["at"])
    scans = {line["stamp"]: line["at"] for line in watcher.lines("scan")}

    metres, degrees = np.transpose([ros1.error_of(pose) for pose in poses])
    assert np.median(metres) < 0.05
    assert np.median(degrees) < 1.0
    assert metres.max() < 0.3
    assert degrees.max() < 8.0

    # Every scan counts that is not given up for a newer one, as it happens on a busy machine.
    # Stamps rise, and each has its transform, dated ahead.
    stamps = [pose["stamp"] for pose in poses]
    assert all(a < b for a, b in pairwise(stamps))
    assert set(stamps) <= set(scans)
    since = [stamp for stamp in scans if stamp > first["stamp"]]
    assert len(stamps) >= 0.3 * len(since)
    ahead = {round(t["stamp"] - 0.5, 4) for t in watcher.lines("/tf", frames=["map", "odom"])}
    assert {round(stamp, 4) for stamp in stamps[:-1]} <= ahead

    clouds = [line["stamp"] for line in watcher.lines("particle_cloud")]
    assert len(clouds) > 0.3 * 2.0 * DRIVE_S
    assert np.diff(clouds).min() > 0.49
    assert not watcher.lines("initialpose")

    late = [1e3 * (p["at"] - scans[p["stamp"]]) for p in poses if p["stamp"] in scans]
    sys.stdout.write(
        f"error {np.median(metres):.3f} m (up to {metres.max():.3f} m), {np.median(degrees):.2f}° "
        f"(up to {degrees.max():.2f}°); scan to amcl_pose {np.median(late):.1f} ms, "
        f"p99 {np.percentile(late, 99):.1f} ms; {len(poses)} poses of {len(since)} scans\n"
    )


def test_a_robot_that_is_carried_away_is_found_where_it_is_set_down(ros1: Lab) -> None:
    watcher = ros1.watch("initialpose", "amcl_pose", "localization_status", "events/wheel_drop")
    follower = ros1.node("_mode:=full", "__name:=follower", "initialpose:=nowhere")
    helper = ros1.node("__name:=helper", "localization_status:=helper/status")
    robot = ros1.robot("carried")
    watcher.wait_for("amcl_pose")
    before = watcher.wait_for("initialpose")
    time.sleep(1.0)
    assert len(watcher.lines("initialpose")) == 1

    robot.command(go=True)
    lifted = watcher.wait_for("events/wheel_drop", state=1)
    lost = watcher.wait_for("localization_status", state="LIFTED", after=lifted["at"] - 0.5)
    assert "waiting until the robot is set down" in lost["message"]
    assert lost["level"] == 1
    standing = watcher.wait_for("events/wheel_drop", after=lifted["at"] + 1.0, state=0)
    again = watcher.wait_for("initialpose", after=lost["at"])
    followed = watcher.wait_for("amcl_pose", after=lost["at"])
    # Not a word meanwhile.
    assert min(again["at"], followed["at"]) > standing["at"]
    for found in (again, followed):
        assert ros1.error_of(found).is_small
        assert abs(found["pose"][0] - before["pose"][0]) > 1.0
    watcher.wait_for("localization_status", state="LOCALIZED", after=lost["at"])
    assert "Traceback" not in follower.output + helper.output


def test_at_rest_a_scan_is_used_on_request_and_late_subscribers_get_the_pose(ros1: Lab) -> None:
    watcher = ros1.watch("amcl_pose", "particle_cloud")
    ros1.node("_mode:=full")
    robot = ros1.robot("stand")
    watcher.wait_for("amcl_pose")

    def clouds() -> list[list[list[float]]]:
        return [line["places"] for line in watcher.lines("particle_cloud")[-3:]]

    wait_until(
        lambda: len(clouds()) == 3 and all(a == b for a, b in pairwise(clouds())),
        lambda: "a filter that updates at rest",
    )
    at_rest = clouds()[-1]
    robot.command(ask="request_nomotion_update")
    wait_until(lambda: clouds()[-1] != at_rest, lambda: "no update of the filter")

    # Also when the robot has fallen silent.
    robot.end()
    late = ros1.watch("amcl_pose", "localization_status")
    assert late.wait_for("amcl_pose")["pose"] == watcher.lines("amcl_pose")[-1]["pose"]
    # No scan for longer than scan_timeout: the pose is still there, and its status says so.
    assert late.wait_for("localization_status")["state"] in ("LOCALIZED", "STALE")


@pytest.mark.parametrize("source", ["service", "file"])
def test_the_map_comes_from_its_configured_source(ros1: Lab, source: str, tmp_path: Path) -> None:
    watcher = ros1.watch("initialpose")
    if source == "service":
        ros1.node("_use_map_topic:=false")
        ros1.robot("stand", "--serve-map", "--flaws", "no map")
    else:
        save_map(WORLDS["office"](), tmp_path / "office.yaml")
        ros1.node(f"_yaml_filename:={tmp_path / 'office.yaml'}")
        ros1.robot("stand", "--flaws", "no map")
    assert ros1.error_of(watcher.wait_for("initialpose")).is_small


def test_another_map_is_used_on_request_and_named(ros1: Lab, tmp_path: Path) -> None:
    office = WORLDS["office"]()
    shift = SE2(10.0, -5.0, 1.5)
    save_map(office, tmp_path / "floor1.yaml")
    save_map(replace(office, T_map_grid=shift @ office.T_map_grid), tmp_path / "floor2.yaml")
    watcher = ros1.watch("amcl_pose", "map_id")
    ros1.node("_mode:=full", f"_yaml_filename:={tmp_path / 'floor1.yaml'}")
    robot = ros1.robot("stand", "--flaws", "no map")
    assert ros1.error_of(watcher.wait_for("amcl_pose")).is_small
    robot.command(load=str(tmp_path / "floor2.yaml"))
    second = watcher.wait_for("map_id", data="floor2")
    there = watcher.wait_for("amcl_pose", after=second["at"])
    assert apart(there, shift @ ros1.truth_at(there["stamp"])).is_small
    truth = ros1.truth_at(there["stamp"])
    robot.command(set=[truth.x, truth.y, truth.yaw])  # the map of the robot, which was not moved
    third = wait_until(lambda: watcher.lines("map_id")[2:], lambda: robot.output)[0]
    assert ros1.error_of(watcher.wait_for("amcl_pose", after=third["at"])).is_small
    assert [line["data"] for line in watcher.lines("map_id")][:2] == ["floor1", "floor2"]
    robot.wait_for_output("load_map: 0")
    robot.command(load=str(tmp_path / "floor3.yaml"))
    robot.wait_for_output("load_map: 1")
