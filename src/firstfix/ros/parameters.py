"""The parameters of a node, flat as in ROS, generated from the dataclasses that hold them."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, fields
from enum import Enum
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.io.parameters.amcl_yaml import IGNORED, choices, read_values
from firstfix.io.parameters.ros1_amcl import ros1_remedy
from firstfix.io.ros_messages.incoming import to_frame
from firstfix.io.saved_pose import MAX_POSITION_M
from firstfix.localizer.config import LocalizerConfig
from firstfix.ros.node_config import NodeConfig

_POSE_PARTS = ("x", "y", "yaw")
_FRAMES = ("base_frame_id", "odom_frame_id", "global_frame_id", "laser_frame")
# The filter's parameters have no prefix: users know them by Nav2's names.
_NODE, _FILTER, _SCANS = "node", "amcl", "scans"
_NO_INJECTION = "a node recovers by searching the whole map for the scan, not by random particles"
# Parameters that have no effect in a node, and why.
_WITHOUT_EFFECT = {
    "recovery_alpha_slow": _NO_INJECTION,
    "recovery_alpha_fast": _NO_INJECTION,
    "locate.hypotheses": "a node keeps as many places as belief.places says",
}


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
        Its meaning and unit.
    least, most : float
        Range of a number.
    choices : tuple of str
        The words that a text may be; empty for any text.
    """

    name: str
    default: bool | int | float | str
    description: str
    least: float
    most: float
    choices: tuple[str, ...] = ()


def parameters() -> tuple[Parameter, ...]:
    """Return all parameters: the node's, the filter's, and those of each other algorithm."""
    listed: list[Parameter] = []
    for _, name, entry in _entries():
        text, default = entry.metadata["description"], entry.default
        limits = entry.metadata["least"], entry.metadata["most"]
        if isinstance(default, SE2):
            listed += [Parameter(f"{name}.{part}", 0.0, text, *limits) for part in _POSE_PARTS]
        elif isinstance(default, Enum):
            words = tuple(choice.value for choice in type(default))
            listed.append(Parameter(name, default.value, text, *limits, words))
        else:
            listed.append(Parameter(name, default, text, *limits))
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
    """Make the config of a node from parameters.

    Parameters
    ----------
    values : mapping of str to object
        By dotted names; a missing one keeps its default. Parameters that every ROS node has, such
        as ``use_sim_time``, are ignored.

    Returns
    -------
    NodeConfig
        The config.

    Raises
    ------
    InputError
        If a name is unknown, a value has the wrong type or is out of its range, or a parameter has
        no effect in a node.
    """
    for name, reason in _WITHOUT_EFFECT.items():
        default = defaults()[name]
        if values.get(name, default) != default:
            raise InputError(
                expected=f"{name} of {default}: {reason}",
                received=f"{values[name]!r:.60}",
                remedy="remove it",
            )
    return _config(values)


def _config(values: Mapping[str, Any]) -> NodeConfig:
    given = {
        name: _typed(name, value)
        for name, value in values.items()
        if name.partition(".")[0] not in IGNORED
    }
    sections: dict[str, dict[str, Any]] = {}
    for section, name, entry in _entries():
        own = sections.setdefault(section, {})
        if isinstance(entry.default, SE2):
            own[entry.name] = SE2(*(given.get(f"{name}.{part}", 0.0) for part in _POSE_PARTS))
        elif name in given:
            own[entry.name] = given[name]
    node = sections.pop(_NODE)
    algorithms = {name: owner(**sections[name]) for name, owner in _algorithms().items()}
    return NodeConfig(localizer=LocalizerConfig(**algorithms), **node)


def load_node_config(path: str | os.PathLike[str], section: str = "amcl") -> NodeConfig:
    """Read the parameters of one node from a ROS 2 parameter file, for use without a node.

    Parameters
    ----------
    path : path-like
        The YAML, such as ``nav2_params.yaml``.
    section : str, optional
        Name of the node in the file.

    Returns
    -------
    NodeConfig
        With the defaults for what the file does not set.

    Raises
    ------
    InputError
        If the file has no section for this node or more than one, a name is unknown, or a value
        cannot be used.
    """
    try:
        return _config(read_values(Path(path), section, defaults()))
    except InputError as error:
        if str(path) in error.expected:
            raise
        raise InputError(
            expected=f"{error.expected} in {path}", received=error.received, remedy=error.remedy
        ) from error


def defaults() -> dict[str, Any]:
    """Return the default of every parameter by its name, and of Nav2's ``initial_pose.z``."""
    known: dict[str, Any] = {}
    for _, name, entry in _entries():
        if isinstance(entry.default, SE2):
            known |= {f"{name}.{part}": 0.0 for part in (*_POSE_PARTS, "z")}
        else:
            known[name] = entry.default
    return known


def _algorithms() -> dict[str, Any]:
    """Return the config class of each algorithm by its name in `LocalizerConfig`."""
    return {entry.name: entry.default_factory for entry in fields(LocalizerConfig)}


def _entries() -> Iterator[tuple[str, str, Field[Any]]]:
    """Return each setting with its section and its flat name, in the order of the documents."""
    owners = {_NODE: NodeConfig, _FILTER: _algorithms()[_FILTER]} | _algorithms()
    for section, owner in owners.items():
        prefix = "" if section in (_NODE, _FILTER, _SCANS) else f"{section}."
        for entry in fields(owner):
            if "description" in entry.metadata:
                yield section, prefix + entry.name, entry


def _typed(name: str, value: Any) -> Any:
    """Return a value in the type of its setting; the dataclasses check its range."""
    known = defaults()
    if name not in known:
        raise _unknown(name, value, known)
    default = known[name]
    if isinstance(default, str):
        value = joined(value)
    if isinstance(default, Enum) and not isinstance(value, Enum):
        words = choices(default)
        if not isinstance(value, str) or value not in words:
            raise InputError(
                expected=f"{name} as one of {', '.join(words)}",
                received=f"{value!r:.60}",
                remedy=f"the default is {default.value}",
            )
        return words[value]
    is_number = type(value) in (int, float) and abs(value) <= MAX_POSITION_M
    if name.startswith("initial_pose.") and not is_number:
        raise InputError(
            expected=f"{name} as a number, up to {MAX_POSITION_M:g}",
            received=f"{value!r:.60}",
            remedy="write metres and radians",
        )
    return to_frame(value) if name in _FRAMES and isinstance(value, str) else value


def joined(value: Any) -> Any:
    """Return a list of words or numbers as one text, with spaces between; others as they are."""
    if isinstance(value, (list, tuple)) and all(isinstance(v, (str, int, float)) for v in value):
        return " ".join(str(part) for part in value)
    return value


def _unknown(name: str, value: Any, known: Mapping[str, Any]) -> InputError:
    near = difflib.get_close_matches(name, known, 1)
    remedy = ros1_remedy(name, str(value)) or (f"the nearest is {near[0]}" if near else "remove it")
    return InputError(expected="parameters of firstfix", received=name, remedy=remedy)
