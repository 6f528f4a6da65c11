"""Wheels count how far they roll, with the configured errors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.wheels import EXACT_WHEELS, WheelErrors, Wheels, arc


def rng() -> np.random.Generator:
    return np.random.default_rng(5)


@given(st.floats(-2.0, 2.0), st.floats(-3.0, 3.0))
def test_an_arc_of_two_halves_is_the_whole(length: float, turn: float) -> None:
    half = arc(length / 2, turn / 2)
    np.testing.assert_allclose((half @ half).as_array(), arc(length, turn).as_array(), atol=1e-9)


def test_a_quarter_of_a_circle_ends_beside_its_centre() -> None:
    np.testing.assert_allclose(
        arc(math.pi / 2, math.pi / 2).as_array(), [1.0, 1.0, math.pi / 2], atol=1e-12
    )


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_exact_wheels_count_what_they_roll(length: float, turn: float) -> None:
    counted = Wheels(EXACT_WHEELS, 0.23, rng()).count(length, turn)
    np.testing.assert_allclose(counted.as_array(), arc(length, turn).as_array(), atol=1e-12)


def test_wheels_at_rest_count_nothing() -> None:
    wheels = Wheels(WheelErrors(sigma_step=1.0, slips_per_m=9.0), 0.23, rng())
    assert wheels.count(0.0, 0.0) == SE2.identity()


def test_scale_errors_are_those_of_the_robot_and_do_not_change() -> None:
    wheels = Wheels(WheelErrors(0.01, 0.002, 0.0), 0.23, rng())
    ways = {wheels.count(0.01, 0.0).as_array().tobytes() for _ in range(5)}
    assert len(ways) == 1
    source, errors = rng(), WheelErrors(0.01, 0.002, 0.0)
    scales = [Wheels(errors, 0.23, source).count(1.0, 0.0).x for _ in range(500)]
    assert float(np.std(scales)) == pytest.approx(0.01, rel=0.2)
    assert float(np.mean(scales)) == pytest.approx(1.0, abs=0.002)


def test_noise_grows_with_the_root_of_the_way_whatever_the_steps() -> None:
    def after_1_m(steps: int) -> float:
        wheels = Wheels(WheelErrors(0.0, 0.0, 0.003), 0.23, rng())
        turns = [sum(wheels.count(1.0 / steps, 0.0).yaw for _ in range(steps)) for _ in range(400)]
        return float(np.std(turns))

    expected = 0.003 * math.sqrt(2.0) / 0.23
    assert after_1_m(1) == pytest.approx(expected, rel=0.15)
    assert after_1_m(20) == pytest.approx(expected, rel=0.15)


def test_slipping_wheels_count_too_far() -> None:
    wheels = Wheels(WheelErrors(0.0, 0.0, 0.0, slips_per_m=2.0), 0.23, rng())
    counted = sum(wheels.count(0.01, 0.0).x for _ in range(10_000))
    assert counted == pytest.approx(100.0 + 100.0 * 2.0 * 0.025, rel=0.02)  # half of 5 cm each


@pytest.mark.parametrize("name", ["sigma_scale", "sigma_uneven", "sigma_step", "slips_per_m"])
@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_errors_that_cannot_be_are_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match=name):
        WheelErrors(**{name: value})
