"""The parameters of one node in a ROS 2 parameter file, by their dotted names.

The forms are those of ROS 2: ``node: ros__parameters:``, below namespaces or with them in the name,
and wildcards (``/**``) for all nodes; also a file with nothing but the parameters.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError
from firstfix.io.atomic_files import read_bytes, show
from firstfix.io.safe_yaml import entries, kind, load_mapping

# Nav2's own file for all its nodes has 15 kB; parsing takes up to a second for 32 kB.
MAX_PARAMETER_BYTES = 131_072

_PARAMETERS = "ros__parameters"
_WILDCARDS = ("*", "**")

Parameters = dict[str, Any]


@dataclass(frozen=True, slots=True)
class _Section:
    """The content of one ``ros__parameters``, and the full name of its node."""

    name: str
    content: Any

    @property
    def node(self) -> str:
        return self.name.rpartition("/")[2]


def read_parameters(path: Path, node: str, known: frozenset[str]) -> Parameters:
    """Read the parameters of one node.

    Parameters
    ----------
    path : Path
        A YAML of at most `MAX_PARAMETER_BYTES`.
    node : str
        Name of the node, without namespace.
    known : frozenset of str
        Names of its parameters. A wildcard, or a file without sections, is for this node if it has
        one of them.

    Returns
    -------
    dict of str to object
        Values by dotted name. Unknown names are included, except those of a wildcard beside a
        section of the node's own. If both set a parameter, the later one counts, as in ROS.

    Raises
    ------
    InputError
        If the file cannot be used, or has no section for this node, or more than one.
    """
    data = read_bytes(path, what="a YAML file of parameters", limit=MAX_PARAMETER_BYTES)
    root = load_mapping(data, path, example=f"{node}:")
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


def _sections(mapping: dict[Any, Any], name: str, path: Path) -> Iterator[_Section]:
    for key, value in entries(mapping, path).items():
        if key == _PARAMETERS:
            yield _Section(name, value)
        elif isinstance(value, dict):
            yield from _sections(value, f"{name}/{key.strip('/')}", path)


def _section_parameters(section: _Section, path: Path) -> Parameters:
    if not isinstance(section.content, dict):
        raise InputError(
            expected=f"parameters below {_PARAMETERS} of {show(section.name)} in {path}",
            received=kind(section.content),
            remedy="write them as indented lines 'name: value'",
        )
    return _flat(section.content, path)


def _flat(mapping: dict[Any, Any], path: Path) -> Parameters:
    """Flatten nested mappings; the names get dots, as in ROS."""
    flat: Parameters = {}
    for key, value in entries(mapping, path).items():
        inner = _flat(value, path) if isinstance(value, dict) else None
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
    """Return whether these are parameters, not nodes with parameters."""
    first = {name.partition(".")[0] for name in known}
    return any(not isinstance(value, dict) or key in first for key, value in root.items())


def _not_one(
    path: Path, node: str, names: list[str], sections: list[_Section], root: dict[Any, Any]
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
