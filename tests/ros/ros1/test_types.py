"""Messages of ROS 1 whose packages are installed, or not: in the Python that has rospy."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import Any

import pytest

from firstfix.ros.channels import PARTICLE_POSES, published_topics, subscribed_topics
from firstfix.ros.node_config import Mode, NodeConfig

rospy = pytest.importorskip("rospy")
types = pytest.importorskip("firstfix.ros.ros1.types")
installed = pytest.importorskip("roslib.message")

TYPES = {
    topic.type_name
    for mode in Mode
    for topic in (
        *subscribed_topics(NodeConfig(mode=mode)).values(),
        *published_topics(NodeConfig(mode=mode), PARTICLE_POSES),
    )
    if not topic.type_name.startswith("kobuki/")
}


@pytest.fixture
def nothing_installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    types.message_class.cache_clear()
    monkeypatch.setattr(installed, "get_message_class", lambda _: None)
    yield
    types.message_class.cache_clear()


@pytest.mark.parametrize("name", sorted(TYPES - {"tf2_msgs/TFMessage"}))
def test_a_class_made_from_its_definition_is_that_of_the_package(
    nothing_installed: None, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = types.message_class(name)
    monkeypatch.undo()
    known = installed.get_message_class(name)
    if known is None:
        pytest.skip(f"the package of {name} is not installed")
    assert made is not known
    # The sum over the definition, by which the ends of a topic know that they mean the same.
    assert made._md5sum == known._md5sum


def test_every_topic_of_the_node_has_a_class() -> None:
    for name in TYPES:
        assert types.message_class(name)._type == name


def test_stamps_are_those_of_rospy() -> None:
    assert types.make("builtin_interfaces/Time", sec=3, nanosec=5) == rospy.Time(3, 5)


def test_an_event_is_read_by_the_definition_that_came_with_it() -> None:
    message: Any = rospy.AnyMsg()
    message._connection_header = {
        "type": "kobuki_msgs/WheelDropEvent",
        "message_definition": "uint8 LEFT=0\nuint8 RIGHT=1\nuint8 wheel\nuint8 state\n",
    }
    message.deserialize(b"\x01\x01")
    event = types.decoded(message)
    assert (event.wheel, event.state) == (1, 1)


def test_the_empty_service_is_that_of_std_srvs() -> None:
    assert (types.Empty._type, types.Empty._md5sum) == (
        "std_srvs/Empty",
        "d41d8cd98f00b204e9800998ecf8427e",
    )
    buff = BytesIO()
    types.Empty._request_class().serialize(buff)
    assert buff.getvalue() == b""
    assert isinstance(types.Empty._response_class().deserialize(b""), types.Empty._response_class)
