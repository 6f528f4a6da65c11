"""`firstfix ros1` with an AMCL, on a real master: it publishes initialpose, once."""

from __future__ import annotations

import time

import pytest
from ros1_lab import Lab, apart, wait_until

from firstfix.core.se2 import SE2

pytestmark = pytest.mark.slow

# Long enough for some more scans to do harm.
A_WHILE_S = 2.0


def test_a_robot_at_rest_is_found_once_and_late_subscribers_get_the_pose(ros1: Lab) -> None:
    watcher = ros1.watch("initialpose", "amcl_pose", "localization_status", "/tf")
    ros1.node()
    ros1.robot("stand")
    found = watcher.wait_for("initialpose")
    assert ros1.error_of(found).is_small
    assert found["frame"] == "map"
    reported = watcher.wait_for("localization_status", state="LOCALIZED")
    assert (reported["level"], reported["mode"]) == (0, "bootstrap")
    time.sleep(A_WHILE_S)
    assert len(watcher.lines("initialpose")) == 1
    assert not watcher.lines("amcl_pose")
    assert not watcher.lines("/tf", frames=["map", "odom"])

    # An AMCL that comes late, and one that comes in its place, get the pose of now.
    for _ in range(2):
        late = ros1.watch("initialpose", "localization_status")
        now = late.wait_for("initialpose")
        assert now["stamp"] > found["stamp"]
        assert ros1.error_of(now).is_small
        assert late.wait_for("localization_status")["state"] == "LOCALIZED"
        late.end()


def test_identical_places_are_published_instead_of_a_pose(ros1: Lab) -> None:
    watcher = ros1.watch(
        "initialpose", "hypotheses", "hypothesis_markers", "localization_status", "localized"
    )
    ros1.node()
    robot = ros1.robot("twins")
    reported = watcher.wait_for("localization_status", state="DISAMBIGUATING")
    assert reported["level"] == 1
    assert "4 places look identical to this sensor" in reported["message"]
    assert len(watcher.wait_for("hypotheses")["places"]) == int(reported["hypotheses"]) > 1
    assert watcher.wait_for("hypothesis_markers")["texts"] == ["25%"] * 4
    time.sleep(A_WHILE_S)
    assert not watcher.lines("initialpose")
    assert [line["data"] for line in watcher.lines("localized")] == [False]

    # The last hypotheses are there for viewers that come late.
    late = ros1.watch("hypotheses").wait_for("hypotheses")
    truth = ros1.truth_at(late["stamp"])
    x, y = min(late["places"], key=lambda place: abs(place[0] - truth.x) + abs(place[1] - truth.y))
    assert abs(x - truth.x) + abs(y - truth.y) < 0.2

    robot.command(hint=[truth.x + 0.2, truth.y - 0.2, truth.yaw + 0.2])
    reported = watcher.wait_for("localization_status", state="LOCALIZED")
    assert "chosen by a person" in reported["message"]
    handed_over = wait_until(
        lambda: watcher.lines("initialpose")[1:], lambda: "only the hint of the person"
    )[0]
    assert ros1.error_of(handed_over).is_small
    # The places that were left are gone.
    wait_until(lambda: not watcher.lines("hypotheses")[-1]["places"], lambda: "places stay")


def test_the_robot_is_searched_again_on_request_and_in_another_map(ros1: Lab) -> None:
    watcher = ros1.watch("initialpose", "localization_status")
    node = ros1.node()
    robot = ros1.robot("stand")
    found = watcher.wait_for("initialpose")
    robot.command()
    time.sleep(A_WHILE_S)
    assert len(watcher.lines("initialpose")) == 1, "the same map came again, and was taken as new"
    assert node.output.count("SEARCHING") == 1

    robot.command(ask="firstfix/request_nomotion_update")  # the name without a node is AMCL's
    for name in ("reinitialize_global_localization", "global_localization"):
        since = time.time()
        robot.command(ask=name)
        assert watcher.wait_for("localization_status", since, state="SEARCHING")["level"] == 1
        # The scan may have been taken just before the request, and arrive after it.
        assert ros1.error_of(watcher.wait_for("initialpose", since)).is_small

    since = time.time()
    robot.command(shift=[10.0, -5.0, 1.5])
    elsewhere = watcher.wait_for("initialpose", since)
    shifted = SE2(10.0, -5.0, 1.5) @ ros1.truth_at(elsewhere["stamp"])
    assert apart(elsewhere, shifted).is_small
    assert not apart(elsewhere, SE2(*found["pose"])).is_small


@pytest.mark.parametrize(
    "sensors", ["_scan_topics:=[front/scan, rear/scan]", "_cloud_topics:=points"]
)
def test_a_robot_with_several_sensors_is_found(ros1: Lab, sensors: str) -> None:
    """One of the lasers alone sees too little to be sure at rest."""
    watcher = ros1.watch("initialpose")
    node = ros1.node(sensors)
    ros1.robot("sensors")
    assert ros1.error_of(watcher.wait_for("initialpose")).is_small
    assert "WARN" not in node.output
