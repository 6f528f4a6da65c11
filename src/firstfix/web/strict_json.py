"""JSON that nobody vouches for."""

from __future__ import annotations

import json
import reprlib
from typing import Any, NoReturn

from firstfix.core.errors import InputError

# Whole numbers up to so many digits are exact as floats too; longer ones take ever longer to read.
_DIGITS = 15


class NotJsonError(InputError):
    """What came is not JSON at all."""


def parsed(text: str | bytes) -> Any:
    """Parse JSON.

    Parameters
    ----------
    text : str or bytes
        One value.

    Returns
    -------
    object
        The value; no NaN in it.

    Raises
    ------
    NotJsonError
        If it is none, or nested too deeply.
    """
    try:
        return json.loads(text, parse_int=_whole, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise NotJsonError(
            expected="JSON as RFC 8259 has it", received=shown(text[:40]), remedy="see docs/live.md"
        ) from error


def shown(value: Any) -> str:
    """Write a value for an error, in a few characters however large it is."""
    return reprlib.repr(value)[:60]


def _whole(digits: str) -> float:
    return int(digits) if len(digits) <= _DIGITS else float(digits)


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not JSON")
