"""The parameters of one node in a ROS 2 parameter file, by their dotted names.

The forms that ROS 2 reads: ``node: ros__parameters:``, below namespaces or with them in the name,
and wildcards (``/**``) that stand for all nodes. Nothing but the parameters is read, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml

from firstfix.core.errors import InputError
from firstfix.io.atomic_files import read_bytes
from firstfix.io.maps.files import show
from firstfix.io.safe_yaml import entries, kind, parse_yaml

# Nav2's own file for all its nodes has 15 kB; parsing takes up to a second for 32 kB.
MAX_PARAMETER_BYTES = 131_072

_PARAMETERS = "ros__parameters"
_WILDCARDS = ("*", "**")

Parameters = dict[str, yaml.Node]


@dataclass(frozen=True, slots=True)
class _Section:
    """What stands under one ``ros__parameters``, and the full name of the node it is for."""

    name: str
    content: yaml.Node

    @property
    def node(self) -> str:
        return self.name.rpartition("/")[2]


def read_parameters(path: Path, node: str, known: frozenset[str]) -> Parameters:
    """Read what a parameter file says to one node.

    Parameters
    ----------
    path : Path
        A YAML of at most `MAX_PARAMETER_BYTES`.
    node : str
        Name of the node, without namespace.
    known : frozenset of str
        Names of its parameters. By them a wildcard, and a file without sections, are recognised
        as meant for this node.

    Returns
    -------
    dict of str to yaml.Node
        Scalars and lists by dotted name. Unknown names are among them, but not those of a wildcard
        beside a section of the node's own. Where both give a parameter, the later one counts, as
        in ROS.

    Raises
    ------
    InputError
        If the file is none, or has no section for this node, or more than one.
    """
    data = read_bytes(path, what="a YAML file of parameters", limit=MAX_PARAMETER_BYTES)
    root = parse_yaml(data, path, example=f"{node}:")
    sections = list(_sections(root, "", path))
    if not sections and _is_plain(entries(root, path), known):
        return _flat(root, path)
    own = [section for section in sections if section.node == node]
    shared = {
        section.name: parameters
        for section in sections
        if section.node in _WILDCARDS
        and not known.isdisjoint(parameters := _section_parameters(section, path))
    }
    names = [section.name for section in own] or list(shared)
    if len(names) != 1:
        raise _not_one(path, node, names, sections, root)
    if not own:
        return shared[names[0]]
    merged: Parameters = {}
    for section in sections:
        if section.name == names[0]:
            merged |= _section_parameters(section, path)
        elif section.name in shared:
            merged |= {k: v for k, v in shared[section.name].items() if k in known}
    return merged


def _sections(mapping: yaml.MappingNode, name: str, path: Path) -> Iterator[_Section]:
    for key, value in entries(mapping, path).items():
        if key == _PARAMETERS:
            yield _Section(name, value)
        elif isinstance(value, yaml.MappingNode):
            yield from _sections(value, f"{name}/{key.strip('/')}", path)


def _section_parameters(section: _Section, path: Path) -> Parameters:
    if not isinstance(section.content, yaml.MappingNode):
        raise InputError(
            expected=f"parameters below {_PARAMETERS} of {show(section.name)} in {path}",
            received=kind(section.content),
            remedy="write them as indented lines 'name: value'",
        )
    return _flat(section.content, path)


def _flat(mapping: yaml.MappingNode, path: Path) -> Parameters:
    """Name the scalars and lists of nested mappings as ROS does, with dots."""
    flat: Parameters = {}
    for key, value in entries(mapping, path).items():
        inner = _flat(value, path) if isinstance(value, yaml.MappingNode) else None
        named = {key: value} if inner is None else {f"{key}.{k}": v for k, v in inner.items()}
        if twice := flat.keys() & named:
            raise InputError(
                expected=f"every parameter once in {path}",
                received=f"{show(min(twice))} nested and with a dot",
                remedy="delete one of the two",
            )
        flat |= named
    return flat


def _is_plain(root: Parameters, known: frozenset[str]) -> bool:
    """Tell whether these are parameters themselves rather than nodes that have some."""
    first = {name.partition(".")[0] for name in known}
    return any(
        not isinstance(value, yaml.MappingNode) or key in first for key, value in root.items()
    )


def _not_one(
    path: Path, node: str, names: list[str], sections: list[_Section], root: yaml.MappingNode
) -> InputError:
    if names:
        return InputError(
            expected=f"one section for {node} in {path}",
            received=show(" and ".join(names)),
            remedy="keep the one of this robot",
        )
    found = ", ".join(section.name for section in sections)
    remedy = f"write the parameters below '{node}:' and '{_PARAMETERS}:'"
    if not sections:
        found = ", ".join(entries(root, path))
        remedy = f"put a line '{_PARAMETERS}:' between '{node}:' and the parameters"
    return InputError(
        expected=f"a section {node} with {_PARAMETERS} in {path}",
        received=f"only {show(found)}" if found else "none",
        remedy=remedy,
    )
