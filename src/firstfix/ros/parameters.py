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
from firstfix.io.parameters.amcl_yaml import DEFAULTS, IGNORED, amcl_config, choices
from firstfix.io.parameters.ros1_amcl import ros1_remedy
from firstfix.io.ros_messages.incoming import to_frame
from firstfix.io.saved_pose import MAX_POSITION_M
from firstfix.ros.node_config import NodeConfig

_OWN = {entry.name: entry.default for entry in fields(NodeConfig) if entry.name != "amcl"}
_KNOWN = _OWN | DEFAULTS
_FRAMES = ("base_frame_id", "odom_frame_id", "global_frame_id")


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
                parts = (f"{entry.name}.{part}" for part in ("x", "y", "yaw"))
                listed += [Parameter(name, 0.0, text, *limits) for name in parts]
            elif isinstance(default, Enum):
                named = tuple(choice.value for choice in type(default))
                listed.append(Parameter(entry.name, default.value, text, *limits, named))
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
    own: dict[str, Any] = {}
    amcl: dict[str, Any] = {}
    for name, value in values.items():
        if name.partition(".")[0] not in IGNORED:
            (own if name in _OWN else amcl)[name] = _typed(name, value)
    return NodeConfig(amcl=amcl_config(amcl), **own)


def _typed(name: str, value: Any) -> Any:
    """Return a value as the settings have it; ranges are checked there."""
    if name not in _KNOWN:
        near = difflib.get_close_matches(name, _KNOWN, 1)
        remedy = ros1_remedy(name, str(value)) or (
            f"the nearest is {near[0]}" if near else "remove it"
        )
        raise InputError(expected="parameters of firstfix", received=name, remedy=remedy)
    default = _KNOWN[name]
    if isinstance(default, Enum):
        listed = choices(default)
        if not isinstance(value, str) or value not in listed:
            raise InputError(
                expected=f"{name} as one of {', '.join(listed)}",
                received=f"{value!r:.60}",
                remedy=f"the default is {default.value}",
            )
        return listed[value]
    is_number = type(value) in (int, float) and abs(value) <= MAX_POSITION_M
    if name.startswith("initial_pose.") and not is_number:
        raise InputError(
            expected=f"{name} as a number, up to {MAX_POSITION_M:g}",
            received=f"{value!r:.60}",
            remedy="write metres and radians",
        )
    return to_frame(value) if name in _FRAMES and isinstance(value, str) else value
