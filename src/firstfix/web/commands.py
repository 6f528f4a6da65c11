"""What a viewer may ask for: one table that checks messages, and describes them to others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from firstfix.core.errors import InputError
from firstfix.web.strict_json import shown

# Farther than any building, and well within what cells can be counted by.
FARTHEST_M = 1e6


@dataclass(frozen=True, slots=True)
class Entry:
    """One entry of a message.

    Parameters
    ----------
    kind : type
        float, int or bool.
    description : str
        What it means.
    least, most : float
        Range of a number.
    """

    kind: type
    description: str
    least: float = -FARTHEST_M
    most: float = FARTHEST_M

    def schema(self) -> dict[str, Any]:
        """Describe it in JSON Schema."""
        if self.kind is bool:
            return {"type": "boolean", "description": self.description}
        return {
            "type": "integer" if self.kind is int else "number",
            "description": self.description,
            "minimum": self.least,
            "maximum": self.most,
        }

    def checked(self, name: str, value: Any) -> Any:
        """Return a value as it shall be.

        Raises
        ------
        InputError
            If it cannot be meant.
        """
        if self.kind is bool:
            if isinstance(value, bool):
                return value
        elif isinstance(value, int | float) and not isinstance(value, bool):
            whole = self.kind is not int or value == int(value) if _is_finite(value) else False
            if whole and self.least <= value <= self.most:
                return self.kind(value)
        words = {bool: "true or false", int: "a whole number", float: "a number"}[self.kind]
        limits = "" if self.kind is bool else f" from {self.least:g} to {self.most:g}"
        raise InputError(
            expected=f"{name} as {words}{limits}",
            received=shown(value),
            remedy=f"{name} is {self.description}",
        )


_X = Entry(float, "x in the map frame, m")
_Y = Entry(float, "y in the map frame, m")
_YAW = Entry(float, "the heading, rad, counter-clockwise from +x")

POSE = {"x": _X, "y": _Y, "yaw": _YAW}

COMMANDS: dict[str, dict[str, Entry]] = {
    "pose": POSE,
    "pick": {"index": Entry(int, "which of the hypotheses of the last state, from 0", 0, 1000)},
    "relocalize": {},
    "pause": {"paused": Entry(bool, "whether the clock of the simulated robot stands still")},
    "goal": {"x": _X, "y": _Y},
    "carry": POSE,
    "people": {"count": Entry(int, "how many people walk around the robot", 0, 30)},
}


@dataclass(frozen=True, slots=True)
class Command:
    """A checked message.

    Parameters
    ----------
    kind : str
        A key of `COMMANDS`.
    given : dict
        Its entries, all of them.
    """

    kind: str
    given: dict[str, Any]


def decode_command(message: Any) -> Command:
    """Check a message of a viewer.

    Parameters
    ----------
    message : object
        What its JSON says.

    Returns
    -------
    Command
        What it asks for.

    Raises
    ------
    InputError
        If it says nothing that is known, or not all that is needed.
    """
    kind = message.get("type") if isinstance(message, Mapping) else None
    if not isinstance(kind, str) or kind not in COMMANDS:
        raise InputError(
            expected=f"an object whose type is one of {', '.join(COMMANDS)}",
            received=shown(message),
            remedy="see docs/live.md",
        )
    return Command(kind, checked(COMMANDS[kind], message))


def checked(entries: Mapping[str, Entry], message: Any) -> dict[str, Any]:
    """Check the entries of a message.

    Parameters
    ----------
    entries : mapping of str to Entry
        What must be there; whatever else is there is passed over.
    message : object
        What its JSON says.

    Returns
    -------
    dict
        Each entry, of its kind.

    Raises
    ------
    InputError
        If one is missing or cannot be meant.
    """
    if not isinstance(message, Mapping):
        raise InputError(
            expected="a JSON object", received=shown(message), remedy="see docs/live.md"
        )
    for name in entries:
        if name not in message:
            raise InputError(
                expected=f"{name}: {entries[name].description}",
                received="a message without it",
                remedy="see docs/live.md",
            )
    return {name: entry.checked(name, message[name]) for name, entry in entries.items()}


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False
