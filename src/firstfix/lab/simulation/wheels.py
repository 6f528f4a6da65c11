"""What the encoders of two wheels make of a motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2

SLIP_M = 0.05
"""Longest slip of a wheel, m."""


@dataclass(frozen=True, slots=True)
class WheelErrors:
    """Errors of the wheels; the defaults are those of a small robot on an office floor.

    The shared error scales the length of a path. The individual errors make the robot drift to a
    side (0.2 % each give about 0.7° a metre).

    Parameters
    ----------
    sigma_scale : float
        Standard deviation of the scale error that both share, drawn once a robot.
    sigma_uneven : float
        Standard deviation of the scale error of each alone, drawn once a robot.
    sigma_step : float
        Standard deviation of the noise of a wheel after 1 m, m; it grows with the root of the
        length.
    slips_per_m : float
        How often a wheel turns up to `SLIP_M` without moving the robot, 1/m.

    Raises
    ------
    InputError
        If one of them is negative.
    """

    sigma_scale: float = 0.01
    sigma_uneven: float = 0.002
    sigma_step: float = 0.003
    slips_per_m: float = 0.0

    def __post_init__(self) -> None:
        for name in ("sigma_scale", "sigma_uneven", "sigma_step", "slips_per_m"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise InputError(
                    expected=f"{name} to be at least 0",
                    received=f"{value}",
                    remedy=f"choose another {name} for the simulated wheels",
                )


EXACT_WHEELS = WheelErrors(0.0, 0.0, 0.0, 0.0)
"""Wheels without errors."""


class Wheels:
    """The two wheels of one robot; ``rng`` draws their constant errors first."""

    def __init__(self, errors: WheelErrors, base_m: float, rng: np.random.Generator) -> None:
        self._errors = errors
        self._base_m = base_m
        self._rng = rng
        shared = errors.sigma_scale * rng.standard_normal()
        uneven = errors.sigma_uneven * rng.standard_normal(2)
        self._left, self._right = (1.0 + shared + uneven).tolist()

    def count(self, length: float, turn: float) -> SE2:
        """Return the increment ``T_before_after`` that the wheels count for a motion (m, rad)."""
        if length == 0.0 and turn == 0.0:
            return SE2.identity()
        half = turn * self._base_m / 2.0
        left = self._counted(length - half, self._left)
        right = self._counted(length + half, self._right)
        return arc((left + right) / 2.0, (right - left) / self._base_m)

    def _counted(self, way: float, scale: float) -> float:
        errors, rng = self._errors, self._rng
        counted = way * scale + errors.sigma_step * math.sqrt(abs(way)) * rng.standard_normal()
        if errors.slips_per_m > 0.0 and rng.random() < errors.slips_per_m * abs(way):
            counted += math.copysign(SLIP_M * rng.random(), way)
        return float(counted)


def arc(length: float, turn: float) -> SE2:
    """Return the end of an arc of a circle that begins along x; m, rad."""
    half = turn / 2.0
    # sin(x) / x, which floats cannot divide at 0.
    chord = length * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    return SE2(chord * math.cos(half), chord * math.sin(half), turn)
