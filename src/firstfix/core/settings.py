"""Settings: dataclass fields with a description and a range."""

from __future__ import annotations

import math
from dataclasses import field, fields
from enum import Enum
from typing import Any

from firstfix.core.arguments import as_member, as_pose
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2

# Beyond this, floats do not represent all whole numbers.
_WHOLE_LIMIT = 2.0**53


def setting(default: Any, text: str, least: float = -math.inf, most: float = math.inf) -> Any:
    """Declare a field of a frozen dataclass.

    Parameters
    ----------
    default : bool, int, float, str, Enum or another frozen value
        The default. The setting has the same type.
    text : str
        Description, with the unit.
    least, most : float
        Range of a number, both ends included.

    Returns
    -------
    Field
        With description, least and most in its metadata.
    """
    metadata = {"description": text, "least": least, "most": most}
    return field(default=default, metadata=metadata)


def check_settings(config: Any) -> None:
    """Check the settings of a dataclass in its ``__post_init__``, and convert their types.

    Whole numbers become floats, strings become enum members, and three numbers become poses.

    Parameters
    ----------
    config : dataclass
        Fields that `setting` declared are checked, others are not.

    Raises
    ------
    InputError
        If a setting has the wrong type or is out of its range.
    """
    for entry in fields(config):
        if "description" in entry.metadata:
            given = getattr(config, entry.name)
            value = _checked(entry.name, given, entry.default, dict(entry.metadata))
            object.__setattr__(config, entry.name, value)


def _checked(name: str, value: object, default: object, metadata: dict[str, Any]) -> object:
    """Return a value in the type of the default; raise InputError if it has another or no range."""
    least, most = metadata["least"], metadata["most"]
    if isinstance(default, float) and type(value) is int and abs(value) < _WHOLE_LIMIT:
        value = float(value)
    if isinstance(default, Enum):
        return as_member(type(default), value, name)
    if isinstance(default, SE2):
        return as_pose(value, name)
    fits = type(value) is type(default) and (value != "" or default == "")
    if fits and isinstance(value, (int, float)):
        # False for NaN and infinity.
        fits = bool(max(least, -_WHOLE_LIMIT) <= value <= min(most, _WHOLE_LIMIT))
    if fits:
        return value
    limits = "" if least == -math.inf else f" of at least {least:g}"
    limits += "" if most == math.inf else f" and at most {most:g}"
    raise InputError(
        expected=f"{name} ({metadata['description']}) as {_kind(default)}{limits}",
        received=f"{value!r:.60}",
        remedy=f"the default is {default}",
    )


def _kind(default: object) -> str:
    names = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
    return names[type(default)]
