"""The node for ROS 1, over rospy."""

from __future__ import annotations

import threading
from functools import partial
from typing import Any

import nav_msgs.srv
import rospy

from firstfix.adapters.node import Node
from firstfix.adapters.parameters import configured, flattened
from firstfix.adapters.ros1_types import Empty, decoded, make, message_class
from firstfix.adapters.topics import (
    PARTICLE_POSES,
    Delivery,
    Heard,
    Topic,
    heard_topics,
    said_topics,
)
from firstfix.adapters.transport import Gravity
from firstfix.system.node_config import NodeConfig

# Messages that wait for slow subscribers; after that the oldest are dropped.
_QUEUE = 10
_MASTER_CHECK_S = 1.0
_LOG = {
    Gravity.INFO: rospy.loginfo,
    Gravity.WARNING: rospy.logwarn,
    Gravity.ERROR: rospy.logerr,
}
_SERVICES = {
    "global_localization": Heard.RESET,
    "reinitialize_global_localization": Heard.RESET,
    "request_nomotion_update": Heard.UPDATE,
}


class Ros1:
    """A transport for `Node`: messages and topics of ROS 1.

    Parameters
    ----------
    config : NodeConfig
        What is published depends on the mode.
    """

    particles = PARTICLE_POSES

    def __init__(self, config: NodeConfig) -> None:
        self._config = config
        self._publishers: dict[str, rospy.Publisher] = {}
        self._others: list[Any] = []

    def connect(self, node: Node) -> None:
        """Advertise and subscribe all; if that was done before, anew: the master has changed."""
        for old in (*self._publishers.values(), *self._others):
            (old.shutdown if isinstance(old, rospy.Service) else old.unregister)()
        topics = said_topics(self._config, PARTICLE_POSES)
        self._publishers = {topic.name: _publisher(topic) for topic in topics}
        self._others = [
            *(_subscriber(t, partial(node.hear, h)) for h, t in heard_topics(self._config).items()),
            *(rospy.Service(name, Empty, partial(_ask, node, h)) for name, h in _SERVICES.items()),
        ]

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Build a message."""
        return make(type_name, **fields)

    def publish(self, topic: Topic, message: Any) -> None:
        """Send a message, unless the node is on its way out."""
        try:
            self._publishers[topic.name].publish(message)
        except rospy.ROSException:
            if not rospy.is_shutdown():
                raise

    def listeners(self, topic: Topic) -> int:
        """Count those who listen."""
        return int(self._publishers[topic.name].get_num_connections())

    def log(self, gravity: Gravity, text: str) -> None:
        """Write to the console and to rosout."""
        _LOG[gravity]("%s", text)


def run(arguments: list[str]) -> None:
    """Run the node until ROS ends it.

    Parameters
    ----------
    arguments : list of str
        Of ROS: ``topic:=other``, ``_parameter:=value``, ``__name:=name``.

    Raises
    ------
    InputError
        If a parameter cannot be used.
    """
    rospy.init_node("firstfix", argv=["firstfix", *arguments])
    values = flattened(rospy.get_param("~", {}))
    uses_topic = values.pop("use_map_topic", True)
    config = configured(values)
    transport = Ros1(config)
    node = Node(config, transport)
    node.start()
    transport.connect(node)
    if not uses_topic and not config.yaml_filename:
        threading.Thread(target=_ask_for_map, args=(node,), daemon=True).start()
    _spin(transport, node)
    node.stop()


def _spin(transport: Ros1, node: Node) -> None:
    """Wait for the end; meanwhile, rospy does not notice when another master takes over."""
    known = _master_pid()
    while not rospy.is_shutdown():
        rospy.rostime.wallsleep(_MASTER_CHECK_S)
        now = _master_pid()
        if now is not None and known is not None and now != known:
            transport.log(Gravity.WARNING, "the master was restarted: registering anew")
            transport.connect(node)
        known = now or known


def _master_pid() -> int | None:
    try:
        return int(rospy.get_master().getPid()[2])
    except (OSError, rospy.ROSException):
        return None


def _publisher(topic: Topic) -> rospy.Publisher:
    return rospy.Publisher(
        topic.name,
        message_class(topic.type_name),
        latch=topic.delivery is Delivery.LATCHED,
        queue_size=_QUEUE,
        tcp_nodelay=True,
    )


def _subscriber(topic: Topic, hear: Any) -> rospy.Subscriber:
    if topic.type_name.startswith("kobuki/"):
        return rospy.Subscriber(topic.name, rospy.AnyMsg, lambda message: hear(decoded(message)))
    kind = message_class(topic.type_name)
    return rospy.Subscriber(topic.name, kind, hear, tcp_nodelay=True)


def _ask(node: Node, heard: Heard, _: Any) -> Any:
    node.hear(heard)
    return Empty._response_class()  # noqa: SLF001 - rospy's name for it


def _ask_for_map(node: Node) -> None:
    """Fetch the map by the service, as AMCL does unless it is told to use the topic."""
    rospy.wait_for_service("static_map")
    node.hear(Heard.MAP, rospy.ServiceProxy("static_map", nav_msgs.srv.GetMap)().map)
