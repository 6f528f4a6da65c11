"""Topics and services of a lifecycle node of ROS 2, as the transport of `Node`."""

from __future__ import annotations

import math
import threading
import time
from functools import partial
from typing import Any

import rclpy
from rclpy.lifecycle import LifecycleNode

from firstfix.ros.channels import (
    AMCL_POSE,
    LOCALIZED,
    PARTICLE_POSES,
    PARTICLES,
    Channel,
    Delivery,
    Topic,
    published_topics,
    subscriptions,
)
from firstfix.ros.node import Node
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.ros2.bond import BOND, Bond
from firstfix.ros.ros2.localized import LocalizedService
from firstfix.ros.ros2.types import LATCHED, find, make, quality
from firstfix.ros.services import LoadResult, Request, Service, ros2_services
from firstfix.ros.transport import Severity

_LOAD_MAP = "nav2_msgs/LoadMap"
# A map server is waited for this long, s.
_CALL_S = 2.0


class Ros2:
    """A transport for `Node`: topics and services of a lifecycle node while it is configured.

    Parameters
    ----------
    owner : LifecycleNode
        The node.
    config : NodeConfig
        The topics depend on the mode.
    bond_timeout_s : float, optional
        Silence after which the lifecycle manager treats the node as dead, s; 0: no bond.
    localized : LocalizedService, optional
        Answers once the robot is localized.
    """

    def __init__(
        self,
        owner: LifecycleNode,
        config: NodeConfig,
        bond_timeout_s: float = 0.0,
        localized: LocalizedService | None = None,
    ) -> None:
        self._owner = owner
        self._config = config
        self._bond_timeout_s = bond_timeout_s
        self._localized = localized
        self._node: Node | None = None
        self._is_active = False
        self._kept: dict[Topic, Any] = {}
        self._sending = threading.Lock()
        self.particles = PARTICLES if find("msg", PARTICLES.type_name) else PARTICLE_POSES
        kinds = {t: find("msg", t.type_name) for t in published_topics(config, self.particles)}
        self._publishers = {
            topic.name: owner.create_lifecycle_publisher(kind, topic.name, quality(topic))
            for topic, kind in kinds.items()
            if kind is not None
        }
        self._subscriptions: list[Any] = []
        self._services: list[Any] = []
        self._map_server: Any | None = None
        self._bond: Bond | None = None

    def start(self, node: Node) -> None:
        """Start a node, subscribe to its topics and offer its services.

        Raises
        ------
        InputError
            If its map cannot be used, or a package of messages is missing.
        """
        asked = self._config.load_map_service
        if asked and (kind := self._find("srv", _LOAD_MAP, asked)) is not None:
            self._map_server = self._owner.create_client(kind, asked)
        node.start()
        self._node = node
        self.deactivate()
        for channel, topic in subscriptions(self._config):
            if (kind := self._find("msg", topic.type_name, topic.name)) is not None:
                receive = partial(self._receive, node, channel, topic)
                made = self._owner.create_subscription(kind, topic.name, receive, quality(topic))
                self._subscriptions.append(made)
        for service in ros2_services(self._config):
            if (kind := self._find("srv", service.type_name, service.name)) is not None:
                answer = partial(self._answer, node, service)
                self._services.append(self._owner.create_service(kind, service.name, answer))

    def activate(self) -> None:
        """Pass messages on to the node."""
        with self._sending:
            self._is_active = True
            kept, self._kept = self._kept, {}
            for topic, message in kept.items():
                self._send(topic, message)
        if self._node is not None:
            self._node.expects_topics_since = time.monotonic()
        if self._bond_timeout_s > 0.0 and (kind := self._find("msg", BOND, "bond")) is not None:
            self._bond = Bond(self._owner, kind, self._bond_timeout_s)

    def deactivate(self) -> None:
        """Pass on latched messages only."""
        self._is_active = False
        if self._bond is not None:
            self._bond.close()
            self._bond = None
        if self._node is not None:
            self._node.expects_topics_since = math.inf

    def close(self) -> None:
        """Stop the node, and destroy its topics and services."""
        self.deactivate()
        self._set_localized(is_localized=False)
        if self._node is not None:
            self._node.stop()
        self._node = None  # or node and transport would keep each other alive
        publishers, self._publishers = self._publishers, {}
        for publisher in publishers.values():
            self._owner.destroy_lifecycle_publisher(publisher)
        while self._subscriptions:
            self._owner.destroy_subscription(self._subscriptions.pop())
        while self._services:
            self._owner.destroy_service(self._services.pop())
        if self._map_server is not None:
            self._owner.destroy_client(self._map_server)
            self._map_server = None

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Build a message."""
        return make(type_name, **fields)

    def publish(self, topic: Topic, message: Any) -> None:
        """Send a message; while the node is not active, only the last latched one is kept."""
        if topic == LOCALIZED:
            self._set_localized(is_localized=message.data)
        with self._sending:
            if self._is_active:
                self._send(topic, message)
            elif topic.delivery is Delivery.LATCHED and topic != AMCL_POSE:
                self._kept[topic] = message  # rclpy would drop it; a pose would be out of date

    def _send(self, topic: Topic, message: Any) -> None:
        if (publisher := self._publishers.get(topic.name)) is None:
            return  # closed while the worker was busy
        try:
            publisher.publish(message)
        except RuntimeError:
            if rclpy.ok():  # if not, ROS was shut down before the node
                raise

    def subscriber_count(self, topic: Topic) -> int:
        """Count the subscribers of a topic."""
        publisher = self._publishers.get(topic.name)
        return publisher.get_subscription_count() if publisher is not None and rclpy.ok() else 0

    def load_map(self, service: str, path: str) -> int:
        """Call ``nav2_msgs/LoadMap`` of a map server (`Transport.load_map`)."""
        client, done = self._map_server, threading.Event()
        if client is None or not client.wait_for_service(timeout_sec=_CALL_S):
            raise OSError(f"there is no service {service}")
        called = client.call_async(client.srv_type.Request(map_url=path))
        called.add_done_callback(lambda _: done.set())
        if not done.wait(_CALL_S):
            raise OSError(f"{service} does not answer")
        return int(called.result().result)

    def log(self, severity: Severity, text: str) -> None:
        """Write to the console and to rosout."""
        # rclpy refuses a second severity from the same place in the code.
        if severity is Severity.ERROR:
            self._owner.get_logger().error(text)
        elif severity is Severity.WARNING:
            self._owner.get_logger().warning(text)
        else:
            self._owner.get_logger().info(text)

    def _find(self, kind: str, type_name: str, name: str) -> Any | None:
        found = find(kind, type_name)
        if found is None:
            self.log(Severity.INFO, f"without {name}: this ROS 2 has no {type_name}")
        return found

    def _receive(self, node: Node, channel: Channel, topic: Topic, message: Any) -> None:
        # A latched message comes once: if it were dropped while inactive, it would be lost.
        if self._is_active or topic.delivery in LATCHED:
            node.receive(channel, message)

    def _set_localized(self, *, is_localized: bool) -> None:
        if self._localized is not None:
            self._localized.update(is_localized=is_localized)

    def _answer(self, node: Node, service: Service, request: Any, response: Any) -> Any:
        if not self._is_active:
            self.log(Severity.WARNING, f"{service.name} has no effect: firstfix is not active")
            fields = {"result": int(LoadResult.UNDEFINED_FAILURE)}
            fields = fields if service.request is Request.LOAD_MAP else {}
        else:
            if service.request is Request.SEARCH:
                self._set_localized(is_localized=False)  # at once, not after the search began
            fields = node.answer(service.request, request)
        for name, value in fields.items():
            setattr(response, name, value)
        return response
