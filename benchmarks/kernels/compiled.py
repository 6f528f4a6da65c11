"""Compile reference loops and counts, under the types that they are written with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Loop = TypeVar("Loop", bound=Callable[..., Any])


def compiled(function: Loop) -> Loop:
    """Compile a function at its first call; not cached: a stale limit would judge for ever."""
    return cast("Loop", njit(function))
