"""YAML files from other people: `yaml.SafeLoader` with limits."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Any

import yaml

from firstfix.core.errors import InputError
from firstfix.io.atomic_files import show

# Parameters of a costmap's sensor under a namespace are eight levels deep; parsing is recursive.
_MAX_DEPTH = 16


class Repeated:
    """Value of a key that a mapping gives more than once; parsers differ in which one counts."""


class _Loader(yaml.SafeLoader):
    """Rejects anchors, aliases and deep nesting, which can fill the memory or the stack."""

    depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        event = self.peek_event()  # type: ignore[no-untyped-call]
        if getattr(event, "anchor", None) is not None:  # aliases have one, too
            raise yaml.YAMLError("anchors or aliases")
        if self.depth >= _MAX_DEPTH:
            raise yaml.YAMLError("deep nesting")
        self.depth += 1
        node: yaml.Node | None = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:  # noqa: FBT001, FBT002 - PyYAML's signature
        mapping = super().construct_mapping(node, deep=deep)
        if len(mapping) < len(node.value):
            keys = Counter(self.construct_object(key, deep=True) for key, _ in node.value)
            mapping |= {key: Repeated() for key, count in keys.items() if count > 1}
        return mapping


# YAML 1.2 and ROS read 1e-3 and -.5 as numbers; PyYAML follows YAML 1.1, where they are text.
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?([0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))([eE][-+]?[0-9]+)?$"),
    list("-+.0123456789"),
)


def load_yaml(data: bytes | str, path: Path, *, example: str) -> Any:
    """Load one YAML document; it takes up to a second for 32 kB, so limit the size first.

    Parameters
    ----------
    data : bytes or str
        Content of the file.
    path : Path
        The file, for error messages.
    example : str
        A line that such a file may have, for error messages.

    Returns
    -------
    None, bool, int, float, str, date, list or dict
        The document.

    Raises
    ------
    InputError
        If it is not YAML, has more than one document, uses aliases or custom tags, or is nested
        deeply.
    """
    try:
        return yaml.load(data, _Loader)  # noqa: S506 - a SafeLoader
    except (yaml.YAMLError, ValueError, OverflowError, AttributeError) as error:
        # The last three: odd escapes, dates and numbers.
        raise InputError(
            expected=f"plain YAML in {path}",
            received=_reason(error),
            remedy=f"write lines like '{example}'",
        ) from error


def load_mapping(data: bytes, path: Path, *, example: str) -> dict[Any, Any]:
    """Load a YAML document like `load_yaml`, which must be a mapping."""
    document = load_yaml(data, path, example=example)
    if not isinstance(document, dict):
        raise InputError(
            expected=f"lines 'key: value' in {path}",
            received="an empty file" if document is None else kind(document),
            remedy=f"start with a line like '{example}'",
        )
    return document


def entries(mapping: dict[Any, Any], path: Path) -> dict[str, Any]:
    """Return a mapping with its keys as text.

    Raises
    ------
    InputError
        If a key occurs more than once.
    """
    for key, value in mapping.items():
        if isinstance(value, Repeated):
            raise InputError(
                expected=f"every key once in {path}",
                received=f"{show(str(key))} twice",
                remedy="delete one of the two lines",
            )
    return {str(key): value for key, value in mapping.items()}


def kind(value: Any) -> str:
    """Describe a value for people."""
    if isinstance(value, list):
        return "a list"
    if isinstance(value, dict):
        return "a mapping"
    return "nothing" if value is None else show(value)


def _reason(error: Exception) -> str:
    mark = getattr(error, "problem_mark", None)
    where = "" if mark is None else f" in line {mark.line + 1}"
    return show(getattr(error, "problem", None) or " ".join(str(error).split())) + where
