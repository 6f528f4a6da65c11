"""Odometry and signals: plain values with a finite time."""

from __future__ import annotations

import dataclasses
import math

import pytest

from firstfix.core.errors import InputError
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.se2 import SE2

POSE = SE2(1.0, -2.0, 0.5)


@pytest.mark.parametrize("stamp", [math.nan, math.inf, -math.inf])
def test_a_stamp_that_is_not_finite_is_refused(stamp: float) -> None:
    for make in (
        lambda: Odometry(stamp, POSE),
        lambda: Signal(stamp, SignalKind.CLIFF, active=True),
    ):
        with pytest.raises(InputError, match=f"expected a finite stamp.*received stamp {stamp}"):
            make()


@pytest.mark.parametrize("stamp", [0.0, -5.0, 1.7e9, 1e300])
def test_any_finite_stamp_is_accepted(stamp: float) -> None:
    assert Odometry(stamp, POSE).stamp == stamp
    assert Signal(stamp, SignalKind.BUMPER, active=False).stamp == stamp


def test_messages_compare_by_value_and_are_frozen() -> None:
    odometry, signal = Odometry(1.0, POSE), Signal(1.0, SignalKind.CLIFF, active=True)
    assert odometry == Odometry(1.0, SE2(1.0, -2.0, 0.5))
    assert odometry != Odometry(1.0, SE2(1.0, -2.0, 0.6))
    assert signal != Signal(1.0, SignalKind.CLIFF, active=False)
    assert signal != Signal(1.0, SignalKind.WHEEL_DROP, active=True)
    for value in (odometry, signal):
        with pytest.raises(dataclasses.FrozenInstanceError):
            value.stamp = 2.0


def test_signal_kinds_have_the_names_of_drivers_and_logs() -> None:
    for word in ("cliff", "wheel_drop", "picked_up", "bumper"):
        assert SignalKind(word).value == word
    assert len(SignalKind) == 4


def test_a_bumper_does_not_mean_lifted() -> None:
    lifting = {kind for kind in SignalKind if kind.means_lifted}
    assert lifting == {SignalKind.CLIFF, SignalKind.WHEEL_DROP, SignalKind.PICKED_UP}
