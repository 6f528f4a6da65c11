"""Arguments of public functions: unambiguous values are converted, all others are refused."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum
from typing import Any, TypeVar

import numpy as np

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2

T = TypeVar("T")
Member = TypeVar("Member", bound=Enum)

# What to pass instead, for the mistakes that people make; by the name of the expected type.
_REMEDIES = {
    "LaserScan": "pass a LaserScan: "
    "ff.LaserScan(ranges, angle_min, angle_increment, range_min, range_max)",
    "OccupancyGrid": "load the map first: ff.load_map('map.yaml')",
}


def as_member(kind: type[Member], value: object, name: str) -> Member:
    """Return a member of an enum from the member, its value or its name.

    Parameters
    ----------
    kind : type of Enum
        The enum.
    value : Enum or str
        A member, or a string: its value or its name, in upper or lower case.
    name : str
        Name of the argument, for the message.

    Raises
    ------
    InputError
        If the string names no member, or the value is no string.
    """
    if isinstance(value, kind):
        return value
    if isinstance(value, str):
        for member in kind:
            if value.lower() in (str(member.value).lower(), member.name.lower()):
                return member
    raise InputError(
        expected=f"{name} as one of {', '.join(choices(kind))}",
        received=f"{value!r:.60}",
        remedy="pass one of these",
    )


def choices(kind: type[Enum]) -> list[str]:
    """Return the strings that `as_member` accepts and a message lists: values, else names."""
    return [
        member.value if isinstance(member.value, str) else member.name.lower() for member in kind
    ]


def as_pose(value: object, name: str) -> SE2:
    """Return a pose from an SE2 or from three numbers: x (m), y (m), yaw (rad).

    Parameters
    ----------
    value : SE2, sequence of three numbers, or ndarray of shape (3,)
        The pose.
    name : str
        Name of the argument, for the message.

    Raises
    ------
    InputError
        If the value is neither.
    """
    if isinstance(value, SE2):
        return value
    if (
        isinstance(value, (Sequence, np.ndarray))
        and not isinstance(value, (str, bytes))
        and len(value) == 3
    ):
        numbers = [_number(part) for part in value]
        if all(map(math.isfinite, numbers)):
            return SE2(*numbers)
    raise InputError(
        expected=f"{name} as a pose",
        received=f"{value!r:.60}",
        remedy="pass an SE2, or (x, y, yaw) in metres and radians",
    )


def as_instance(kind: type[T], value: Any, name: str) -> T:
    """Return a value of a type; refuse any other, and say what to pass instead.

    Parameters
    ----------
    kind : type
        The type.
    value : object
        The argument.
    name : str
        Name of the argument, for the message.

    Raises
    ------
    InputError
        If the value is not of this type.
    """
    if isinstance(value, kind):
        return value
    what = "an" if kind.__name__[0] in "AEIOaeio" else "a"
    raise InputError(
        expected=f"{name} as {what} {kind.__name__}",
        received=f"{value!r:.60}" if isinstance(value, str) else type(value).__name__,
        remedy=_REMEDIES.get(kind.__name__, f"pass a value of type {kind.__name__}"),
    )


def _number(value: Any) -> float:
    """Return a float, NaN for what is no number."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan
