"""A real broker on a free loopback port, a fleet control, and a robot that stands in a hall."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))

from action_desk import Desk
from required import missing

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Output

HERE = SE2(3.0, 2.0, 0.5)
PATIENCE_S = 240.0


def until(holds: Callable[[], Any], what: str) -> Any:
    """Wait until something holds; no test depends on how long that takes."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        value = holds()
        if value:
            return value
        time.sleep(0.01)
    pytest.fail(f"waited {PATIENCE_S:g} s for {what}")


class Mosquitto:
    """A broker; ``users`` have passwords, and without them anybody may connect."""

    def __init__(self, folder: Path, users: dict[str, str], lines: Sequence[str]) -> None:
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        anonymous = f"allow_anonymous {str(not users).lower()}"
        lines = [f"listener {self.port} 127.0.0.1", anonymous, *lines]
        if users:
            passwords = folder / "passwords"
            passwords.touch(0o600)
            for user, password in users.items():
                add = ["mosquitto_passwd", "-b", str(passwords), user, password]
                subprocess.run(add, check=True, capture_output=True)
            # As root it becomes another user, who must read the file.
            lines += [f"password_file {passwords}", "user root"]
        self._config = folder / "mosquitto.conf"
        self._config.write_text("\n".join(lines) + "\n")
        self._process: subprocess.Popen[bytes] | None = None
        self.start()

    @property
    def url(self) -> str:
        return f"mqtt://127.0.0.1:{self.port}"

    def start(self) -> None:
        command = ["mosquitto", "-c", str(self._config)]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._process = subprocess.Popen(command, **quiet)
        until(self._answers, "the broker")

    def end(self) -> None:
        if self._process is not None:
            self._process.terminate()
            self._process.wait()
            self._process = None

    def _answers(self) -> bool:
        assert self._process is not None
        assert self._process.poll() is None, "the broker has ended"
        try:
            socket.create_connection(("127.0.0.1", self.port), 1.0).close()
        except OSError:
            return False
        return True


@pytest.fixture
def mqtt() -> None:
    """Skip where the client library is missing."""
    try:
        import aiomqtt  # noqa: F401
    except ModuleNotFoundError:
        missing("mqtt", "no aiomqtt: pip install 'firstfix[vda5050]'")


@pytest.fixture
def make_broker(mqtt: None, tmp_path: Path) -> Iterator[Callable[..., Mosquitto]]:
    """Give a function that starts a broker; all are ended."""
    if shutil.which("mosquitto") is None or shutil.which("mosquitto_passwd") is None:
        missing("mqtt", "no mosquitto in PATH")
    started: list[Mosquitto] = []

    def make(lines: Sequence[str] = (), **users: str) -> Mosquitto:
        started.append(Mosquitto(tmp_path, users, lines))
        return started[-1]

    yield make
    for broker in started:
        broker.end()


@pytest.fixture
def broker(make_broker: Callable[..., Mosquitto]) -> Mosquitto:
    """Give a broker that lets anybody connect."""
    return make_broker()


class Fleet:
    """A fleet control: keeps all messages of a robot, and sends instant actions."""

    def __init__(self, port: int, root: str) -> None:
        from paho.mqtt.client import CallbackAPIVersion, Client

        self._root = root
        self._client = Client(CallbackAPIVersion.VERSION2)
        self._client.on_message = self._receive
        self._client.on_connect = lambda client, *_: client.subscribe(f"{root}/#", qos=1)
        self._has_subscribed = threading.Event()
        self._client.on_subscribe = lambda *_: self._has_subscribed.set()
        self.messages: list[tuple[str, dict[str, Any], int, bool]] = []
        self._client.connect("127.0.0.1", port)
        self._client.loop_start()
        assert self._has_subscribed.wait(PATIENCE_S)

    def end(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()

    def of(self, topic: str) -> list[dict[str, Any]]:
        return [body for name, body, _, _ in list(self.messages) if name == topic]

    def send(self, message: bytes | dict[str, Any]) -> None:
        payload = message if isinstance(message, bytes) else json.dumps(message)
        self._client.publish(f"{self._root}/instantActions", payload)

    def act(self, kind: str, action_id: str, **parameters: Any) -> None:
        self.send(instant_actions((kind, action_id, parameters)))

    def _receive(self, _client: Any, _data: Any, message: Any) -> None:
        topic = message.topic.removeprefix(f"{self._root}/")
        if topic != "instantActions":
            body = json.loads(message.payload)
            self.messages.append((topic, body, message.qos, bool(message.retain)))


@pytest.fixture
def listen() -> Iterator[Callable[..., Fleet]]:
    """Give a function that connects a fleet control."""
    made: list[Fleet] = []

    def listen(broker: Mosquitto, root: str = "uagv/v2/ACME/0001") -> Fleet:
        made.append(Fleet(broker.port, root))
        return made[-1]

    yield listen
    for fleet in made:
        fleet.end()


def instant_actions(*actions: tuple[str, str, dict[str, Any]]) -> dict[str, Any]:
    """Return a complete message of actions: type, id, parameters."""
    return {
        "headerId": 1,
        "timestamp": "2026-01-02T03:04:05.678Z",
        "version": "2.1.0",
        "manufacturer": "ACME",
        "serialNumber": "0001",
        "actions": [
            {
                "actionType": kind,
                "actionId": action_id,
                "blockingType": "NONE",
                "actionParameters": [{"key": k, "value": v} for k, v in parameters.items()],
            }
            for kind, action_id, parameters in actions
        ],
    }


@dataclass
class Robot:
    """A localizer of a robot that stands in a hall, and what watches it."""

    grid: OccupancyGrid
    pose: SE2 = HERE
    stamp: float = 1.0
    watchers: list[Callable[..., None]] = field(default_factory=list)
    localizer: Localizer = field(default_factory=Localizer)

    def give(self, given: Input) -> list[Output]:
        outputs = self.localizer.handle(given)
        for watch in self.watchers:
            watch(given, outputs, self.localizer)
        return outputs

    def begin(self) -> None:
        self.give(NewMap(0.0, self.grid))

    def scan(self) -> None:
        """Take a scan 0.1 s later."""
        self.stamp += 0.1
        self.give(Odometry(self.stamp, SE2.identity()))
        rng = np.random.default_rng(round(self.stamp * 10))
        self.give(Lidar(beams=120).scan(self.grid, self.pose, rng, self.stamp))


@pytest.fixture
def robot(hall_plan: OccupancyGrid) -> Robot:
    """Give a robot that has not received its map yet."""
    return Robot(hall_plan)


@pytest.fixture
def desk(robot: Robot) -> Desk:
    """Give a robot with its map, at (3, 2, 0.5), that has not seen anything."""
    made = Desk(robot)
    robot.begin()
    return made
