"""Instant actions: a pose that is verified, and what is kept of actions."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from action_desk import Desk

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import PoseHint, Reset
from firstfix.localizer.states import State
from firstfix.vda5050.report import ActionStatus, Problem

RUNNING, FINISHED, FAILED = ActionStatus.RUNNING, ActionStatus.FINISHED, ActionStatus.FAILED


@pytest.mark.parametrize("kind", ["initPosition", "initializePosition"])
def test_a_right_pose_is_verified(desk: Desk, kind: str):
    where = {"x": 3.3, "y": 1.8, "theta": 0.6, "mapId": "hall", "lastNodeId": "n7"}
    assert desk.act(kind, "a", **where).status is RUNNING
    assert desk.actions.last_node_id == ""
    desk.robot.scan()
    assert desk.report("a").status is FINISHED
    assert re.match(r"found at \((2.9|3.0)\d, (1.9|2.0)\d\) m", desk.report("a").result)
    assert desk.actions.last_node_id == "n7"
    assert desk.problems == []


def test_whole_numbers_are_numbers(desk: Desk):
    desk.robot.pose = SE2(3.0, 2.0, 0.0)
    assert desk.pose("a", 3, 2, 0).status is RUNNING
    desk.robot.scan()
    assert desk.report("a").status is FINISHED


def test_a_wrong_pose_is_overruled(desk: Desk):
    assert desk.pose("a", 7.5, 6.0, -2.0).status is RUNNING
    desk.robot.scan()
    assert desk.report("a").status is FAILED
    assert "does not explain the scan" in desk.report("a").result
    assert desk.actions.last_node_id == ""
    desk.robot.scan()
    assert desk.robot.localizer.state is State.LOCALIZED  # where it is, not where it was said to be


def test_a_pose_outside_of_the_map_fails_at_once(desk: Desk):
    report = desk.pose("a", 900.0, 2.0, 0.0)
    assert report.status is FAILED
    assert "refused" in report.result


def test_a_newer_pose_replaces_an_older_one(desk: Desk):
    desk.pose("a", 7.5, 6.0, 0.0)
    desk.pose("b", 3.0, 2.0, 0.5)
    assert desk.report("a").status is FAILED
    desk.robot.scan()
    assert desk.report("b").status is FINISHED
    assert desk.actions.last_node_id == "of b"


@pytest.mark.parametrize(
    "other", [lambda grid: Reset(1.0), lambda grid: PoseHint(1.0, (5.0, 5.0, 0.0))]
)
def test_what_others_do_ends_the_check(desk: Desk, other: Callable[[OccupancyGrid], Any]):
    desk.pose("a", 3.0, 2.0, 0.5)
    desk.robot.give(other(desk.robot.grid))
    assert desk.report("a").status is FAILED
    assert "another" in desk.report("a").result


def test_a_robot_in_the_air_is_verified_when_it_is_set_down(desk: Desk):
    desk.robot.give(Signal(1.0, SignalKind.PICKED_UP, active=True))
    assert desk.pose("a", 3.0, 2.0, 0.5).status is RUNNING
    desk.robot.scan()
    assert desk.report("a").status is RUNNING
    desk.robot.give(Signal(desk.robot.stamp, SignalKind.PICKED_UP, active=False))
    desk.robot.scan()
    assert desk.report("a").status is FINISHED


def test_a_pose_before_the_first_map_fails(robot: Any):
    desk = Desk(robot)
    robot.watchers.clear()  # there is no map to look at
    robot.watchers.append(lambda given, outputs, _: desk.actions.observe(given, outputs))
    assert desk.pose("a", 3.0, 2.0, 0.5).status is FAILED
    assert "no map" in desk.report("a").result


def test_an_action_that_comes_again_is_not_repeated(desk: Desk):
    desk.pose("a", 3.0, 2.0, 0.5)
    desk.robot.scan()
    assert desk.pose("a", 7.5, 6.0, 0.0).status is FINISHED
    assert desk.robot.localizer.state is State.LOCALIZED


BAD = [
    {"x": "3.0"},
    {"x": None},
    {"y": True},
    {"theta": [0.5]},
    {"x": 1e300},
    {"x": -2e6},
    {"mapId": 7},
    {"mapId": "m" * 300},
    {"lastNodeId": {}},
]


@pytest.mark.parametrize("change", BAD, ids=str)
def test_parameters_that_cannot_be_used(desk: Desk, change: dict[str, Any]):
    report = desk.pose("a", 3.0, 2.0, 0.5, **change)
    assert report.status is FAILED
    assert next(iter(change)) in report.result
    assert desk.problems == [Problem.BAD_ACTION]
    assert desk.robot.localizer.state is State.SEARCHING  # nothing has changed


def test_a_parameter_that_is_missing(desk: Desk):
    report = desk.act("initPosition", "a", x=1.0, y=1.0, theta=0.0)
    assert "mapId" in report.result


def test_an_unknown_action_is_an_error_until_another_is_accepted(desk: Desk):
    report = desk.act("pick", "a", lhd="front")
    assert report.status is FAILED
    assert "initPosition" in report.result
    (error,) = desk.actions.errors
    assert error.problem is Problem.BAD_ACTION
    assert ("actionId", "a") in error.references
    assert desk.act("stateRequest", "b").status is FINISHED
    assert desk.problems == []


def test_ended_actions_are_forgotten(desk: Desk):
    desk.pose("running", 3.0, 2.0, 0.5)
    for number in range(120):
        desk.act("stateRequest", f"{number}")
    ids = [report.id for report in desk.actions.reports]
    assert len(ids) == 50
    assert ids[0] == "running"
    assert ids[-1] == "119"
    desk.act("clearInstantActions", "end")
    assert [report.id for report in desk.actions.reports] == ["running", "end"]


def test_refused_actions_are_forgotten_too(desk: Desk):
    for number in range(120):
        desk.act("pick", f"{number}")
    assert len(desk.actions.reports) == 50
    assert len(desk.actions.errors) <= 50
