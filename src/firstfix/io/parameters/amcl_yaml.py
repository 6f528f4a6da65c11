"""Settings of AMCL from a parameter file of Nav2, read as they are or refused."""

from __future__ import annotations

import difflib
import math
import os
from dataclasses import fields
from enum import Enum
from pathlib import Path
from typing import Any

import yaml

from firstfix.amcl.config import AmclConfig, MotionModel
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.io.maps.files import show
from firstfix.io.parameters.ros1_amcl import ros1_remedy
from firstfix.io.parameters.ros_parameters import read_parameters
from firstfix.io.safe_yaml import kind, to_flag, to_number

# What every node has, what only saves memory, and what chooses threads in Beluga: nothing in them
# changes a pose. The part before the first dot counts.
IGNORED = frozenset(
    {
        "allow_parameter_qos_overrides",
        "autostart_node",
        "bond_heartbeat_period",
        "diagnostic_updater",
        "execution_policy",
        "freespace_downsampling",
        "introspection_mode",
        "qos_overrides",
        "service_introspection_mode",
        "start_type_description_service",
        "use_sim_time",
    }
)

# Names of Nav2 until Foxy.
_OLD_MODELS = {
    "differential": MotionModel.DIFFERENTIAL,
    "omnidirectional": MotionModel.OMNIDIRECTIONAL,
}
# A robot on a floor does not need z, but Nav2 has it.
_POSE = {f"initial_pose.{part}": 0.0 for part in ("x", "y", "z", "yaw")}
DEFAULTS: dict[str, Any] = {
    entry.name: entry.default for entry in fields(AmclConfig) if entry.name != "initial_pose"
} | _POSE
"""Of all parameters, by the flat names of ROS."""
# Above, a float64 may not be the integer that the file says.
_MAX_INTEGER = 2**53
# What PyYAML finds in plain scalars by itself; other tags were written by somebody with a plan.
_TAGS = frozenset(
    f"tag:yaml.org,2002:{name}" for name in ("bool", "float", "int", "str", "timestamp", "value")
)
_NULL = "tag:yaml.org,2002:null"


def load_amcl_config(path: str | os.PathLike[str]) -> AmclConfig:
    """Read the settings of AMCL from a parameter file.

    Accepted are ``amcl: ros__parameters:``, also under a namespace or beside other nodes, the
    wildcard ``/**``, and the parameters alone. Parameters in `IGNORED` have no effect.

    Parameters
    ----------
    path : path-like
        The YAML.

    Returns
    -------
    AmclConfig
        Nav2's defaults for what the file does not say.

    Raises
    ------
    InputError
        If there is no section for AMCL or more than one, a name is unknown, or a value has the
        wrong type or is out of range.
    """
    path = Path(path)
    values = {}
    for name, node in read_parameters(path, "amcl", frozenset(DEFAULTS)).items():
        if name.partition(".")[0] not in IGNORED:
            values[name] = _value(name, node, path)
    try:
        return amcl_config(values)
    except InputError as error:
        raise InputError(
            expected=f"{error.expected} in {path}", received=error.received, remedy=error.remedy
        ) from error


def amcl_config(values: dict[str, Any]) -> AmclConfig:
    """Make settings of some of `DEFAULTS`, by their names; raises InputError if out of range."""
    x, y, _, yaw = (values.get(name, default) for name, default in _POSE.items())
    settings = {name: value for name, value in values.items() if name not in _POSE}
    return AmclConfig(initial_pose=SE2(x, y, yaw), **settings)


def _value(name: str, node: yaml.Node, path: Path) -> Any:
    if name not in DEFAULTS:
        raise _unknown(name, node, path)
    default = DEFAULTS[name]
    quoted = getattr(node, "style", None) is not None
    plain = isinstance(node, yaml.ScalarNode) and node.tag in _TAGS
    value = _read(str(node.value).strip(), default, quoted=quoted) if plain else None
    if value is None:
        raise InputError(
            expected=f"{name} as {_wanted(default)} in {path}",
            received=_told(node, quoted=quoted),
            remedy=f"write it like '{name}: {_written(default)}'",
        )
    return value


def _told(node: yaml.Node, *, quoted: bool) -> str:
    if not isinstance(node, yaml.ScalarNode):
        return kind(node)
    if node.tag == _NULL:
        return "nothing"
    if node.tag not in _TAGS:
        return f"{kind(node)} with the tag {show(node.tag)}"
    return kind(node) + (" in quotes" if quoted else "")


def _read(text: str, default: Any, *, quoted: bool) -> Any:
    """Read a value of the type of the default; None where it is of another one, as to ROS."""
    if isinstance(default, Enum):
        return choices(default).get(text)
    number = to_number(text)
    if isinstance(default, str):
        bare_word = math.isnan(number) and to_flag(text) is None
        return text if text and (quoted or bare_word) else None
    if quoted:
        return None
    if isinstance(default, bool):
        return to_flag(text)
    if isinstance(default, int):
        fits = number.is_integer() and abs(number) <= _MAX_INTEGER
        return int(number) if fits else None
    return number if math.isfinite(number) else None


def choices(default: Enum) -> dict[str, Enum]:
    """Return what may be written for a setting, and what it means."""
    listed: dict[str, Enum] = {choice.value: choice for choice in type(default)}
    return listed | _OLD_MODELS if isinstance(default, MotionModel) else listed


def _wanted(default: Any) -> str:
    if isinstance(default, Enum):
        return f"one of {', '.join(choices(default))}"
    words = {bool: "true or false", int: "a whole number", float: "a finite number", str: "text"}
    return words[type(default)]


def _written(default: Any) -> str:
    if isinstance(default, Enum):
        return str(default.value)
    return f'"{default}"' if isinstance(default, str) else str(default).lower()


def _unknown(name: str, node: yaml.Node, path: Path) -> InputError:
    text = str(node.value) if isinstance(node, yaml.ScalarNode) else ""
    near = difflib.get_close_matches(name, [*DEFAULTS, *IGNORED], 1)
    nearest = f"the nearest is {near[0]}" if near else "delete the line, or check the file"
    remedy = ros1_remedy(name, text) or nearest
    if name == "initial_pose":
        remedy = "write 'initial_pose: {x: 0.0, y: 0.0, yaw: 0.0}'"
    return InputError(
        expected=f"parameters of Nav2's AMCL in {path}", received=show(name), remedy=remedy
    )
