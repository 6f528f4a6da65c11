"""Settings of AMCL from a parameter file of Nav2."""

from __future__ import annotations

import difflib
import os
import sys
from dataclasses import fields
from enum import Enum
from pathlib import Path
from typing import Any

from firstfix.amcl.config import AmclConfig, MotionModel
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
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
# A robot on a floor does not need z, but Nav2 has it.
_POSE = {f"initial_pose.{part}": 0.0 for part in ("x", "y", "z", "yaw")}
DEFAULTS: dict[str, Any] = {
    entry.name: entry.default for entry in fields(AmclConfig) if entry.name != "initial_pose"
} | _POSE
"""Of all parameters, by the flat names of ROS."""
# Above, a float64 may differ from the integer in the file.
_MAX_INTEGER = 2**53


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
        Nav2's defaults for all parameters that the file does not set.

    Raises
    ------
    InputError
        If there is no section for AMCL or more than one, a name is unknown, or a value has the
        wrong type or is out of range.
    """
    path = Path(path)
    values = {}
    for name, value in read_parameters(path, "amcl", frozenset(DEFAULTS)).items():
        if name.partition(".")[0] not in IGNORED:
            values[name] = _checked(name, value, path)
    try:
        return amcl_config(values)
    except InputError as error:
        raise InputError(
            expected=f"{error.expected} in {path}", received=error.received, remedy=error.remedy
        ) from error


def amcl_config(values: dict[str, Any]) -> AmclConfig:
    """Return settings from some of `DEFAULTS` by name; raises InputError if out of range."""
    x, y, _, yaw = (values.get(name, default) for name, default in _POSE.items())
    settings = {name: value for name, value in values.items() if name not in _POSE}
    return AmclConfig(initial_pose=SE2(x, y, yaw), **settings)


def _checked(name: str, value: Any, path: Path) -> Any:
    if name not in DEFAULTS:
        raise _unknown(name, value, path)
    default = DEFAULTS[name]
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


def _unknown(name: str, value: Any, path: Path) -> InputError:
    near = difflib.get_close_matches(name, [*DEFAULTS, *IGNORED], 1)
    nearest = f"the nearest is {near[0]}" if near else "delete the line, or check the file"
    remedy = ros1_remedy(name, str(value)) or nearest
    if name == "initial_pose":
        remedy = "write 'initial_pose: {x: 0.0, y: 0.0, yaw: 0.0}'"
    return InputError(
        expected=f"parameters of Nav2's AMCL in {path}", received=show(name), remedy=remedy
    )
