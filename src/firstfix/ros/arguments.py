"""Arguments of ROS 2: remappings, parameters, parameter files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError
from firstfix.io.parameters.amcl_yaml import read_values
from firstfix.io.parameters.ros_parameters import read_parameters
from firstfix.io.safe_yaml import kind, load_mapping
from firstfix.ros.names import Names
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.parameters import configured, defaults, joined, parameters

_NODE, _NAMESPACE = ("__node", "__name"), "__ns"


def names_from(rules: Iterable[str], node: str, namespace: str) -> Names:
    """Read remapping rules.

    Parameters
    ----------
    rules : iterable of str
        ``scan:=base_scan``, ``__ns:=/robot1``, ``__node:=finder``, and ``node:scan:=base_scan``
        for the node of that name only.
    node, namespace : str
        Used unless a rule sets them; the leading slash of the namespace may be missing.

    Returns
    -------
    Names
        Name, namespace and remappings of the node.

    Raises
    ------
    InputError
        If a rule or a name is invalid.
    """
    pairs = [_split(rule, "scan:=base_scan") for rule in rules]
    for old, new in pairs:
        node = new if old in _NODE else node
        namespace = new if old == _NAMESPACE else namespace
    special = (*_NODE, _NAMESPACE)
    given = [(*old.rpartition(":"), new) for old, new in pairs if old not in special]
    kept = tuple((old, new) for owner, _, old, new in given if owner in ("", node))
    return Names(node, "/" + namespace.strip("/"), kept)


def settings_from(
    *,
    node: str,
    amcl_file: Path | None,
    files: Iterable[Path],
    assignments: Iterable[str],
    options: Mapping[str, Any],
) -> NodeConfig:
    """Read the parameters of a node; each source overrides those before it in this list.

    Parameters
    ----------
    node : str
        Name of the node, for its sections of files.
    amcl_file : Path or None
        Parameters of Nav2's AMCL, in a section ``amcl``.
    files : iterable of Path
        Parameters of the node, in a section of its own or in one for all nodes.
    assignments : iterable of str
        ``mode:=full``.
    options : mapping of str to object
        Parameters by name; None is ignored.

    Returns
    -------
    NodeConfig
        The settings.

    Raises
    ------
    InputError
        If a file cannot be used, a name is unknown, or a value does not fit.
    """
    values: dict[str, Any] = {}
    if amcl_file is not None:
        values |= read_values(amcl_file, "amcl", defaults())
    known = frozenset(parameter.name for parameter in parameters())
    for file in files:
        found = read_parameters(file, node, known)
        values |= {name: _scalar(name, value) for name, value in found.items()}
    for assignment in assignments:
        name, text = _split(assignment, "mode:=full")
        line = load_mapping(f"value: {text}".encode(), Path(name), example=assignment)
        values[name] = _scalar(name, line["value"])
    return configured(values | {k: v for k, v in options.items() if v is not None})


def _split(rule: str, example: str) -> tuple[str, str]:
    left, sign, right = rule.partition(":=")
    if not sign or not left or not right:
        raise InputError(
            expected="an argument like " + example,
            received=f"{rule!r:.60}",
            remedy="write name:=value",
        )
    return left, right


def _scalar(name: str, value: Any) -> bool | int | float | str:
    if isinstance(defaults().get(name), str):
        value = joined(value)
    if isinstance(value, (bool, int, float, str)):
        return value
    raise InputError(
        expected=f"one value for {name}", received=kind(value), remedy="write a number or a word"
    )
