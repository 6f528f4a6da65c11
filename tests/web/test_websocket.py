"""One WebSocket per viewer: messages, commands, tokens and limits."""

from __future__ import annotations

import json
import time
from contextlib import ExitStack

import numpy as np
import pytest
from live_lab import Drive, Site, drive, fed, simulated, until
from viewer_lab import PATIENCE_S, connect, kind_of, next_of
from websockets.exceptions import ConnectionClosed, ConnectionClosedError, InvalidStatus

from firstfix.lab.worlds.catalog import WORLDS
from firstfix.localizer.inputs import NewMap, PoseHint, Reset
from firstfix.web.access_control import AccessPolicy
from firstfix.web.command_executor import ABILITIES

ASLEEP = 20


@pytest.fixture(scope="module")
def office() -> Drive:
    begun = drive("office")
    begun.step(ASLEEP + 1)
    return begun


@pytest.fixture
def site(office: Drive):
    with fed(store=office.store) as site:
        yield site


def test_a_viewer_first_receives_hello_and_every_kind_of_frame(site: Site):
    with connect(site.live) as viewer:
        first = [viewer.recv(PATIENCE_S) for _ in range(5)]
        kinds = ["hello", "state", "scan", "particles", "belief"]
        assert [kind_of(message) for message in first] == kinds
        hello, state = json.loads(first[0]), json.loads(first[1])
        assert (hello["robot"], hello["may_steer"], hello["abilities"]) == ("ros2", True, [])
        assert hello["map"]["name"] == "office"
        assert [event["kind"] for event in hello["events"]] == ["map", "found"]
        assert (state["state"], state["viewers"]) == ("LOCALIZED", 1)


def test_every_viewer_receives_every_change(site: Site, office: Drive):
    with connect(site.live) as one, connect(site.live) as other:
        until(lambda: next_of(one, "state")["viewers"] == 2)
        office.step(25)
        last = office.store.snapshot
        for viewer in (one, other):
            until(lambda viewer=viewer: next_of(viewer, "state")["stamp"] == last.stamp)
    with connect(site.live) as again:
        assert next_of(again, "state")["viewers"] == 1


def test_events_reach_viewers_in_order(site: Site, office: Drive):
    with connect(site.live) as viewer:
        number = next_of(viewer, "hello")["events"][-1]["number"]
        for i in range(5):
            office.store.add_event("person", f"word {i}")
        received = [next_of(viewer, "event") for _ in range(5)]
        assert [event["text"] for event in received] == [f"word {i}" for i in range(5)]
        assert [event["number"] for event in received] == [*range(number + 1, number + 6)]


def test_a_new_map_sends_hello_again(office: Drive):
    fresh = drive("office")
    with fed(store=fresh.store) as site, connect(site.live) as viewer:
        old = next_of(viewer, "hello")["map"]
        fresh.give(NewMap(1.0, WORLDS["house"]()))
        new = next_of(viewer, "hello")["map"]
        assert (new["width"], new["image"]["url"]) != (old["width"], old["image"]["url"])
        assert next_of(viewer, "state")["state"] == "SEARCHING"


def test_the_first_frames_before_there_is_a_map():
    with fed() as site, connect(site.live) as viewer:
        assert next_of(viewer, "hello")["map"] is None
        assert next_of(viewer, "state")["state"] == "NO_MAP"
        assert len(next_of(viewer, "scan")["frame"]) == 16


def test_commands_reach_the_localizer(site: Site, office: Drive):
    with connect(site.live) as viewer:
        viewer.send('{"type": "token", "token": "not needed"}')
        viewer.send('{"type": "pose", "x": 1.5, "y": 2.5, "yaw": 0.5}')
        viewer.send('{"type": "relocalize"}')
        until(lambda: len(site.given) == 2)
    hint, reset = site.given
    assert isinstance(hint, PoseHint)
    assert (hint.T_map_base.x, hint.T_map_base.y, hint.T_map_base.yaw) == (1.5, 2.5, 0.5)
    assert isinstance(reset, Reset)
    assert hint.stamp == reset.stamp == office.store.snapshot.stamp


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("nonsense", "JSON"),
        ("[1, 2]", "Expected an object"),
        ('{"type": "fly"}', "type: Invalid value"),
        ('{"type": "pose", "x": 1e999, "y": 0, "yaw": 0}', "x: Number out of range"),
        ('{"type": "pick", "id": 3}', "no longer in the list"),
        ('{"type": "goal", "x": 1, "y": 2}', "only in simulation"),
        (b"\x00\x01", "JSON"),
    ],
)
def test_a_refusal_is_sent_to_its_viewer_alone(site: Site, command: str | bytes, words: str):
    with connect(site.live) as viewer, connect(site.live) as other:
        viewer.send(command)
        assert words in next_of(viewer, "error")["detail"]
        site.store.add_event("person", "and on it goes")
        while kind_of(message := other.recv(PATIENCE_S)) != "event":
            assert kind_of(message) != "error"
    assert site.given == []


def test_a_read_only_server_refuses_commands(office: Drive):
    with fed(AccessPolicy(may_steer=False), office.store) as site, connect(site.live) as viewer:
        assert next_of(viewer, "hello")["may_steer"] is False
        viewer.send('{"type": "relocalize"}')
        assert "--read-only" in next_of(viewer, "error")["detail"]
        assert site.given == []


def test_commands_beyond_the_rate_limit_are_ignored(site: Site):
    with connect(site.live) as viewer:
        for _ in range(300):
            viewer.send('{"type": "relocalize"}')
        until(lambda: "Too many" in next_of(viewer, "error")["detail"])
        assert 60 <= len(site.given) < 290


def test_a_message_that_is_too_long_ends_the_connection(site: Site):
    with connect(site.live) as viewer:
        viewer.send("x" * 20_000)
        with pytest.raises(ConnectionClosed) as ended:
            until(lambda: viewer.recv(PATIENCE_S) is None)
        assert ended.value.rcvd.code == 1009


TOKEN = "open-sesame"  # noqa: S105 - of a test


def test_the_right_token_is_accepted(office: Drive):
    with fed(AccessPolicy(TOKEN), office.store) as site, connect(site.live) as viewer:
        viewer.send(json.dumps({"type": "token", "token": TOKEN}))
        assert kind_of(viewer.recv(PATIENCE_S)) == "hello"


@pytest.mark.parametrize(
    "first", ['{"type": "token", "token": "wrong"}', '{"token": 7}', "[]", "", "{", b"\xff"]
)
def test_a_wrong_token_closes_the_connection(office: Drive, first: str | bytes):
    with fed(AccessPolicy(TOKEN), office.store) as site, connect(site.live) as viewer:
        viewer.send(first)
        with pytest.raises(ConnectionClosed) as ended:
            viewer.recv(PATIENCE_S)
        assert ended.value.rcvd.code == 4401


def test_guesses_are_rate_limited(office: Drive):
    with fed(AccessPolicy(TOKEN), office.store) as site:

        def guess(word: str) -> None:
            with connect(site.live) as viewer:
                viewer.send(json.dumps({"type": "token", "token": word}))
                viewer.recv(PATIENCE_S)

        refusals = []
        for i in range(15):
            with pytest.raises((ConnectionClosed, InvalidStatus)) as refusal:
                guess(f"{i}")
            refusals.append(refusal.type)
        assert refusals[0] is ConnectionClosedError
        assert InvalidStatus in refusals


def test_a_missing_token_closes_the_connection(office: Drive, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("firstfix.web.websocket._TOKEN_TIMEOUT_S", 0.1)
    with fed(AccessPolicy(TOKEN), office.store) as site, connect(site.live) as viewer:
        with pytest.raises(ConnectionClosed) as ended:
            viewer.recv(PATIENCE_S)
        assert ended.value.rcvd.code == 4401


def test_a_stopping_server_closes_connections_with_1012(office: Drive):
    with ExitStack() as server:
        site = server.enter_context(fed(store=office.store))
        with connect(site.live) as viewer:
            assert next_of(viewer, "hello")
            server.close()
            with pytest.raises(ConnectionClosed) as ended:
                until(lambda: viewer.recv(PATIENCE_S) is None)
            assert ended.value.rcvd.code == 1012
    with fed(store=office.store) as site, connect(site.live) as viewer:
        assert next_of(viewer, "hello")["events"]


def test_two_viewers_control_a_simulated_robot():
    """Localized, paused, among people, carried and localized again."""
    grid = WORLDS["house"]()
    with simulated(grid) as site, connect(site.live) as one, connect(site.live) as other:
        hello = next_of(one, "hello")
        assert (hello["robot"], set(hello["abilities"])) == (
            "sim",
            set(ABILITIES),
        )
        until(lambda: next_of(one, "state")["state"] == "LOCALIZED")
        state = until(lambda: (s := next_of(one, "state"))["pose"] and s)
        assert np.hypot(*np.subtract(state["pose"], state["truth"])[:2]) < 0.3

        other.send('{"type": "pause", "paused": true}')
        until(lambda: next_of(one, "state")["paused"])
        stamp = site.store.snapshot.stamp
        time.sleep(0.3)
        assert site.store.snapshot.stamp <= stamp + 0.1
        other.send('{"type": "pause", "paused": false}')
        until(lambda: not next_of(one, "state")["paused"])

        other.send('{"type": "people", "count": 3}')
        until(lambda: "3 people" in next_of(one, "event")["text"])
        other.send('{"type": "people", "count": 0}')
        x, y, yaw = state["truth"]
        one.send(json.dumps({"type": "carry", "x": x, "y": y, "yaw": yaw + 1.5}))
        until(lambda: next_of(other, "state")["state"] == "SEARCHING")
        until(lambda: next_of(other, "state")["state"] == "LOCALIZED")

        def refused() -> str:
            one.send(json.dumps({"type": "goal", "x": -99, "y": y}))
            return next_of(one, "error")["detail"]

        # Found by the first scan after it stands, perhaps before the hands are off.
        until(lambda: "too close to a wall" in refused())
