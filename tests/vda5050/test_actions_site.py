"""Instant actions on the floors of a site."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from action_desk import Desk
from lift_lab import FLOORS, Ride, save_site, world

from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import NewMap, Reset
from firstfix.localizer.outputs import MapSwitched, Output
from firstfix.site.site import Site
from firstfix.vda5050.actions import Actions
from firstfix.vda5050.localization import Localization
from firstfix.vda5050.maps import MapName, MapRegister
from firstfix.vda5050.report import ActionStatus, Problem

RUNNING, FINISHED, FAILED = ActionStatus.RUNNING, ActionStatus.FINISHED, ActionStatus.FAILED


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
