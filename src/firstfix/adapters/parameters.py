"""The settings of a node as flat parameters, the way ROS has them."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import Enum
from typing import Any

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.formats.amcl_yaml import IGNORED
from firstfix.formats.ros1_amcl import ros1_remedy
from firstfix.system.node_config import NodeConfig

_POSE = "initial_pose"
_POSE_PARTS = tuple(f"{_POSE}.{part}" for part in ("x", "y", "yaw"))


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter.

    Parameters
    ----------
    name : str
        With dots, as ROS 2 writes it.
    default : bool, int, float or str
        Its default; its type is that of the parameter.
    description : str
        What it means.
    least, most : float
        Range of a number.
    choices : tuple of str
        What a text may be; empty if anything.
    """

    name: str
    default: bool | int | float | str
    description: str
    least: float
    most: float
    choices: tuple[str, ...] = ()


def parameters() -> tuple[Parameter, ...]:
    """Return all parameters of a node: its own, and those of AMCL under Nav2's names."""
    listed: list[Parameter] = []
    for owner in (NodeConfig, AmclConfig):
        for entry in fields(owner):
            if "description" not in entry.metadata:
                continue
            text, default = entry.metadata["description"], entry.default
            limits = entry.metadata["least"], entry.metadata["most"]
            if isinstance(default, SE2):
                listed += [Parameter(name, 0.0, text, *limits) for name in _POSE_PARTS]
            elif isinstance(default, Enum):
                choices = tuple(choice.value for choice in type(default))
                listed.append(Parameter(entry.name, default.value, text, *limits, choices))
            else:
                listed.append(Parameter(entry.name, default, text, *limits))
    return tuple(listed)


def flattened(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Name the values of nested mappings with dots, as ROS 2 does."""
    flat: dict[str, Any] = {}
    for name, value in tree.items():
        if isinstance(value, Mapping):
            flat |= flattened(value, f"{prefix}{name}.")
        else:
            flat[f"{prefix}{name}"] = value
    return flat


def configured(values: Mapping[str, Any]) -> NodeConfig:
    """Make the settings of a node from parameters.

    Parameters
    ----------
    values : mapping of str to object
        By dotted names; what is missing keeps its default. Parameters that every node of ROS has,
        such as ``use_sim_time``, are passed over.

    Returns
    -------
    NodeConfig
        The settings.

    Raises
    ------
    InputError
        If a name is unknown, or a value has the wrong type or is out of its range.
    """
    known = {parameter.name: parameter for parameter in parameters()}
    given = {k: v for k, v in values.items() if k.partition(".")[0] not in IGNORED}
    given.pop(f"{_POSE}.z", None)  # Nav2 has it, and a robot on a floor does not need it
    for name, value in given.items():
        if name not in known:
            raise _unknown(name, value, known)
        if known[name].choices and value not in known[name].choices:
            raise InputError(
                expected=f"{name} as one of {', '.join(known[name].choices)}",
                received=f"{value!r:.60}",
                remedy=f"the default is {known[name].default}",
            )
    parts = [_number(name, given.pop(name, 0.0)) for name in _POSE_PARTS]
    own = {entry.name: entry.default for entry in fields(NodeConfig)}
    mine = {k: _typed(own[k], v) for k, v in given.items() if k in own}
    amcl = {entry.name: entry.default for entry in fields(AmclConfig)}
    theirs = {k: _typed(amcl[k], v) for k, v in given.items() if k in amcl}
    return NodeConfig(amcl=AmclConfig(**theirs | {_POSE: SE2(*parts)}), **mine)


def _typed(default: Any, value: Any) -> Any:
    return type(default)(value) if isinstance(default, Enum) else value


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(
            expected=f"{name} as a number",
            received=f"{value!r:.60}",
            remedy="write metres and radians",
        )
    return float(value)


def _unknown(name: str, value: Any, known: Mapping[str, Parameter]) -> InputError:
    near = difflib.get_close_matches(name, known, 1)
    nearest = f"the nearest is {near[0]}" if near else "remove it"
    remedy = ros1_remedy(name, str(value)) or nearest
    return InputError(expected="parameters of firstfix", received=name, remedy=remedy)
