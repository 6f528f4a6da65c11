"""Angles in radians; the only file that knows 2π."""

from __future__ import annotations

import math
from typing import overload

import numpy as np
from numpy.typing import NDArray

FULL_TURN = 2.0 * math.pi


@overload
def wrap(angle: float) -> float: ...
@overload
def wrap(angle: NDArray[np.float64]) -> NDArray[np.float64]: ...
def wrap(angle: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
    """Bring an angle into (-π, π].

    Parameters
    ----------
    angle : float or ndarray
        Any finite angle, rad.

    Returns
    -------
    float or ndarray
        The same direction in (-π, π]; an array stays an array.
    """
    # The mirrored interval is closed at +π, as in REP 103. A tiny negative remainder rounds up to a
    # full turn and would leave exactly -π.
    if isinstance(angle, np.ndarray):
        turned = math.pi - np.remainder(math.pi - angle.astype(np.float64), FULL_TURN)
        return np.where(turned <= -math.pi, math.pi, turned)
    # Every SE2 is wrapped; with plain numbers this takes a tenth of the time.
    turn = math.pi - (math.pi - float(angle)) % FULL_TURN
    return math.pi if turn <= -math.pi else turn


@overload
def angle_error(a: float, b: float) -> float: ...
@overload
def angle_error(a: NDArray[np.float64], b: float | NDArray[np.float64]) -> NDArray[np.float64]: ...
def angle_error(
    a: float | NDArray[np.float64], b: float | NDArray[np.float64]
) -> float | NDArray[np.float64]:
    """Angle between two directions, never negative.

    Parameters
    ----------
    a, b : float or ndarray
        Directions, rad.

    Returns
    -------
    float or ndarray
        The smaller angle between them, rad, in [0, π].
    """
    error = np.abs(wrap(np.asarray(a, np.float64) - np.asarray(b, np.float64)))
    return error if isinstance(a, np.ndarray) or isinstance(b, np.ndarray) else float(error)
