"""Incidents of a robot in a site are repeated to the last bit."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from lift_lab import FLOORS, Ride, into_the_lift, save_site, world

from firstfix.core.errors import InputError
from firstfix.core.odometry import Signal, SignalKind
from firstfix.io.maps.map_server import save_map
from firstfix.localizer.incident import Cause, Incident, IncidentRecorder
from firstfix.localizer.incident_document import from_document, repeat, to_document
from firstfix.localizer.inputs import MapHint, Reset
from firstfix.localizer.outputs import NamedMap
from firstfix.site.checkpoint import (
    _OBJECTS,
    _REBUILT,
    _VALUES,
    any_localizer_at_start,
    written_state,
)
from firstfix.site.floors import SiteLocalizer
from firstfix.site.site import Site


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_site(tmp_path_factory.mktemp("incident") / "site", FLOORS)


def recorded(ride: Ride, seconds: float = 3.0) -> IncidentRecorder:
    recorder, handle = IncidentRecorder(seconds, written_state), ride.localizer.handle

    def handle_recorded(given):  # type: ignore[no-untyped-def]
        outputs = handle(given)
        recorder.observe(given, outputs, ride.localizer)
        return outputs

    ride.localizer.handle = handle_recorded  # type: ignore[method-assign]
    return recorder


def taken(recorder: IncidentRecorder) -> Incident:
    incident = recorder.take(Cause.REQUESTED, "a test")
    assert incident is not None
    return incident


def assert_identical(incident: Incident, site: Site) -> None:
    document, arrays = to_document(incident)
    saved = from_document(json.loads(json.dumps(document)), arrays)
    localizer = any_localizer_at_start(saved.incident, site)
    steps = list(repeat(saved.incident, localizer))
    assert len(steps) > 5
    assert [step.is_identical for step in steps] == [True] * len(steps)


def test_a_ride_and_a_switch_of_maps_are_repeated(folder: Path) -> None:
    ride = into_the_lift(Site.load(folder), FLOORS["first"])
    recorder, names = recorded(ride, 6.0), set()
    phases = [
        lambda: ride.stand(world(FLOORS["first"], is_open=False)),
        lambda: ride.stand(world(FLOORS["second"])),
        lambda: ride.go(world(FLOORS["second"]), 3.0, 1.0),
        lambda: ride.give(Reset(ride.now)),
        lambda: ride.stand(world(FLOORS["second"])),
    ]
    for phase in phases:  # each incident begins in the middle of another one
        phase()
        incident = taken(recorder)
        names |= {o.map_id for each in incident.outputs for o in each if isinstance(o, NamedMap)}
        assert incident.map is None
        assert_identical(incident, Site.load(folder))
    assert names == {"second"}
    assert ride.localizer.map_id == "second"


def test_a_search_of_all_maps_is_repeated_from_the_first_scan(folder: Path) -> None:
    ride = Ride(Site.load(folder), into_the_lift(Site.load(folder), FLOORS["ground"]).at)
    recorder = recorded(ride)
    ride.give(MapHint(0.0, "ground"))
    ride.give(Signal(0.1, SignalKind.PICKED_UP, active=True))
    ride.give(Signal(0.2, SignalKind.PICKED_UP, active=False))
    ride.stand(world(FLOORS["ground"]))
    assert_identical(taken(recorder), Site.load(folder))


def test_other_maps_are_refused(folder: Path, tmp_path: Path) -> None:
    ride = Ride(Site.load(folder), into_the_lift(Site.load(folder), FLOORS["ground"]).at)
    recorder = recorded(ride)
    ride.stand(world(FLOORS["ground"]))
    incident = taken(recorder)
    with pytest.raises(InputError, match="--site"):
        any_localizer_at_start(incident, None)
    other = save_site(tmp_path / "other", FLOORS)
    save_map(world(FLOORS["second"]), other / "first.yaml")
    with pytest.raises(InputError, match="'first' of the incident is missing in this site, or was"):
        any_localizer_at_start(incident, Site.load(other))


def test_every_attribute_of_the_localizer_is_in_a_list(folder: Path) -> None:
    attributes = set(vars(SiteLocalizer(Site.load(folder))))
    assert attributes == {*_VALUES, *_OBJECTS, *_REBUILT}
