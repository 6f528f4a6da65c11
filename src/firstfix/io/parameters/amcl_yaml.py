"""Typed values from a ROS 2 parameter file such as Nav2's."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any

from firstfix.amcl.config import MotionModel
from firstfix.core.errors import InputError
from firstfix.io.atomic_files import show
from firstfix.io.parameters.ros1_amcl import ros1_remedy
from firstfix.io.parameters.ros_parameters import read_parameters
from firstfix.io.safe_yaml import kind

# Parameters of every node, those that only save memory, and the threads of Beluga: none of them
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
# Above, a float64 may differ from the integer in the file.
_MAX_INTEGER = 2**53


def read_values(path: Path, node: str, defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Read the parameters of one node.

    Accepted are ``node: ros__parameters:``, also under a namespace or beside other nodes, the
    wildcard ``/**``, and the parameters alone. Parameters in `IGNORED` have no effect.

    Parameters
    ----------
    path : Path
        The YAML.
    node : str
        Name of the node.
    defaults : mapping of str to object
        Default of each parameter by its dotted name; a value must have the type of its default.

    Returns
    -------
    dict of str to object
        The values in the file, by dotted name.

    Raises
    ------
    InputError
        If there is no section for this node or more than one, a name is unknown, or a value has the
        wrong type.
    """
    found = read_parameters(path, node, frozenset(defaults)).items()
    return {
        name: _checked(name, value, path, defaults)
        for name, value in found
        if name.partition(".")[0] not in IGNORED
    }


def _checked(name: str, value: Any, path: Path, defaults: Mapping[str, Any]) -> Any:
    if name not in defaults:
        raise _unknown(name, value, path, defaults)
    default = defaults[name]
    converted = _converted(value, default)
    if converted is None:
        quotes = "" if isinstance(default, str) else ", without quotes"
        raise InputError(
            expected=f"{name} as {_wanted(default)} in {path}",
            received=kind(value),
            remedy=f"write it like '{name}: {_written(default)}'{quotes}",
        )
    return converted


def _converted(value: Any, default: Any) -> Any:
    """Return a value in the type of the default; None if ROS would reject its type."""
    if isinstance(default, Enum):
        return choices(default).get(value) if isinstance(value, str) else None
    if isinstance(default, str) and isinstance(value, list) and value:
        words = all(type(each) in (str, int, float) for each in value)
        return " ".join(map(str, value)) if words else None
    if isinstance(default, (str, bool)):
        return value if type(value) is type(default) and value != "" else None
    if type(value) not in (int, float) or not abs(value) <= sys.float_info.max:
        return None
    if isinstance(default, int):
        return int(value) if value == int(value) and abs(value) <= _MAX_INTEGER else None
    return float(value)


def choices(default: Enum) -> dict[str, Enum]:
    """Return the names of the values of a setting, with the values."""
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


def _unknown(name: str, value: Any, path: Path, defaults: Mapping[str, Any]) -> InputError:
    near = difflib.get_close_matches(name, [*defaults, *IGNORED], 1)
    nearest = f"the nearest is {near[0]}" if near else "delete the line, or check the file"
    remedy = ros1_remedy(name, str(value)) or nearest
    if name == "initial_pose":
        remedy = "write 'initial_pose: {x: 0.0, y: 0.0, yaw: 0.0}'"
    return InputError(
        expected=f"parameters of Nav2's AMCL in {path}", received=show(name), remedy=remedy
    )
