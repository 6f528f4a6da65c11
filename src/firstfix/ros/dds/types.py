"""Messages of ROS 2 without ROS: rosbags reads and writes CDR, Cyclone DDS gets their types."""

from __future__ import annotations

import functools
import os
import struct
from typing import Any

import numpy as np
from cyclonedds.idl import IdlStruct, make_idl_struct, types
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from firstfix.core.errors import InputError

# Messages of packages outside the ROS core.
_DEFINITIONS = {
    "nav2_msgs/msg/Particle": "geometry_msgs/Pose pose\nfloat64 weight",
    "nav2_msgs/msg/ParticleCloud": "std_msgs/Header header\nnav2_msgs/Particle[] particles",
    "kobuki_ros_interfaces/msg/CliffEvent": "uint8 LEFT=0\nuint8 CENTER=1\nuint8 RIGHT=2\n"
    "uint8 FLOOR=0\nuint8 CLIFF=1\nuint8 sensor\nuint8 state\nuint16 bottom",
    "kobuki_ros_interfaces/msg/WheelDropEvent": "uint8 LEFT=0\nuint8 RIGHT=1\n"
    "uint8 RAISED=0\nuint8 DROPPED=1\nuint8 wheel\nuint8 state",
    "kobuki_ros_interfaces/msg/BumperEvent": "uint8 LEFT=0\nuint8 CENTER=1\nuint8 RIGHT=2\n"
    "uint8 RELEASED=0\nuint8 PRESSED=1\nuint8 bumper\nuint8 state",
}
# Packages that ROS 2 names differently than `firstfix.ros.channels`.
_PACKAGES = {"kobuki": "kobuki_ros_interfaces"}
_BASE = {"bool": bool, "byte": types.uint8, "char": types.uint8, "string": str}


@functools.cache
def _store() -> Typestore:
    distribution = os.environ.get("ROS_DISTRO", "").upper()
    # Since Iron, the types of the node are the same in all distributions.
    store = get_typestore(getattr(Stores, f"ROS2_{distribution}", Stores.ROS2_IRON))
    for name, text in _DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


def full_name(type_name: str) -> str:
    """Return ``package/msg/Type``.

    Parameters
    ----------
    type_name : str
        ``package/Type``.

    Returns
    -------
    str
        As ROS 2 has it.
    """
    package, _, short = type_name.partition("/")
    return f"{_PACKAGES.get(package, package)}/msg/{short}"


def make(type_name: str, /, **fields: Any) -> Any:
    """Build a message; the fields that are not given are zero or empty."""
    name = full_name(type_name)
    known = _store().fielddefs[name][1]
    if len(fields) < len(known):
        fields = {field: _zero(kind) for field, kind in known} | fields
    return _store().types[name](**fields)


def _zero(described_as: Any) -> Any:
    """Return the value of a field that is not given, from rosbags' description of its type."""
    kind, detail = described_as
    if kind == Nodetype.NAME:
        package, _, short = detail.split("/")
        return make(f"{package}/{short}")
    if kind == Nodetype.BASE:
        return {"string": "", "bool": False}.get(detail[0], 0)
    element, length = detail
    is_number = element[0] == Nodetype.BASE and element[1][0] not in ("string", "bool")
    return np.zeros(length, element[1][0]) if is_number else [_zero(element)] * length


def encode(type_name: str, message: Any) -> bytes:
    """Write a message as CDR with its four-byte header."""
    return bytes(_store().serialize_cdr(message, full_name(type_name)))


def decode(type_name: str, data: bytes) -> Any:
    """Read a message.

    Parameters
    ----------
    type_name : str
        ``package/Type``.
    data : bytes
        CDR with its four-byte header.

    Returns
    -------
    message
        With arrays of NumPy.

    Raises
    ------
    InputError
        If the bytes are no such message.
    """
    try:
        return _store().deserialize_cdr(data, full_name(type_name))
    except (SerdeError, struct.error, ValueError, AssertionError, IndexError) as error:
        raise InputError(
            expected=f"a {type_name}",
            received=f"{len(data)} bytes that are none ({error})",
            remedy="look for the node that publishes it",
        ) from error


def type_hash(type_name: str) -> str:
    """Return the hash of a definition, by which ROS 2 distinguishes versions of a message."""
    return str(_store().hash_rihs01(full_name(type_name)))


@functools.cache
def described(type_name: str) -> type[IdlStruct]:
    """Describe a message to DDS.

    Parameters
    ----------
    type_name : str
        ``package/Type``.

    Returns
    -------
    type
        A keyless struct under the name that ROS 2 gives it. It is not used to write or read.
    """
    return _struct(full_name(type_name))


@functools.cache
def _struct(name: str) -> type[IdlStruct]:
    package, _, short = name.split("/")
    fields = {field: _field(kind) for field, kind in _store().fielddefs[name][1]}
    made: type[IdlStruct] = make_idl_struct(f"{short}_", f"{package}.msg.dds_.{short}_", fields)
    return made


def _field(described_as: Any) -> Any:
    """Translate the type of a field from rosbags' description to that of Cyclone DDS."""
    kind, detail = described_as
    if kind == Nodetype.NAME:
        return _struct(detail)
    if kind == Nodetype.BASE:
        name, limit = detail
        if name == "string" and limit:
            return types.bounded_str[limit]
        return _BASE.get(name) or getattr(types, name)
    element, length = _field(detail[0]), detail[1]
    if kind == Nodetype.ARRAY:
        return types.array[element, length]
    return types.sequence[element, length] if length else types.sequence[element]


class Cdr:
    """A message as it travels, in place of the objects that Cyclone DDS would make of it.

    Parameters
    ----------
    data : bytes
        CDR with its four-byte header.
    """

    def __init__(self, data: bytes) -> None:
        self.data = data

    def serialize(self, **_: Any) -> bytes:
        """Return the bytes to write."""
        return self.data

    @classmethod
    def deserialize(cls, data: bytes) -> Cdr:
        """Wrap the bytes that were read."""
        return cls(data)

    @classmethod
    def deserialize_key(cls, data: bytes) -> Cdr:
        """Wrap the notice that a writer has disappeared; messages have no key."""
        return cls(data)
