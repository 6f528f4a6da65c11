"""Options that do not fit together are refused, with a remedy."""

from __future__ import annotations

from collections.abc import Mapping

from firstfix.core.errors import InputError


def refuse_options(measure: str, options: Mapping[str, object]) -> None:
    """Refuse options that were given although they are not about what is measured.

    Parameters
    ----------
    measure : str
        What is measured, as the option that asks for it, such as ``--track``.
    options : mapping
        Names of options that are about something else, with what was given for them.

    Raises
    ------
    InputError
        If anything was given for one of them.
    """
    wrong = [name for name, value in options.items() if value]
    if wrong:
        raise InputError(
            expected=f"{measure} without options of other benchmarks",
            received=f"{measure} with {', '.join(wrong)}",
            remedy="leave it out: it is not about this",
        )
