"""The node for ROS 1, over rospy."""

from __future__ import annotations

import threading
from functools import partial
from typing import Any

import nav_msgs.srv
import rospy
from rospy.numpy_msg import numpy_msg

from firstfix.core.errors import InputError
from firstfix.ros.channels import (
    PARTICLE_POSES,
    Channel,
    Delivery,
    Topic,
    published_topics,
    subscriptions,
)
from firstfix.ros.node import MakeNode, Node
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.parameters import configured, flattened
from firstfix.ros.ros1.master import is_forgotten, register_anew, wait_for_master
from firstfix.ros.ros1.types import decoded, make, message_class, service_class
from firstfix.ros.services import Service, ros1_services
from firstfix.ros.transport import Severity

# Messages that wait for slow subscribers; after that the oldest are dropped.
_QUEUE = 10
_MASTER_CHECK_S = 1.0
# The service static_map is called again after, s.
_ASK_AGAIN_S = 2.0
_LOG = {
    Severity.INFO: rospy.loginfo,
    Severity.WARNING: rospy.logwarn,
    Severity.ERROR: rospy.logerr,
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
        topics = published_topics(config, PARTICLE_POSES)
        self._publishers = {topic.name: _publisher(topic) for topic in topics}

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Build a message."""
        return make(type_name, **fields)

    def publish(self, topic: Topic, message: Any) -> None:
        """Send a message, unless the node is shutting down."""
        try:
            self._publishers[topic.name].publish(message)
        except rospy.ROSException:
            # Topics close some time before rospy says that it has shut down.
            if not rospy.core.is_shutdown_requested():
                raise

    def subscriber_count(self, topic: Topic) -> int:
        """Count the subscribers of a topic."""
        return int(self._publishers[topic.name].get_num_connections())

    def load_map(self, service: str, path: str) -> int:
        """Call ``nav_msgs/LoadMap`` of a map server (`Transport.load_map`)."""
        try:
            rospy.wait_for_service(service, timeout=_ASK_AGAIN_S)
            return int(rospy.ServiceProxy(service, nav_msgs.srv.LoadMap)(path).result)
        except (rospy.ROSException, rospy.ServiceException) as error:
            raise OSError(f"{error}") from error

    def log(self, severity: Severity, text: str) -> None:
        """Write to the console and to rosout."""
        _LOG[severity]("%s", text)


def run(arguments: list[str], make_node: MakeNode = Node) -> None:
    """Run the node until ROS ends it.

    Parameters
    ----------
    arguments : list of str
        Of ROS: ``topic:=other``, ``_parameter:=value``, ``__name:=name``.
    make_node : MakeNode
        Makes the node.

    Raises
    ------
    InputError
        If a parameter cannot be used.
    """
    if not wait_for_master():
        return
    values = flattened(_begin(arguments))
    uses_topic = _switch("use_map_topic", values.pop("use_map_topic", True))
    config = configured(values)
    node = make_node(config, Ros1(config))
    node.start()
    for channel, topic in subscriptions(config):
        if channel is Channel.MAP and not uses_topic:
            threading.Thread(target=_ask_for_map, args=(node,), daemon=True).start()
        else:
            _subscribe(topic, partial(node.receive, channel))
    _spin([_offer(node, service) for service in ros1_services(config)])
    node.stop()


def _begin(arguments: list[str]) -> Any:
    """Register with the master, and return the private parameters."""
    try:
        rospy.init_node("firstfix", argv=["firstfix", *arguments])
        return rospy.get_param("~", {})
    except (rospy.ROSException, OSError) as error:
        if rospy.is_shutdown():
            raise SystemExit(0) from None
        raise InputError(
            expected="a node that ROS can start",
            received=str(error),
            remedy="look at ROS_MASTER_URI, ROS_IP and the arguments",
        ) from error


def _spin(services: list[rospy.Service]) -> None:
    """Wait for the shutdown, and register with a restarted master, which rospy does not."""
    is_known = True
    while True:
        rospy.rostime.wallsleep(_MASTER_CHECK_S)
        is_new = is_forgotten()
        if rospy.is_shutdown():
            return  # the master forgot this node because it unregistered
        if is_new:
            rospy.logwarn("the master was restarted: registering anew")
        if is_new or not is_known:
            is_known = register_anew(services)


def _publisher(topic: Topic) -> rospy.Publisher:
    return rospy.Publisher(
        topic.name,
        message_class(topic.type_name),
        latch=topic.delivery is Delivery.LATCHED,
        queue_size=_QUEUE,
        tcp_nodelay=True,
    )


def _subscribe(topic: Topic, receive: Any) -> None:
    if topic.type_name.startswith("kobuki/"):
        rospy.Subscriber(topic.name, rospy.AnyMsg, lambda message: receive(decoded(message)))
        return
    # Long lists come as arrays: a tuple of the cells of a large map takes half a second.
    kind = numpy_msg(message_class(topic.type_name))
    rospy.Subscriber(topic.name, kind, receive, tcp_nodelay=True)


def _switch(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise InputError(
            expected=f"{name} as true or false", received=f"{value!r:.60}", remedy="write true"
        )
    return value


def _offer(node: Node, service: Service) -> rospy.Service:
    kind = service_class(service.type_name)

    def answer(request: Any) -> Any:
        fields = node.answer(service.request, request)
        return kind._response_class(**fields)  # noqa: SLF001 - rospy's name for it

    return rospy.Service(service.name.replace("~/", "~"), kind, answer)


def _ask_for_map(node: Node) -> None:
    """Fetch the map by the service, as AMCL does unless use_map_topic is set."""
    while not rospy.is_shutdown():
        grid = _map_of_service()
        if grid is not None:
            node.receive(Channel.MAP, grid)
            return
        rospy.rostime.wallsleep(_ASK_AGAIN_S)


def _map_of_service() -> Any:
    try:
        rospy.wait_for_service("static_map", timeout=_ASK_AGAIN_S)
        return rospy.ServiceProxy("static_map", nav_msgs.srv.GetMap)().map
    except (rospy.ROSException, rospy.ServiceException) as error:
        if not rospy.is_shutdown():
            rospy.logwarn_throttle(10.0, f"no map from the service static_map yet: {error}")
        return None
