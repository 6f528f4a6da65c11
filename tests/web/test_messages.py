"""The messages of the server contain the snapshot, in JSON that every client reads."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import msgspec
import pytest
from live_lab import drive

from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.states import State
from firstfix.web.messages import Hello, Map, Status, encode_text
from firstfix.web.snapshot import Snapshot
from firstfix.web.snapshot_store import SnapshotStore


@pytest.fixture(scope="module")
def localized() -> Snapshot:
    begun = drive("house")
    begun.step(22)
    return begun.store.snapshot


def test_a_status_has_every_field_of_its_declaration(localized):
    status = json.loads(encode_text(Status.of(localized, 3)))
    assert list(status) == ["type", *(field.name for field in msgspec.structs.fields(Status))]
    assert (status["type"], status["viewers"]) == ("state", 3)
    assert status["pose"] == [localized.pose.x, localized.pose.y, localized.pose.yaw]
    assert status["covariance"] == pytest.approx(
        [float(localized.covariance[i]) for i in ((0, 0), (0, 1), (1, 1), (2, 2))]
    )
    assert status["particles"] == len(localized.particles.particles)


@pytest.mark.parametrize("state", State)
def test_a_state_has_the_same_name_in_the_message(localized, state):
    status = json.loads(encode_text(Status.of(replace(localized, state=state), 0)))
    assert status["state"] == state.value == state.name


def test_a_status_before_the_first_map_has_no_pose():
    status = json.loads(encode_text(Status.of(Snapshot(), 0)))
    assert (status["state"], status["pose"], status["hypotheses"]) == ("NO_MAP", None, [])


def test_numbers_that_json_does_not_have_become_null(localized):
    status = json.loads(encode_text(Status.of(replace(localized, cpu_ms=math.nan), 0)))
    assert status["cpu_ms"] is None


def test_hello_describes_the_map_and_the_rights(localized):
    hello = Hello("sim", False, ("goal",), Map.of(localized.map), None, [])
    sent = json.loads(encode_text(hello))
    assert sent["map"]["width"] == localized.map.grid.width
    assert (sent["may_steer"], sent["abilities"]) == (False, ["goal"])


def test_a_map_name_that_is_not_utf_8_is_sent(localized):
    store = SnapshotStore("Geb\udce4ude")
    localizer = Localizer()
    given = NewMap(0.0, localized.map.grid)
    store(given, localizer.handle(given), localizer)
    assert "Geb?ude" in encode_text(Map.of(store.snapshot.map))
