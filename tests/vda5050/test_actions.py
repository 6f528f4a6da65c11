"""Instant actions on a real localizer, without a broker."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lift_lab import FLOORS, Ride, save_site, world

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.worlds.drawing import Drawing
from firstfix.localizer.inputs import NewMap, PoseHint, Reset
from firstfix.localizer.outputs import MapSwitched, Output
from firstfix.localizer.states import State
from firstfix.site.site import Site
from firstfix.vda5050.actions import Actions
from firstfix.vda5050.localization import Localization
from firstfix.vda5050.maps import KnownMap, MapName, MapRegister
from firstfix.vda5050.report import ActionReport, ActionStatus, Problem

RUNNING, FINISHED, FAILED = ActionStatus.RUNNING, ActionStatus.FINISHED, ActionStatus.FAILED


class Desk:
    """Actions of a fleet control, and the robot that they are for."""

    def __init__(self, robot: Any, *others: KnownMap) -> None:
        self.robot = robot
        self.maps = MapRegister(MapName("hall", "1"), others)
        self.localization = Localization()
        self.actions = Actions(self.maps, self.localization)
        robot.watchers.append(self._watch)

    def act(self, kind: str, action_id: str, **parameters: Any) -> ActionReport:
        """Send an action to the robot, and return its report."""
        values = [{"key": key, "value": value} for key, value in parameters.items()]
        action = {"actionType": kind, "actionId": action_id, "blockingType": "NONE"}
        return self.send({"actions": [action | {"actionParameters": values}]}, action_id)

    def send(self, message: dict[str, Any], action_id: str) -> ActionReport:
        for each in self.actions.receive(json.dumps(message).encode()):
            self.robot.give(each)
        return self.report(action_id)

    def pose(self, action_id: str, px: float, py: float, yaw: float, **other: Any) -> ActionReport:
        where = {"x": px, "y": py, "theta": yaw, "mapId": "hall", "lastNodeId": f"of {action_id}"}
        return self.act("initPosition", action_id, **(where | other))

    def report(self, action_id: str) -> ActionReport:
        (found,) = [each for each in self.actions.reports if each.id == action_id]
        return found

    @property
    def problems(self) -> list[Problem]:
        return [error.problem for error in self.actions.errors]

    def _watch(self, given: Any, outputs: Any, localizer: Any) -> None:
        in_use = self.maps.in_use
        if in_use is None or in_use.grid is not localizer.matcher.fields.grid:
            self.maps.receive(localizer.matcher.fields.grid)
        self.actions.observe(given, outputs)
        self.localization.observe(given, outputs, 0.0)


@pytest.fixture
def desk(robot: Any) -> Desk:
    """Give a robot with its map, at (3, 2, 0.5), that has not seen anything."""
    made = Desk(robot)
    robot.begin()
    return made


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


# ---- maps


@pytest.fixture
def cellar() -> OccupancyGrid:
    """Give another map: the robot's hall, mirrored, with a pillar."""
    plan = Drawing(9.0, 7.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 9.0, 7.0)
    plan.solid(7.0, 5.0, 8.9, 6.9)
    plan.solid(2.5, 2.0, 3.0, 3.5)
    return plan.grid()


def known(name: MapName, grid: OccupancyGrid) -> KnownMap:
    from firstfix.io.saved_pose import map_key

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


# ---- messages

TREES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=8,
)


@given(message=st.binary(max_size=200) | TREES.map(lambda tree: json.dumps(tree).encode()))
def test_any_bytes_are_refused_with_one_sentence(message: bytes):
    actions = Actions(MapRegister(MapName("hall")), Localization())
    with pytest.raises(InputError, match="instant actions"):
        actions.receive(message)
    assert actions.reports == ()


@given(value=TREES, name=st.sampled_from(["x", "mapId", "mapVersion"]))
def test_any_parameter_is_refused_or_used(value: Any, name: str):
    actions = Actions(MapRegister(MapName("hall")), Localization())
    where = {"x": 1.0, "y": 1.0, "theta": 0.0, "mapId": "hall", "mapVersion": "1"} | {name: value}
    values = [{"key": key, "value": each} for key, each in where.items()]
    kinds = ("initPosition", "enableMap", "downloadMap", "deleteMap", "stateRequest")
    message = {
        "actions": [
            {"actionType": kind, "actionId": kind, "actionParameters": values} for kind in kinds
        ]
    }
    try:
        inputs = actions.receive(json.dumps(message).encode())
    except InputError:  # NaN is not JSON
        assert actions.reports == ()
        return
    assert len(actions.reports) == len(kinds)
    assert len(inputs) <= 1


def test_a_message_that_is_too_large(desk: Desk):
    with pytest.raises(InputError, match="at most 65536 bytes"):
        desk.actions.receive(b" " * 70_000)


def test_too_many_actions_in_one_message(desk: Desk):
    action = {"actionType": "stateRequest", "blockingType": "NONE"}
    message = {"actions": [action | {"actionId": f"{number}"} for number in range(65)]}
    with pytest.raises(InputError, match="fit"):
        desk.actions.receive(json.dumps(message).encode())
    assert desk.actions.reports == ()


@pytest.fixture
def in_site(tmp_path: Path) -> tuple[SiteDesk, Ride]:
    """Give a robot on the first floor of a site, and a desk of a fleet control."""
    ride = Ride(Site.load(save_site(tmp_path / "site", FLOORS)), SE2(3.0, 1.0, 0.0))
    return SiteDesk(ride), ride


class SiteDesk(Desk):
    def __init__(self, ride: Ride) -> None:
        self.robot = ride
        self.maps = MapRegister(MapName("unknown"))
        self.localization = Localization()
        self.actions = Actions(self.maps, self.localization)
        handle = ride.localizer.handle

        def watched(given: Any) -> list[Output]:
            outputs = handle(given)
            for output in outputs:
                if isinstance(output, MapSwitched):  # as nodes do
                    self._note(NewMap(output.stamp, output.grid, output.map_id), [])
            self._note(given, outputs)
            return outputs

        ride.localizer.handle = watched  # type: ignore[method-assign]

    def _note(self, given: Any, outputs: Any) -> None:
        localizer = self.robot.localizer
        self.maps.receive_site(localizer.site.contents, localizer.map_id)
        self.actions.observe(given, outputs)
        self.localization.observe(given, outputs, 0.0)


def test_a_pose_on_another_floor_of_a_site_is_verified(in_site: tuple[SiteDesk, Ride]) -> None:
    desk, ride = in_site
    ride.stand(world(FLOORS["first"]))
    assert desk.maps.id_in_use == "first"
    assert [entry.id for entry in desk.maps.entries] == [*FLOORS]
    # The robot is carried to another floor, and the fleet control knows where.
    report = desk.pose("a", 3.0, 1.0, 0.0, mapId="second")
    assert report.status is RUNNING
    ride.stand(world(FLOORS["second"]))
    assert desk.report("a").status is FINISHED
    assert (desk.maps.id_in_use, desk.actions.last_node_id) == ("second", "of a")


def test_a_wrong_floor_is_not_obeyed(in_site: tuple[SiteDesk, Ride]) -> None:
    desk, ride = in_site
    ride.stand(world(FLOORS["first"]))
    assert desk.pose("a", 3.0, 1.0, 0.0, mapId="second").status is RUNNING
    ride.stand(world(FLOORS["first"]), 4.0)
    assert desk.report("a").status is FAILED
    assert desk.maps.id_in_use == "first"
    assert desk.report("a").result.endswith("of map first")
    assert desk.pose("b", 3.0, 1.0, 0.0, mapId="attic").status is FAILED
    assert desk.problems == [Problem.UNKNOWN_MAP]


def test_an_enabled_map_is_a_hint_while_the_floor_is_open(in_site: tuple[SiteDesk, Ride]) -> None:
    desk, ride = in_site
    ride.give(Reset(0.0))
    version = {entry.id: entry.version for entry in desk.maps.entries}["first"]
    enable = {"mapId": "first", "mapVersion": version}
    assert desk.act("enableMap", "a", **enable).status is FINISHED
    assert "the fleet control says that this is first" in ride.outputs[-1].reason
    ride.stand(world(FLOORS["first"]))
    before = len(ride.outputs)
    assert desk.act("enableMap", "b", **enable).status is FINISHED
    assert len(ride.outputs) == before, "it is found: nothing is searched again"
    assert desk.act("downloadMap", "c", **enable).status is FAILED
    assert desk.problems == [Problem.DUPLICATE_MAP]
