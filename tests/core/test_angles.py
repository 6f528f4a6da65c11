"""Angles: one interval, closed at +π as in REP 103."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.angles import FULL_TURN, angle_error, wrap

angles = st.floats(-1e4, 1e4, allow_nan=False)


@given(angles)
def test_wrap_stays_in_the_half_open_interval_and_keeps_the_direction(angle: float) -> None:
    wrapped = wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@pytest.mark.parametrize("angle", [math.pi, -math.pi, 3 * math.pi, -3 * math.pi])
def test_half_a_turn_is_plus_pi_from_either_side(angle: float) -> None:
    assert wrap(angle) == math.pi


@pytest.mark.parametrize("angle", [-math.pi + 1e-9, math.pi - 1e-9, 0.0])
def test_wrap_keeps_an_angle_inside_the_interval(angle: float) -> None:
    assert wrap(angle) == pytest.approx(angle, abs=1e-15)


def test_just_below_minus_pi_never_becomes_minus_pi() -> None:
    below = float(np.nextafter(-math.pi, -4.0))
    assert -math.pi < wrap(below) <= math.pi


@given(st.lists(angles, max_size=20))
def test_an_array_wraps_like_its_elements(values: list[float]) -> None:
    wrapped = wrap(np.array(values, np.float64))
    assert isinstance(wrapped, np.ndarray)
    assert wrapped.tolist() == [wrap(value) for value in values]


@given(angles, angles)
def test_angle_error_is_a_distance(a: float, b: float) -> None:
    error = angle_error(a, b)
    assert 0.0 <= error <= math.pi
    assert error == pytest.approx(angle_error(b, a), abs=1e-9)
    assert angle_error(a, a) == 0.0
    assert angle_error(a, a + FULL_TURN) == pytest.approx(0.0, abs=1e-9)


def test_angle_error_across_plus_minus_pi_is_small() -> None:
    assert angle_error(math.pi - 0.1, -math.pi + 0.1) == pytest.approx(0.2)


def test_angle_error_of_arrays() -> None:
    errors = angle_error(np.array([0.0, math.pi]), -0.5)
    np.testing.assert_allclose(errors, [0.5, math.pi - 0.5])
