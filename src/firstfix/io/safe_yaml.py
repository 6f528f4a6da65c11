"""YAML from strangers: parsed to nodes under narrow limits, never turned into objects."""

from __future__ import annotations

import math
import re
from pathlib import Path

import yaml

from firstfix.core.errors import InputError
from firstfix.io.maps.files import show

# Parameters of a costmap's sensor under a namespace are eight levels deep; parsing is recursive.
_MAX_DEPTH = 16

_NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")
_TRUE, _FALSE = ("true", "yes", "on", "y"), ("false", "no", "off", "n")


class _FlatLoader(yaml.SafeLoader):
    """Refuses what no robot needs and an attacker does: aliases and deep nesting."""

    depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        event = self.peek_event()  # type: ignore[no-untyped-call]
        if getattr(event, "anchor", None) is not None:  # an alias has one, too
            raise yaml.YAMLError("anchors or aliases")
        if self.depth >= _MAX_DEPTH:
            raise yaml.YAMLError("deep nesting")
        self.depth += 1
        node: yaml.Node | None = super().compose_node(parent, index)
        self.depth -= 1
        return node


def parse_yaml(data: bytes, path: Path, *, example: str) -> yaml.MappingNode:
    """Parse a YAML mapping; nothing is constructed, whatever its tag.

    The time grows with the size, up to a second for 32 kB: bound the size before.

    Parameters
    ----------
    data : bytes
        What the file holds.
    path : Path
        The file, to be named in errors.
    example : str
        A line that such a file would have.

    Returns
    -------
    yaml.MappingNode
        Scalars keep their text.

    Raises
    ------
    InputError
        If it is no YAML mapping, has more than one document, uses aliases or nests deeply.
    """
    try:
        root = yaml.compose(data, Loader=_FlatLoader)
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # the last two: odd escapes
        raise InputError(
            expected=f"plain YAML in {path}",
            received=_reason(error),
            remedy=f"write lines like '{example}'",
        ) from error
    if not isinstance(root, yaml.MappingNode):
        raise InputError(
            expected=f"lines 'key: value' in {path}",
            received=kind(root),
            remedy=f"begin with a line like '{example}'",
        )
    return root


def entries(mapping: yaml.MappingNode, path: Path) -> dict[str, yaml.Node]:
    """List the entries of a mapping.

    Parameters
    ----------
    mapping : yaml.MappingNode
        From `parse_yaml`, or a value in one.
    path : Path
        The file, to be named in errors.

    Returns
    -------
    dict of str to yaml.Node
        In the order of the file.

    Raises
    ------
    InputError
        If a key is given twice.
    """
    found: dict[str, yaml.Node] = {}
    for key, value in mapping.value:
        name = str(key.value) if isinstance(key, yaml.ScalarNode) else kind(key)
        if name in found and isinstance(key, yaml.ScalarNode):  # readers differ in which counts
            raise InputError(
                expected=f"every key once in {path}",
                received=f"{show(name)} twice",
                remedy="delete one of the two lines",
            )
        found[name] = value
    return found


def kind(node: yaml.Node | None) -> str:
    """Say in words what stands at a place of a YAML."""
    if isinstance(node, yaml.SequenceNode):
        return "a list"
    if isinstance(node, yaml.MappingNode):
        return "a mapping"
    return "an empty file" if node is None else show(node.value)


def to_number(text: str) -> float:
    """Read a number as ROS does; NaN where the text is none, infinite where it is too large."""
    # PyYAML takes 1e-3 for a word and Python 1_0 for a number; ROS does neither.
    return float(text) if _NUMBER.fullmatch(text) else math.nan


def to_flag(text: str) -> bool | None:
    """Read a word for yes or no as ROS does; None where the text is neither."""
    word = text.lower()
    return word in _TRUE if word in _TRUE + _FALSE else None


def _reason(error: Exception) -> str:
    mark = getattr(error, "problem_mark", None)
    where = "" if mark is None else f" in line {mark.line + 1}"
    return show(getattr(error, "problem", None) or " ".join(str(error).split())) + where
