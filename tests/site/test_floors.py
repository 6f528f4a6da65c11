"""A robot in a site: it is found, rides a lift, is told a floor, is carried to another one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from lift_lab import (
    FLOORS,
    LIFT,
    Box,
    Ride,
    into_the_lift,
    maps,
    poses,
    reasons,
    save_site,
    world,
)

from firstfix.core.odometry import Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import MapHint, NewMap, PoseHint, Reset
from firstfix.localizer.outputs import InitialPose, MapSwitched, TrackedPose
from firstfix.localizer.states import State
from firstfix.site.floors import SiteLocalizer
from firstfix.site.site import Site


@pytest.fixture(scope="module")
def floors(tmp_path_factory: pytest.TempPathFactory) -> Site:
    return Site.load(save_site(tmp_path_factory.mktemp("floors") / "site", FLOORS))


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> Site:
    """Two equal floors, and one that differs."""
    same = {"one": FLOORS["first"], "two": FLOORS["first"], "ground": FLOORS["ground"]}
    return Site.load(save_site(tmp_path_factory.mktemp("twins") / "site", same))


def test_the_map_is_named_before_any_pose(floors: Site) -> None:
    ride = Ride(floors, SE2(3.0, 1.0, 0.0))
    outputs = ride.stand(world(FLOORS["first"]))
    named = [type(o) for o in outputs if isinstance(o, (MapSwitched, InitialPose, TrackedPose))]
    assert named[:3] == [MapSwitched, InitialPose, TrackedPose]
    assert maps(outputs) == ["first"]
    assert ride.localizer.state is State.LOCALIZED
    assert poses(outputs)[-1].T_map_base.distance_to(ride.at) < 0.1


def test_a_ride_ends_on_the_right_floor(floors: Site) -> None:
    ride = into_the_lift(floors, FLOORS["first"])
    assert poses(ride.outputs)[-1].T_map_base.distance_to(LIFT) < 0.3, "poses until the door closes"
    closed = ride.stand(world(FLOORS["first"], is_open=False))
    closed += ride.stand(world(FLOORS["second"], is_open=False))
    assert not poses(closed)
    assert ride.localizer.state is State.DISAMBIGUATING
    assert "waiting for its door" in reasons(closed)
    out = ride.stand(world(FLOORS["second"])) + ride.go(world(FLOORS["second"]), 3.0, 1.0)
    assert maps(out) == ["second"]
    assert ride.localizer.map_id == "second"
    assert poses(out)[-1].T_map_base.distance_to(ride.at) < 0.1


def test_a_door_that_opens_on_the_same_floor_changes_no_map(floors: Site) -> None:
    ride = into_the_lift(floors, FLOORS["ground"])
    ride.stand(world(FLOORS["ground"], is_open=False))
    out = ride.stand(world(FLOORS["ground"])) + ride.go(world(FLOORS["ground"]), 3.0, 1.0)
    assert maps(out) == []
    assert poses(out)[-1].T_map_base.distance_to(ride.at) < 0.1


def test_equal_floors_stay_open_until_the_lift_says_which(twins: Site) -> None:
    ride = into_the_lift(twins, FLOORS["ground"])
    ride.stand(world(FLOORS["ground"], is_open=False))
    out = ride.stand(world(FLOORS["first"])) + ride.go(world(FLOORS["first"]), 3.0, 1.0)
    assert not poses(out)
    assert ride.localizer.state is State.DISAMBIGUATING
    assert "one 5" in reasons(out) or "two 5" in reasons(out), reasons(out)
    ride.give(MapHint(ride.now, "two", "the lift"))
    told = ride.go(world(FLOORS["first"]), 3.0, 2.0)
    assert maps(told) == ["two"]
    assert poses(told)[-1].T_map_base.distance_to(ride.at) < 0.1


def test_a_wrong_hint_is_not_followed(floors: Site) -> None:
    ride = into_the_lift(floors, FLOORS["ground"])
    ride.stand(world(FLOORS["ground"], is_open=False))
    ride.give(MapHint(ride.now, "first", "the lift"))
    out = ride.stand(world(FLOORS["second"])) + ride.go(world(FLOORS["second"]), 3.0, 1.0)
    assert "first" not in maps(out)


def test_a_robot_carried_to_another_floor_is_found_there(floors: Site) -> None:
    ride = Ride(floors, SE2(3.0, 1.0, 0.0))
    ride.stand(world(FLOORS["first"]))
    ride.give(Signal(ride.now, SignalKind.PICKED_UP, active=True))
    assert ride.localizer.state is State.LIFTED
    ride.T_map_odom = SE2(6.0, 5.0, 1.0) @ (ride.T_map_odom.inverse() @ ride.at).inverse()
    ride.at = SE2(6.0, 5.0, 1.0)
    assert not poses(ride.stand(world(FLOORS["second"])))
    ride.give(Signal(ride.now, SignalKind.PICKED_UP, active=False))
    assert maps(ride.stand(world(FLOORS["second"]))) == ["second"]


def test_a_robot_carried_in_secret_is_lost_and_then_found(floors: Site) -> None:
    ride = Ride(floors, SE2(3.0, 1.0, 0.0))
    ride.stand(world(FLOORS["first"]))
    ride.T_map_odom = SE2(6.0, 5.0, 1.0) @ (ride.T_map_odom.inverse() @ ride.at).inverse()
    ride.at = SE2(6.0, 5.0, 1.0)
    outputs = ride.stand(world(FLOORS["second"]), 6.0)
    assert "lost in first: searching all maps" in reasons(outputs)
    assert maps(outputs) == ["second"]


def test_a_floor_whose_map_does_not_load_stops_nothing(tmp_path: Path) -> None:
    chosen = {name: FLOORS[name] for name in ("ground", "second")}
    site = Site.load(save_site(tmp_path / "site", chosen, broken=["attic"]))
    ride = into_the_lift(site, FLOORS["ground"])
    ride.stand(world(FLOORS["ground"], is_open=False))
    attic: list[Box] = [(2.5, 3.0, 6.0, 3.4), (4.0, 0.0, 4.4, 0.8)]
    assert not poses(ride.stand(world(attic)) + ride.go(world(attic), 3.0, 1.0))
    out = ride.go(world(FLOORS["second"]), 3.0, 2.0) + ride.go(world(FLOORS["second"]), 5.0, 2.0)
    assert maps(out) == ["second"]
    assert "attic" in site.faults


@pytest.mark.parametrize("name", ["attic", "", "\x00", "x" * 10_000])
def test_a_hint_of_an_unknown_map_is_answered(floors: Site, name: str) -> None:
    said = SiteLocalizer(floors).handle(MapHint(0.0, name, "the lift"))
    assert "cannot be used in this site" in reasons(said)
    assert len(reasons(said)) < 200


def test_other_inputs_before_a_map_are_answered(floors: Site) -> None:
    localizer = SiteLocalizer(floors)
    assert "ignored" in reasons(localizer.handle(NewMap(0.0, floors.grid("first"))))
    assert "not known yet" in reasons(localizer.handle(PoseHint(0.0, SE2.identity())))
    assert "all maps" in reasons(localizer.handle(Reset(0.0)))


def test_the_same_inputs_give_the_same_outputs(floors: Site) -> None:
    def told() -> Iterator[str]:
        ride = into_the_lift(floors, FLOORS["ground"])
        yield reasons(ride.outputs)
        yield from (str(pose.T_map_base) for pose in poses(ride.outputs))

    assert list(told()) == list(told())
