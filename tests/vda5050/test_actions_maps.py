"""Instant actions on maps: enabled, and neither downloaded nor deleted."""

from __future__ import annotations

from typing import Any

import pytest
from action_desk import Desk

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import map_key
from firstfix.lab.worlds.drawing import Drawing
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.states import State
from firstfix.vda5050.maps import KnownMap, MapName
from firstfix.vda5050.report import ActionStatus, Problem

RUNNING, FINISHED, FAILED = ActionStatus.RUNNING, ActionStatus.FINISHED, ActionStatus.FAILED


@pytest.fixture
def cellar() -> OccupancyGrid:
    """Give another map: the robot's hall, mirrored, with a pillar."""
    plan = Drawing(9.0, 7.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 9.0, 7.0)
    plan.solid(7.0, 5.0, 8.9, 6.9)
    plan.solid(2.5, 2.0, 3.0, 3.5)
    return plan.grid()


def known(name: MapName, grid: OccupancyGrid) -> KnownMap:
    return KnownMap(name, map_key(grid), grid)


@pytest.fixture
def floors(robot: Any, cellar: OccupancyGrid) -> Desk:
    """Give a robot with a second map."""
    made = Desk(robot, known(MapName("cellar", "1"), cellar))
    robot.begin()
    return made


def statuses(desk: Desk) -> dict[str, bool]:
    return {f"{entry.id} {entry.version}": entry.is_enabled for entry in desk.maps.entries}


def test_only_the_map_in_use_is_enabled_at_first(floors: Desk):
    assert statuses(floors) == {"hall 1": True, "cellar 1": False}


def test_a_pose_on_another_map_needs_an_enabled_one(floors: Desk, cellar: OccupancyGrid):
    report = floors.pose("a", 5.0, 3.0, 1.0, mapId="cellar")
    assert report.status is FAILED
    assert "enableMap" in report.result
    assert floors.problems == [Problem.UNKNOWN_MAP]
    report = floors.act("enableMap", "b", mapId="cellar", mapVersion="1")
    assert report.status is FINISHED
    assert statuses(floors) == {"hall 1": True, "cellar 1": True}
    assert floors.maps.id_in_use == "hall"  # enabled, but not entered
    floors.robot.grid, floors.robot.pose = cellar, SE2(5.0, 3.0, 1.0)
    assert floors.pose("c", 5.1, 3.0, 1.0, mapId="cellar").status is RUNNING
    assert floors.maps.id_in_use == "cellar"
    floors.robot.scan()
    assert floors.report("c").status is FINISHED
    assert (
        floors.pose("d", 5.1, 3.0, 1.0, mapId="attic").result == "Map attic is not on this robot."
    )


def test_another_version_of_the_map_in_use_replaces_it(robot: Any, cellar: OccupancyGrid):
    desk = Desk(robot, known(MapName("hall", "2"), cellar))
    robot.begin()
    robot.scan()
    assert desk.act("enableMap", "a", mapId="hall", mapVersion="2").status is FINISHED
    assert statuses(desk) == {"hall 1": False, "hall 2": True}
    assert robot.localizer.matcher.fields.grid is cellar
    assert robot.localizer.state is State.VERIFYING_HINT  # at the same pose, if scans fit it


def test_maps_that_cannot_be_enabled(floors: Desk):
    for number, name in enumerate([("cellar", "9"), ("attic", "1")]):
        report = floors.act("enableMap", f"{number}", mapId=name[0], mapVersion=name[1])
        assert report.status is FAILED
        assert "not on this robot" in report.result
    assert floors.problems == [Problem.UNKNOWN_MAP] * 2


def test_maps_are_neither_downloaded_nor_deleted(floors: Desk):
    link = "http://127.0.0.1:1/map.zip"
    new = floors.act("downloadMap", "a", mapId="attic", mapVersion="1", mapDownloadLink=link)
    twice = floors.act("downloadMap", "b", mapId="cellar", mapVersion="1", mapDownloadLink=link)
    in_use = floors.act("deleteMap", "c", mapId="hall", mapVersion="1")
    other = floors.act("deleteMap", "d", mapId="cellar", mapVersion="1")
    gone = floors.act("deleteMap", "e", mapId="attic", mapVersion="1")
    assert {each.status for each in (new, twice, in_use, other, gone)} == {FAILED}
    assert "--vda5050-map" in new.result
    assert "already" in twice.result
    assert "in use" in in_use.result
    assert "not on this robot" in gone.result
    assert floors.problems[:2] == [Problem.BAD_ACTION, Problem.DUPLICATE_MAP]
    assert len(statuses(floors)) == 2


def test_a_map_of_unknown_content_gets_another_name(desk: Desk, cellar: OccupancyGrid):
    desk.robot.give(NewMap(2.0, cellar))
    assert desk.maps.id_in_use.startswith("unknown-")
    assert statuses(desk) == {"hall 1": True}
    desk.robot.give(NewMap(3.0, desk.robot.grid))
    assert desk.maps.id_in_use == "hall"
