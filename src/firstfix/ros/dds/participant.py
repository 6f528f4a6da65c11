"""The node for ROS 2 over plain DDS, with no ROS installed."""

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
from firstfix.ros.channels import PARTICLES, Channel, Topic, published_topics, subscriptions
from firstfix.ros.dds.domain import DomainSettings, domain_settings
from firstfix.ros.dds.endpoints import EventThread, Receiver, Sender
from firstfix.ros.dds.graph import GRAPH, USER_DATA, entities
from firstfix.ros.dds.types import decode, make
from firstfix.ros.names import Names
from firstfix.ros.node import MakeNode, Node
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.transport import Severity

_LEVELS = {Severity.INFO: "INFO", Severity.WARNING: "WARN", Severity.ERROR: "ERROR"}


class Dds:
    """A transport for `Node`: messages and topics of ROS 2 over plain DDS.

    There are no services: those of ROS 2 do not work across implementations of DDS.

    Parameters
    ----------
    config : NodeConfig
        The topics depend on the mode.
    names : Names
        Name, namespace and remappings of the node.
    domain : DomainSettings
        The domain of the robot.

    Raises
    ------
    InputError
        If the domain cannot be joined.
    """

    particles = PARTICLES

    def __init__(self, config: NodeConfig, names: Names, domain: DomainSettings) -> None:
        if config.load_map_service:
            raise InputError(
                "load_map_service needs services, which plain DDS has not. Leave it empty: the map "
                "is published on a topic."
            )
        self._config = config
        self._names = names
        self._threads: list[EventThread] = []
        self._receivers: list[tuple[Channel, Receiver]] = []
        try:
            self._domain = Domain(domain.number, domain.configuration)
            self._participant = DomainParticipant(domain.number, Qos(Policy.Userdata(USER_DATA)))
        except DDSException as error:
            raise InputError(
                expected=f"to join domain {domain.number}",
                received=f"{error}",
                remedy="look at the lines of Cyclone DDS above, and at CYCLONEDDS_URI",
            ) from error
        topics = published_topics(config, PARTICLES)
        self._senders = {t.name: Sender(self._participant, t, self._dds_name(t)) for t in topics}

    def connect(self, node: Node) -> None:
        """Subscribe, and publish the entry in the ROS graph."""
        self._node = node
        self._receivers = [
            (channel, Receiver(self._participant, topic, self._dds_name(topic)))
            for channel, topic in subscriptions(self._config)
        ]
        conditions = [receiver.news for _, receiver in self._receivers]
        ends = [end.entity for end in self._ends]
        self._threads = [
            EventThread(self._participant, conditions, self._receive, node.warn_throttled),
            EventThread(self._participant, ends, self._check_matches, node.warn_throttled),
        ]
        readers = [receiver.entity for _, receiver in self._receivers]
        writers = [sender.entity for sender in self._senders.values()]
        place = self._names.namespace, self._names.node
        self._graph = Sender(self._participant, GRAPH, GRAPH.name)
        self._graph.send(entities(self._participant, *place, readers, writers))

    def close(self) -> None:
        """Stop receiving."""
        for thread in self._threads:
            thread.close()

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Build a message."""
        return make(type_name, **fields)

    def publish(self, topic: Topic, message: Any) -> None:
        """Send a message."""
        self._senders[topic.name].send(message)

    def subscriber_count(self, topic: Topic) -> int:
        """Count the subscribers of a topic."""
        return self._senders[topic.name].subscriber_count

    def load_map(self, service: str, path: str) -> int:
        """Do nothing: there are no services."""
        raise OSError(f"plain DDS has no service {service} for {path}")

    def log(self, severity: Severity, text: str) -> None:
        """Write a line to the console, in the form of ROS 2."""
        with contextlib.suppress(OSError):  # the reader of the pipe may be gone
            line = f"[{_LEVELS[severity]}] [{time.time():.3f}] [{self._names.node}]: {text}\n"
            sys.stderr.write(line)
            sys.stderr.flush()

    def _dds_name(self, topic: Topic) -> str:
        return f"rt{self._names.resolve(topic.name)}"

    @property
    def _ends(self) -> list[Sender | Receiver]:
        return [*self._senders.values(), *(receiver for _, receiver in self._receivers)]

    def _receive(self) -> None:
        for channel, receiver in self._receivers:
            for data in receiver.take():
                self._pass_on(channel, receiver, data)

    def _pass_on(self, channel: Channel, receiver: Receiver, data: bytes) -> None:
        try:
            self._node.receive(channel, decode(receiver.type_name, data))
        except InputError as error:
            self._node.warn_throttled(receiver.name, f"{receiver.name}: {error}")

    def _check_matches(self) -> None:
        for end in self._ends:
            if (mismatch := end.check_matches()) is not None:
                self._node.warn_throttled(f"mismatch of {end.name}", f"{end.name}: {mismatch}")


def run(config: NodeConfig, names: Names, make_node: MakeNode = Node) -> None:
    """Run the node until SIGINT or SIGTERM.

    Parameters
    ----------
    config : NodeConfig
        Settings.
    names : Names
        Name, namespace and remappings of the node.
    make_node : MakeNode
        Makes the node.

    Raises
    ------
    InputError
        If a variable of the environment is wrong, or the domain cannot be joined.
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
