"""Decoding JSON of clients into the structs that declare it."""

from __future__ import annotations

from typing import Any

import msgspec

from firstfix.core.errors import InputError

_LONGEST = 200
# The names that JSON and people use for what msgspec names after Python.
_WORDS = {
    "`float | null`": "a number or null",
    "`float`": "a number",
    "`int`": "a whole number",
    "`bool`": "true or false",
    "`str | null`": "text or null",
    "`str`": "text",
    "`null`": "null",
    "`array`": "a list",
    "`object`": "an object",
}


class NotJsonError(InputError):
    """The text is not JSON."""


def decode(text: str | bytes, kind: Any) -> Any:
    """Decode JSON, strictly: no NaN, no type conversion.

    Parameters
    ----------
    text : str or bytes
        One JSON value.
    kind : type
        The struct that declares it, or a union of tagged structs.

    Returns
    -------
    struct
        Of that kind.

    Raises
    ------
    NotJsonError
        If the text is not JSON, or nested too deeply.
    InputError
        If it is JSON but not of this kind.
    """
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.ValidationError as error:
        raise InputError(_sentence(error)) from error
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise NotJsonError(f"The text is not valid JSON: {error}."[:_LONGEST]) from error


def _sentence(error: msgspec.ValidationError) -> str:
    """Write an error of msgspec, such as "Expected `float`, got `str` - at `$.x`", for people."""
    problem, _, path = f"{error}".partition(" - at ")
    for name, words in _WORDS.items():
        problem = problem.replace(name, words)
    field = path.strip("`").removeprefix("$.")
    return f"{field}: {problem}."[:_LONGEST] if field else f"{problem}."[:_LONGEST]
