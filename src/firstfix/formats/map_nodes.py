"""YAML from strangers: parsed to nodes under narrow limits, never turned into objects."""

from __future__ import annotations

from pathlib import Path

import yaml

from firstfix.core.errors import MapError
from firstfix.formats.map_files import read_yaml_bytes, show

_MAX_DEPTH = 8


class _FlatLoader(yaml.SafeLoader):
    """Refuses what no map needs and an attacker does: aliases and deep nesting."""

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


def read_nodes(path: Path) -> dict[str, yaml.Node]:
    """Read the top-level entries of a YAML; nothing is constructed, whatever its tag.

    Parameters
    ----------
    path : Path
        A regular file.

    Returns
    -------
    dict of str to yaml.Node
        In the order of the file; scalars keep their text.

    Raises
    ------
    MapError
        If it cannot be read, is no YAML mapping, uses aliases, or gives a key twice.
    """
    data = read_yaml_bytes(path)
    try:
        root = yaml.compose(data, Loader=_FlatLoader)
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # the last two: odd escapes
        raise MapError(
            expected=f"plain YAML in {path}",
            received=_reason(error),
            remedy="write lines like 'resolution: 0.05'",
        ) from error
    if not isinstance(root, yaml.MappingNode):
        raise MapError(
            expected=f"lines 'key: value' in {path}",
            received=kind(root),
            remedy="begin with a line like 'image: map.pgm'",
        )
    entries: dict[str, yaml.Node] = {}
    for key, value in root.value:
        name = str(key.value) if isinstance(key, yaml.ScalarNode) else kind(key)
        if name in entries and isinstance(key, yaml.ScalarNode):  # readers differ in which counts
            raise MapError(
                expected=f"every key once in {path}",
                received=f"{show(name)} twice",
                remedy="delete one of the two lines",
            )
        entries[name] = value
    return entries


def _reason(error: Exception) -> str:
    mark = getattr(error, "problem_mark", None)
    where = "" if mark is None else f" in line {mark.line + 1}"
    return show(getattr(error, "problem", None) or " ".join(str(error).split())) + where


def kind(node: yaml.Node | None) -> str:
    """Say in words what stands at a place of a YAML."""
    if isinstance(node, yaml.SequenceNode):
        return "a list"
    if isinstance(node, yaml.MappingNode):
        return "a mapping"
    return "an empty file" if node is None else show(node.value)
