"""A network of DDS on the loopback interface: a node as users start it, robots, and ears."""

from __future__ import annotations

import importlib.util
import itertools
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

ROBOT = Path(__file__).with_name("dds_robot.py")
PLAYER = Path(__file__).with_name("dds_player.py")
# Nothing leaves this machine.
LOOPBACK = (
    "<General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
)
# Types that are not what they claim to be must not keep the ears of the tests shut.
NAMES_COUNT = "<Compatibility><IgnoreTypeInformation>1.16</IgnoreTypeInformation></Compatibility>"
# A busy machine is not a bug: generous, because a working node never takes so long.
PATIENCE_S = 240.0

_counter = itertools.count(os.getpid() * 7)
Found = TypeVar("Found")


def why_missing() -> str:
    """Return why these tests cannot run; empty if they can."""
    is_there = importlib.util.find_spec("cyclonedds") is not None
    return "" if is_there else "no cyclonedds: pip install 'firstfix[dds]'"


def free_domain() -> int:
    """Return the number of an unused domain."""
    while True:
        domain = 1 + next(_counter) % 100
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("127.0.0.1", 7400 + 250 * domain + 10))
            except OSError:
                continue
            return domain


class Program:
    """A process with its log."""

    def __init__(self, arguments: list[str], log: Path, environment: dict[str, str]) -> None:
        self._log = log
        with log.open("wb") as out:
            self.process = subprocess.Popen(
                arguments, stdout=out, stderr=out, stdin=subprocess.DEVNULL, env=environment
            )

    @property
    def log(self) -> str:
        """Its output so far."""
        return self._log.read_text(encoding="utf-8")

    def end(self, how: int = signal.SIGTERM) -> int:
        """End it and return its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(how)
        try:
            return self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


class Lab:
    """One domain, and what runs in it."""

    def __init__(self, folder: Path) -> None:
        from cyclonedds.domain import Domain, DomainParticipant

        self.folder = folder
        self.domain = free_domain()
        kept = {k: v for k, v in os.environ.items() if not k.startswith(("ROS_", "CYCLONEDDS"))}
        self.environment = kept | {"CYCLONEDDS_URI": LOOPBACK, "ROS_DOMAIN_ID": str(self.domain)}
        self._programs: list[Program] = []
        self._domain = Domain(self.domain, LOOPBACK + NAMES_COUNT)
        self.participant = DomainParticipant(self.domain)

    def node(self, *arguments: str, **environment: str) -> Program:
        """Start a node."""
        return self._start([sys.executable, "-m", "firstfix", "dds", *arguments], environment)

    def robot(self, script: str, *arguments: str, truth: str = "truth.jsonl") -> Program:
        """Start a robot."""
        program = [sys.executable, str(ROBOT), script, str(self.folder / truth), *arguments]
        return self._start(program, {})

    def player(self, bag: Path, speed: float, *topics: str) -> Program:
        """Start to play a bag."""
        return self._start([sys.executable, str(PLAYER), str(bag), f"{speed}", *topics], {})

    def ear(self, topic: str, kind: str, *policies: Any) -> Ear:
        """Listen to a topic of ROS."""
        return Ear(self.participant, f"rt{topic}", kind, *policies)

    def ear_named(self, name: str, kind: str) -> Ear:
        """Listen to a latched topic by its name in DDS."""
        from cyclonedds.qos import Policy

        how = (Policy.Reliability.Reliable(10**9), Policy.Durability.TransientLocal)
        return Ear(self.participant, name, kind, *how)

    def latched_sender(self, topic: str, kind: str) -> Any:
        """Publish a latched topic of ROS."""
        from firstfix.ros.channels import Delivery, Topic
        from firstfix.ros.dds.endpoints import Sender

        return Sender(self.participant, Topic(topic, kind, Delivery.LATCHED), f"rt{topic}")

    def end(self) -> None:
        """End all that still runs."""
        for program in self._programs:
            program.process.kill()
            program.process.wait()

    def truth(self, name: str = "truth.jsonl") -> np.ndarray:
        """Return the true poses of a robot so far: stamp, x, y, yaw."""
        lines = (self.folder / name).read_text(encoding="utf-8").splitlines()
        return np.array([json.loads(line) for line in lines if line.endswith("]")])

    def _start(self, arguments: list[str], environment: dict[str, str]) -> Program:
        log = self.folder / f"{len(self._programs)}.log"
        self._programs.append(Program(arguments, log, self.environment | environment))
        return self._programs[-1]


class Ear:
    """A reader of one topic, with all received messages."""

    def __init__(self, participant: Any, name: str, kind: str, *policies: Any) -> None:
        from cyclonedds.qos import Policy, Qos
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        from firstfix.ros.dds.types import Cdr, decode, described

        self._decode = lambda data: decode(kind, data)
        topic = Topic(participant, name, described(kind))
        topic.data_type = Cdr
        xcdr1 = Policy.DataRepresentation(use_cdrv0_representation=True)
        self.reader = DataReader(participant, topic, Qos(xcdr1, Policy.History.KeepAll, *policies))
        self._received: list[Any] = []

    @property
    def received(self) -> list[Any]:
        """All messages so far."""
        samples = self.reader.take(10_000)
        self._received += [self._decode(s.data) for s in samples if s.sample_info.valid_data]
        return self._received

    def latched(self) -> Any:
        """Return the first message, as soon as it is there."""
        return wait_for(lambda: self.received)[0]

    def senders(self) -> list[Any]:
        """Return the publishers that discovery has found."""
        handles = self.reader.get_matched_publications()
        return [self.reader.get_matched_publication_data(handle) for handle in handles]


def wait_for(find: Callable[[], Found], patience_s: float = PATIENCE_S) -> Found:
    """Wait until something is found, and return it."""
    deadline = time.monotonic() + patience_s
    while not (found := find()):
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.05)
    return found


def pose_of(message: Any) -> tuple[float, float, float]:
    """Return x, y, yaw of a PoseWithCovarianceStamped."""
    from firstfix.io.ros_messages.incoming import to_planar, to_pose

    where = to_planar(to_pose(message))
    return where.x, where.y, where.yaw
