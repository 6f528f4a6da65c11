"""Message classes of ROS 1, installed or generated from their definitions."""

from __future__ import annotations

import functools
from typing import Any

import genpy
import genpy.dynamic
import nav_msgs.srv
import roslib.message
import rospy
from rosbags.typesys import Stores, get_typestore

_EMPTY = "std_srvs/Empty"
_TRIGGER = "std_srvs/Trigger"
_TRIGGER_MD5 = "937c9679a518e3a18d831e57125ea522"
# Of an empty text.
_EMPTY_MD5 = "d41d8cd98f00b204e9800998ecf8427e"


@functools.cache
def message_class(type_name: str) -> Any:
    """Return the class of a message, generated where its package is not installed.

    rospy needs few packages, and diagnostic_msgs is not among them.

    Parameters
    ----------
    type_name : str
        ``package/Type`` of ROS 1 Noetic.

    Returns
    -------
    type
        The class.
    """
    found = roslib.message.get_message_class(type_name)
    if found is not None:
        return found
    package, _, name = type_name.partition("/")
    store = get_typestore(Stores.ROS1_NOETIC)
    definition, _ = store.generate_msgdef(f"{package}/msg/{name}", ros_version=1)
    return genpy.dynamic.generate_dynamic(type_name, definition)[type_name]


def service_class(type_name: str) -> Any:
    """Return the class of a service.

    Parameters
    ----------
    type_name : str
        ``nav_msgs/Type``, or ``Empty`` or ``Trigger`` of std_srvs, which need not be installed.

    Returns
    -------
    type
        The class.
    """
    if type_name == _EMPTY:
        return Empty
    if type_name == _TRIGGER:
        return Trigger
    return getattr(nav_msgs.srv, type_name.partition("/")[2])


def make(type_name: str, /, **fields: Any) -> Any:
    """Build a message of ROS 1 from its fields."""
    if type_name == "builtin_interfaces/Time":
        return rospy.Time(fields["sec"], fields["nanosec"])
    return message_class(type_name)(**fields)


def decoded(message: rospy.AnyMsg) -> Any:
    """Decode a message by the definition that its publisher sent along.

    The packages of a Kobuki need not be installed.

    Parameters
    ----------
    message : rospy.AnyMsg
        As received.

    Returns
    -------
    message
        With fields.
    """
    head = message._connection_header  # noqa: SLF001 - rospy has no other way to the definition
    kind = _defined(head["type"], head["message_definition"])
    return kind().deserialize(message._buff)  # noqa: SLF001 - nor to the bytes


@functools.cache
def _defined(type_name: str, definition: str) -> Any:
    return genpy.dynamic.generate_dynamic(type_name, definition)[type_name]


class _Nothing(genpy.Message):  # type: ignore[misc]
    """An empty request, and an empty response."""

    _md5sum = _EMPTY_MD5
    _type = _EMPTY
    _full_text = ""
    __slots__ = ()
    _slot_types: tuple[str, ...] = ()

    def _get_types(self) -> tuple[str, ...]:
        return self._slot_types

    def serialize(self, buff: Any) -> None:
        """Write nothing."""

    def deserialize(self, _: bytes) -> _Nothing:
        """Read nothing."""
        return self


class Empty:
    """``std_srvs/Empty``."""

    _type = _EMPTY
    _md5sum = _EMPTY_MD5
    _request_class = _Nothing
    _response_class = _Nothing


class Trigger:
    """``std_srvs/Trigger``."""

    _type = _TRIGGER
    _md5sum = _TRIGGER_MD5
    _request_class = _Nothing
    _response_class = genpy.dynamic.generate_dynamic(
        "std_srvs/TriggerResponse", "bool success\nstring message\n"
    )["std_srvs/TriggerResponse"]
