"""A kernel under measurement: what it works on, what it must move and compute, what binds it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from limits import Limit

Roof = tuple[tuple[Limit, float], ...]
"""Limits that work one after the other, each with how much of it a unit of work needs."""


@dataclass(frozen=True, eq=False)
class Kernel:
    """One kernel of firstfix on data as it meets them.

    Parameters
    ----------
    function : dispatcher
        The kernel.
    parts : tuple of dispatcher
        Kernels that it is made of and that no other line of the table measures.
    unit : str
        What its time is counted by.
    units : float
        How many a call has.
    call : callable
        Runs it once.
    working_set : float
        Bytes it goes over again and again, which decide the cache it works from.
    moved : float
        Bytes a unit must read and write.
    operations : float
        Arithmetic operations of a unit.
    roofs : mapping of str to Roof
        What could hold it back; the slowest binds.
    """

    function: Any
    parts: tuple[Any, ...]
    unit: str
    units: float
    call: Callable[[], object]
    working_set: float
    moved: float
    operations: float
    roofs: Mapping[str, Roof]

    @property
    def name(self) -> str:
        """Module and function, without the package."""
        return name_of(self.function)


def name_of(function: Any) -> str:
    """Return module and function of a dispatcher, without the package."""
    module = str(function.py_func.__module__).removeprefix("firstfix.")
    return f"{module}.{function.py_func.__name__}"
