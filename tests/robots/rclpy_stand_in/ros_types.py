"""Message classes as strict as those that rosidl generates, made from rosbags' definitions.

A field takes only what the generated setters take: a float must be a Python float, an integer an
int in its bounds, a byte one of bytes, a list a list of the right messages.
"""

from __future__ import annotations

import array
import sys
from collections.abc import Iterable
from types import ModuleType
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

KOBUKI = {
    "CliffEvent": "uint8 sensor\nuint8 state\nuint16 bottom",
    "WheelDropEvent": "uint8 wheel\nuint8 state",
    "BumperEvent": "uint8 bumper\nuint8 state",
}
NAV2 = {
    "Particle": "geometry_msgs/Pose pose\nfloat64 weight",
    "ParticleCloud": "std_msgs/Header header\nParticle[] particles",
}
BOND = {
    "Status": "std_msgs/Header header\nstring id\nstring instance_id\nbool active\n"
    "float32 heartbeat_timeout\nfloat32 heartbeat_period"
}
PACKAGES = ("builtin_interfaces", "diagnostic_msgs", "geometry_msgs", "nav_msgs", "rcl_interfaces")
PACKAGES += ("sensor_msgs", "std_msgs", "std_srvs", "tf2_msgs")
OPTIONAL = {
    "bond": BOND,
    "kobuki_ros_interfaces": KOBUKI,
    "nav2_msgs": NAV2,
    "visualization_msgs": {},
}

TYPECODES = {"float32": "f", "float64": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H"}
TYPECODES |= {"int32": "i", "uint32": "I", "int64": "q", "uint64": "Q"}


def modules(optional: Iterable[str]) -> dict[str, ModuleType]:
    """Return the modules of the packages that a robot has installed, by name."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    packages = [*PACKAGES, *optional]
    for package in optional:
        for name, text in OPTIONAL[package].items():
            store.register(get_types_from_msg(text, f"{package}/msg/{name}"))
    classes = _Classes(store.fielddefs)
    found: dict[str, ModuleType] = {}
    for package in packages:
        for part in ("", ".msg", ".srv"):
            found[package + part] = ModuleType(package + part)
        for name in [n for n in store.fielddefs if n.startswith(f"{package}/msg/")]:
            setattr(found[f"{package}.msg"], name.rpartition("/")[2], classes[name])
    found["std_srvs.srv"].Empty = _service({}, {})
    if "nav2_msgs" in packages:
        pose = classes["geometry_msgs/msg/PoseWithCovarianceStamped"]
        found["nav2_msgs.srv"].SetInitialPose = _service({"pose": pose}, {})
        grid = classes["nav_msgs/msg/OccupancyGrid"]
        found["nav2_msgs.srv"].LoadMap = _service({"map_url": str}, {"map": grid, "result": int})
    return found


def names() -> list[str]:
    """Return the names of all modules that there may be, also of those that are in the way."""
    packages = [*PACKAGES, *OPTIONAL]
    ours = [f"{package}{part}" for package in packages for part in ("", ".msg", ".srv")]
    theirs = [n for n in sys.modules if n.partition(".")[0] in packages]
    return [*ours, *theirs]


class _Classes(dict[str, Any]):
    """Classes by name, made when they are first asked for."""

    def __init__(self, definitions: Any) -> None:
        self._definitions = definitions

    def __missing__(self, name: str) -> Any:
        fields = dict(self._definitions[name][1])
        members: dict[str, Any] = {f: _property(f, kind, self) for f, kind in fields.items()}
        members["__slots__"] = [f"_{field}" for field in fields]
        members["__init__"] = _constructor(fields, self)
        self[name] = type(name.rpartition("/")[2], (), members)
        return self[name]


def _constructor(fields: dict[str, Any], classes: _Classes) -> Any:
    def construct(self: Any, **given: Any) -> None:
        assert set(given) <= set(fields), f"Invalid arguments passed to constructor: {given}"
        for field, kind in fields.items():
            setattr(self, field, given[field] if field in given else _default(kind, classes))

    return construct


def _default(kind: Any, classes: _Classes) -> Any:
    node, about = kind
    if node is Nodetype.NAME:
        return classes[about]()
    if node is Nodetype.ARRAY:
        return np.zeros(about[1], about[0][1][0])
    if node is Nodetype.SEQUENCE:
        return []
    simple = {"string": "", "bool": False, "byte": b"\0", "float32": 0.0, "float64": 0.0}
    return simple.get(about[0], 0)


def _property(field: str, kind: Any, classes: _Classes) -> property:
    def set_it(self: Any, value: Any) -> None:
        setattr(self, f"_{field}", _taken(field, kind, value, classes))

    return property(lambda self: getattr(self, f"_{field}"), set_it)


def _taken(field: str, kind: Any, value: Any, classes: _Classes) -> Any:
    """Return what a field keeps of a value; AssertionError as rosidl's code raises it."""
    node, about = kind
    if node is Nodetype.BASE:
        return _taken_base(field, about[0], value)
    if node is Nodetype.NAME:
        assert isinstance(value, classes[about]), f"{field} must be a {about}, not {value!r}"
        return value
    (element_node, element), size = about
    if element_node is Nodetype.BASE and element[0] in TYPECODES:
        return _taken_numbers(field, element[0], 0 if node is Nodetype.SEQUENCE else size, value)
    assert isinstance(value, (list, tuple)), f"{field} must be a list, not {value!r}"
    for one in value:
        _taken(field, (element_node, element), one, classes)
    return value


def _taken_base(field: str, name: str, value: Any) -> Any:
    if name == "byte":
        fits = isinstance(value, (bytes, bytearray)) and len(value) == 1
    elif name == "string":
        fits = isinstance(value, str)
    elif name == "bool":
        fits = isinstance(value, bool)
    elif name.startswith("float"):
        fits = isinstance(value, float)
    else:
        limits = np.iinfo(name)
        fits = isinstance(value, int) and limits.min <= value <= limits.max
    assert fits, f"{field} must be a {name}, not {value!r}"
    return value


def _taken_numbers(field: str, name: str, size: int, value: Any) -> Any:
    code = TYPECODES[name]
    if isinstance(value, np.ndarray):
        assert value.dtype == np.dtype(name), f"{field} must have the dtype {name}"
        value = value.tolist()
    elif isinstance(value, array.array):
        assert value.typecode == code, f"{field} must have the type code {code}"
        value = value.tolist()
    for one in value:
        _taken_base(field, name, one)
    if not size:
        return array.array(code, value)
    assert len(value) == size, f"{field} must have {size} elements"
    return np.array(value, name)


def _service(request: dict[str, Any], response: dict[str, Any]) -> Any:
    def message(name: str, fields: dict[str, Any]) -> Any:
        def construct(self: Any, **given: Any) -> None:
            for field, kind in fields.items():
                value = given.pop(field, None) or kind()
                assert isinstance(value, kind)
                setattr(self, field, value)
            assert not given

        return type(name, (), {"__init__": construct})

    parts = {"Request": message("Request", request), "Response": message("Response", response)}
    return type("Service", (), parts)
