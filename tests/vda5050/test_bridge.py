"""The bridge on a real broker."""

from __future__ import annotations

import gc
import itertools
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from firstfix.localizer.states import State
from firstfix.vda5050.broker import read_broker
from firstfix.vda5050.identity import Identity, Version
from firstfix.vda5050.maps import MapName, MapRegister


@pytest.fixture(autouse=True)
def impatient(mqtt: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Try again soon, so that the tests are quick."""
    monkeypatch.setattr("firstfix.vda5050.bridge._FIRST_PAUSE_S", 0.05)
    monkeypatch.setattr("firstfix.vda5050.bridge._LONGEST_PAUSE_S", 0.2)


@contextmanager
def bridged(
    robot: Any, url: str, version: Version = Version.V2, maps: MapRegister | None = None
) -> Iterator[tuple[Any, list[str]]]:
    """Run the bridge of a robot; gives it with the lines that it logs."""
    from firstfix.vda5050.bridge import Bridge

    log: list[str] = []
    identity = Identity("ACME", "0001", version)
    register = maps or MapRegister(MapName("hall", "1"))
    with Bridge(read_broker(url), identity, register, log.append) as bridge:
        bridge.attach(robot.give)
        robot.watchers.append(bridge)
        yield bridge, log


def wait(holds: Callable[[], Any], what: str = "it") -> Any:
    end = threading.Event()
    for _ in range(6000):
        if value := holds():
            return value
        end.wait(0.01)
    pytest.fail(f"waited 60 s for {what}")


def test_a_robot_is_found_and_leaves(broker, listen, robot):
    fleet = listen(broker)
    with bridged(robot, broker.url):
        before = wait(lambda: fleet.of("state"), "the first state")[0]
        assert before["agvPosition"]["positionInitialized"] is False
        assert before["agvPosition"]["mapId"] == "hall"
        assert [error["errorType"] for error in before["errors"]] == ["localizationError"]
        robot.begin()
        robot.scan()
        assert robot.localizer.state is State.LOCALIZED
        wait(lambda: fleet.of("visualization"), "a pose")
        found = wait(
            lambda: [s for s in fleet.of("state") if s["agvPosition"]["positionInitialized"]]
        )[0]
        position = found["agvPosition"]
        assert (position["x"], position["y"]) == pytest.approx((3.0, 2.0), abs=0.05)
        assert position["theta"] == pytest.approx(0.5, abs=0.05)
        assert position["localizationScore"] > 0.9
        assert 0.0 < position["deviationRange"] < 0.5
        assert found["errors"] == []
        assert found["maps"] == [{"mapId": "hall", "mapVersion": "1", "mapStatus": "ENABLED"}]
    wait(lambda: len(fleet.of("connection")) == 2)
    assert [c["connectionState"] for c in fleet.of("connection")] == ["ONLINE", "OFFLINE"]
    assert {(topic, qos) for topic, _, qos, _ in fleet.messages} == {
        ("connection", 1),
        ("state", 0),
        ("visualization", 0),
    }
    for topic in ("state", "visualization", "connection"):
        ids = [message["headerId"] for message in fleet.of(topic)]
        assert all(a < b for a, b in itertools.pairwise(ids))


def test_each_end_is_reported(broker, listen, robot):
    """Also one at the moment of a message, when a wait that is cancelled may go on."""
    fleet = listen(broker)
    robot.begin()
    for number in range(10):
        with bridged(robot, broker.url) as (_, log):
            wait(lambda log=log: log)
            for _ in range(number):
                robot.scan()
        wait(lambda number=number: states(fleet).count("OFFLINE") == number + 1)
        assert states(fleet)[-1] == "OFFLINE"
    assert set(states(fleet)) == {"ONLINE", "OFFLINE"}


def states(fleet: Any) -> list[str]:
    """Return what was said of the connection."""
    return [message["connectionState"] for message in fleet.of("connection")]


def test_version_3_has_its_own_topics(broker, listen, robot):
    fleet = listen(broker, "vda5050/v3/ACME/0001")
    with bridged(robot, broker.url, Version.V3):
        robot.begin()
        robot.scan()
        wait(lambda: any(s["mobileRobotPosition"]["localized"] for s in fleet.of("state")))


def test_the_connection_is_retained(broker, listen, robot):
    with bridged(robot, broker.url) as (_, log):
        wait(lambda: log)
        late = listen(broker)
        topic, message, qos, is_retained = wait(lambda: late.messages)[0]
        assert (topic, qos, is_retained) == ("connection", 1, True)
        assert message["connectionState"] == "ONLINE"


def test_the_last_will_and_the_return(broker, listen, robot):
    """A second client with the name of the first ends its connection, as a broken line would."""
    from paho.mqtt.client import CallbackAPIVersion, Client

    fleet = listen(broker)
    with bridged(robot, broker.url):
        wait(lambda: fleet.of("connection"))
        other = Client(CallbackAPIVersion.VERSION2, client_id="firstfix-ACME-0001")
        other.connect("127.0.0.1", broker.port)
        other.loop_start()
        wait(lambda: len(fleet.of("connection")) >= 3)
        other.loop_stop()
    states = [message["connectionState"] for message in fleet.of("connection")][:3]
    assert states == ["ONLINE", "CONNECTIONBROKEN", "ONLINE"]


def test_a_broker_that_restarts(broker, listen, robot):
    with bridged(robot, broker.url) as (_, log):
        wait(lambda: log)
        broker.end()
        wait(lambda: len(log) == 2, "a warning")
        robot.begin()
        robot.scan()  # localization goes on
        assert robot.localizer.state is State.LOCALIZED
        broker.start()
        fleet = listen(broker)
        wait(lambda: any(s["agvPosition"]["positionInitialized"] for s in fleet.of("state")))
    assert "no connection" in log[1]
    assert log[2].startswith("VDA 5050: connected")


def test_a_broker_that_is_away(robot):
    with bridged(robot, "mqtt://127.0.0.1:1") as (_, log):
        wait(lambda: log)
        robot.begin()
        robot.scan()
        assert robot.localizer.state is State.LOCALIZED
    (line,) = log  # repeated every 10 s at most
    assert "no connection to mqtt://127.0.0.1:1" in line
    assert "Localization goes on" in line


def test_passwords(make_broker, robot, monkeypatch):
    broker = make_broker(robot="right")
    url = broker.url.replace("//", "//robot@")
    monkeypatch.setenv("FIRSTFIX_MQTT_PASSWORD", "wrong")
    with bridged(robot, url) as (_, log):
        wait(lambda: log)
    assert "not authorised" in log[0].lower().replace("z", "s")
    assert "wrong" not in log[0]
    monkeypatch.setenv("FIRSTFIX_MQTT_PASSWORD", "right")
    with bridged(robot, url) as (_, log):
        wait(lambda: log)
    assert "connected" in log[0]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_tls(make_broker, robot, tmp_path, monkeypatch):
    """The certificate of the broker is verified, with the authorities in SSL_CERT_FILE."""
    if shutil.which("openssl") is None:
        pytest.skip("no openssl in PATH")
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    name = ["-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1"]
    new = [
        "openssl",
        "req",
        "-x509",
        "-nodes",
        "-newkey",
        "ec",
        "-pkeyopt",
        "ec_paramgen_curve:P-256",
    ]
    files = ["-keyout", str(key), "-out", str(certificate)]
    subprocess.run([*new, *files, *name], check=True, capture_output=True)
    broker = make_broker([f"certfile {certificate}", f"keyfile {key}", "user root"])
    url = broker.url.replace("mqtt:", "mqtts:")
    with bridged(robot, url) as (_, log):
        wait(lambda: log)
    assert "certificate verify failed" in log[0].lower()
    gc.collect()  # paho leaves the socket of a refused certificate to the collector
    monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
    with bridged(robot, url) as (_, log):
        wait(lambda: log)
    assert "connected to mqtts" in log[0]


def action(fleet: Any, action_id: str, *ends: str) -> dict[str, Any]:
    """Wait for an end of an action."""

    def found() -> Any:
        states = [s for state in fleet.of("state") for s in state["actionStates"]]
        return [s for s in states if s["actionId"] == action_id and s["actionStatus"] in ends]

    return wait(found, f"{action_id} to be {ends}")[0]


def test_a_pose_is_verified(broker, listen, robot):
    fleet = listen(broker)
    with bridged(robot, broker.url):
        wait(lambda: fleet.of("state"))
        robot.begin()
        pose = {"x": 3.3, "y": 1.8, "theta": 0.6, "mapId": "hall", "lastNodeId": "n7"}
        fleet.act("initPosition", "a1", **pose)
        wait(lambda: robot.localizer.state is State.VERIFYING_HINT)
        action(fleet, "a1", "RUNNING")
        robot.scan()
        assert "0.3" in action(fleet, "a1", "FINISHED")["resultDescription"]
        wait(lambda: fleet.of("state")[-1]["lastNodeId"] == "n7")
        position = fleet.of("state")[-1]["agvPosition"]
        assert (position["x"], position["y"]) == pytest.approx((3.0, 2.0), abs=0.05)


def test_a_wrong_pose_is_refused(broker, listen, robot):
    fleet = listen(broker)
    with bridged(robot, broker.url):
        wait(lambda: fleet.of("state"))
        robot.begin()
        pose = {"x": 7.5, "y": 6.0, "theta": -2.0, "mapId": "hall", "lastNodeId": "n7"}
        fleet.act("initPosition", "a1", **pose)
        wait(lambda: robot.localizer.state is State.VERIFYING_HINT)
        robot.scan()
        reason = action(fleet, "a1", "FAILED")["resultDescription"]
        assert "fleet control" in reason
        assert fleet.of("state")[-1]["lastNodeId"] == ""


HOSTILE = [
    b"",
    b"\x00\xff",
    b"null",
    b"[]",
    b"{}",
    b'{"actions": 1}',
    b'{"actions": [{"actionType": "initPosition"}]}',
    b'{"actions": [{"actionType": "x", "actionId": ""}]}',
    b'{"actions": [' + b"[" * 30_000,
    b'{"actions": [' + b" " * 70_000,
    b'{"actions": [{"actionType": "' + b"x" * 1000 + b'", "actionId": "a"}]}',
]


def test_hostile_messages_are_ignored_with_one_warning(broker, listen, robot):
    fleet = listen(broker)
    with bridged(robot, broker.url) as (_, log):
        wait(lambda: fleet.of("state"))
        for message in HOSTILE:
            fleet.send(message)
        fleet.act("stateRequest", "last")
        action(fleet, "last", "FINISHED")
    assert len(log) == 2  # connected, and one warning
    assert "ignored" in log[1]


def test_retained_actions_are_ignored(broker, listen, robot):
    fleet = listen(broker)
    topic, body = "uagv/v2/ACME/0001/instantActions", b'{"actions": []}'
    fleet._client.publish(topic, body, qos=1, retain=True).wait_for_publish(10.0)
    with bridged(robot, broker.url) as (_, log):
        wait(lambda: len(log) == 2)
    assert "retained" in log[1]


def test_it_ends_with_its_context(broker, robot):
    before = threading.active_count()
    with bridged(robot, broker.url) as (bridge, log):
        wait(lambda: log)
    assert not bridge._thread.is_alive()
    assert threading.active_count() <= before + 1  # a pool of the event loop may end later
    robot.begin()  # outputs after the end do no harm
