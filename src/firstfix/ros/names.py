"""Names of ROS 2: relative to a namespace, private to a node, remapped by rules."""

from __future__ import annotations

import re
from dataclasses import dataclass

from firstfix.core.errors import InputError

_TOKEN = "[A-Za-z_][A-Za-z0-9_]*"  # noqa: S105 - a name of ROS
_NAME = re.compile(rf"(~|(~/|/)?{_TOKEN}(/{_TOKEN})*)")
_NAMESPACE = re.compile(rf"(/|(/{_TOKEN})+)")


@dataclass(frozen=True, slots=True)
class Names:
    """Name, namespace and remappings of a node.

    Parameters
    ----------
    node : str
        Its name.
    namespace : str
        With a leading slash.
    rules : tuple of tuple of str
        Remappings; the first that matches is used.

    Raises
    ------
    InputError
        If a name is invalid.
    """

    node: str = "firstfix"
    namespace: str = "/"
    rules: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        _check(re.compile(_TOKEN), self.node, "the name of a node", "firstfix")
        _check(_NAMESPACE, self.namespace, "a namespace", "/robot1")
        for name in (name for rule in self.rules for name in rule):
            _check(_NAME, name, "the name of a topic", "front/scan")

    def resolve(self, name: str) -> str:
        """Return the full name of a topic.

        Parameters
        ----------
        name : str
            Full (``/tf``), relative (``scan``) or private (``~/scan``).

        Returns
        -------
        str
            With a leading slash, after the rules.
        """
        _check(_NAME, name, "the name of a topic", "front/scan")
        full = self._expand(name)
        for old, new in self.rules:
            if self._expand(old) == full:
                return self._expand(new)
        return full

    def _expand(self, name: str) -> str:
        if name.startswith("/"):
            return name
        above = self.namespace.rstrip("/")
        if name.startswith("~"):
            return f"{above}/{self.node}{name[1:]}"
        return f"{above}/{name}"


def _check(form: re.Pattern[str], name: str, expected: str, example: str) -> None:
    if not form.fullmatch(name):
        raise InputError(
            expected=f"{expected}: letters, digits and underscores between slashes",
            received=f"{name!r:.60}",
            remedy=f"write it like {example}",
        )
