"""The node for ROS 2 where no ROS is installed: a participant of DDS."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import time
from typing import Any

from cyclonedds.core import DDSException
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.qos import Policy, Qos

from firstfix.core.errors import InputError
from firstfix.ros.channels import PARTICLES, Heard, Topic, heard_topics, said_topics
from firstfix.ros.dds.domain import DomainSettings, domain_settings
from firstfix.ros.dds.endpoints import Receiver, Sender, Watch
from firstfix.ros.dds.graph import GRAPH, USER_DATA, entities
from firstfix.ros.dds.types import decode, make
from firstfix.ros.names import Names
from firstfix.ros.node import MakeNode, Node
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.transport import Severity

_LEVELS = {Severity.INFO: "INFO", Severity.WARNING: "WARN", Severity.ERROR: "ERROR"}


class Dds:
    """A transport for `Node`: messages and topics of ROS 2 over plain DDS.

    There are no services: those of ROS 2 do not cross from one implementation of DDS to another.

    Parameters
    ----------
    config : NodeConfig
        What is published depends on the mode.
    names : Names
        The place of the node among the names of the robot.
    domain : DomainSettings
        Where the robot is.

    Raises
    ------
    InputError
        If there is no way to take part in the domain.
    """

    particles = PARTICLES

    def __init__(self, config: NodeConfig, names: Names, domain: DomainSettings) -> None:
        self._config = config
        self._names = names
        self._watches: list[Watch] = []
        self._receivers: dict[Heard, Receiver] = {}
        try:
            self._domain = Domain(domain.number, domain.configuration)
            self._participant = DomainParticipant(domain.number, Qos(Policy.Userdata(USER_DATA)))
        except DDSException as error:
            raise InputError(
                expected=f"a way to take part in domain {domain.number}",
                received=f"{error}",
                remedy="look at the lines of Cyclone DDS above, and at CYCLONEDDS_URI",
            ) from error
        said = said_topics(config, PARTICLES)
        self._senders = {t.name: Sender(self._participant, t, self._dds_name(t)) for t in said}

    def connect(self, node: Node) -> None:
        """Subscribe all, and appear in the graph of ROS."""
        self._node = node
        self._receivers = {
            heard: Receiver(self._participant, topic, self._dds_name(topic))
            for heard, topic in heard_topics(self._config).items()
        }
        conditions = [receiver.news for receiver in self._receivers.values()]
        ends = [end.entity for end in self._ends]
        self._watches = [
            Watch(self._participant, conditions, self._hear, node.complain),
            Watch(self._participant, ends, self._look, node.complain),
        ]
        readers = [receiver.entity for receiver in self._receivers.values()]
        writers = [sender.entity for sender in self._senders.values()]
        place = self._names.namespace, self._names.node
        self._graph = Sender(self._participant, GRAPH, GRAPH.name)
        self._graph.send(entities(self._participant, *place, readers, writers))

    def close(self) -> None:
        """Hear nothing more."""
        for watch in self._watches:
            watch.close()

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Build a message."""
        return make(type_name, **fields)

    def publish(self, topic: Topic, message: Any) -> None:
        """Send a message."""
        self._senders[topic.name].send(message)

    def listeners(self, topic: Topic) -> int:
        """Count those who listen."""
        return self._senders[topic.name].listeners

    def log(self, gravity: Severity, text: str) -> None:
        """Write a line to the console, in the form of ROS 2."""
        with contextlib.suppress(OSError):  # whoever read it may have gone
            line = f"[{_LEVELS[gravity]}] [{time.time():.3f}] [{self._names.node}]: {text}\n"
            sys.stderr.write(line)
            sys.stderr.flush()

    def _dds_name(self, topic: Topic) -> str:
        return f"rt{self._names.resolve(topic.name)}"

    @property
    def _ends(self) -> list[Sender | Receiver]:
        return [*self._senders.values(), *self._receivers.values()]

    def _hear(self) -> None:
        for heard, receiver in self._receivers.items():
            for data in receiver.take():
                self._pass_on(heard, receiver, data)

    def _pass_on(self, heard: Heard, receiver: Receiver, data: bytes) -> None:
        try:
            self._node.hear(heard, decode(receiver.type_name, data))
        except InputError as error:
            self._node.complain(receiver.name, f"{receiver.name}: {error}")

    def _look(self) -> None:
        for end in self._ends:
            if (mismatch := end.look()) is not None:
                self._node.complain(f"mismatch of {end.name}", f"{end.name}: {mismatch}")


def run(config: NodeConfig, names: Names, make_node: MakeNode = Node) -> None:
    """Run the node until it is interrupted or told to end.

    Parameters
    ----------
    config : NodeConfig
        Settings.
    names : Names
        The place of the node among the names of the robot.
    make_node : MakeNode
        Makes the node.

    Raises
    ------
    InputError
        If the environment does not say which domain to take part in, or that is not possible.
    """
    is_over = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: is_over.set())
    transport = Dds(config, names, domain_settings())
    node = make_node(config, transport)
    node.start()
    transport.connect(node)
    is_over.wait()
    node.stop()
    transport.close()
