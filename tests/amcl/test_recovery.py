"""Slow and fast averages, and what their difference asks for."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.recovery import WeightHistory

fits = st.lists(st.floats(1e-9, 3.0), min_size=1, max_size=30)
ON = AmclConfig(recovery_alpha_slow=0.01, recovery_alpha_fast=0.3)


def history_of(values, config: AmclConfig) -> WeightHistory:
    history = WeightHistory()
    for fit in values:
        history = history.after(fit, config)
    return history


def test_before_the_first_scan_nothing_is_asked_for():
    assert WeightHistory().injected_share == 0.0


def test_the_first_scan_sets_both_averages():
    assert WeightHistory().after(0.4, ON) == WeightHistory(0.4, 0.4)


@given(fits)
def test_without_decay_nothing_is_ever_asked_for(values):
    assert history_of(values, AmclConfig()).injected_share == 0.0


@given(fits)
def test_averages_are_sums_of_decaying_weights(values):
    history = history_of(values, ON)
    for alpha, average in ((0.01, history.slow), (0.3, history.fast)):
        weights = [alpha * (1 - alpha) ** k for k in range(len(values) - 1)]
        weights.append((1 - alpha) ** (len(values) - 1))
        expected = sum(w * fit for w, fit in zip(weights, reversed(values), strict=True))
        assert average == pytest.approx(expected)


@given(fits)
def test_a_share_is_a_share(values):
    history = history_of(values, ON)
    assert 0.0 <= history.injected_share < 1.0
    assert (history.injected_share > 0.0) == (history.fast < history.slow)


def test_a_fit_that_breaks_down_asks_for_as_much_as_it_fell():
    history = history_of([0.5] * 20, ON)
    assert history.injected_share == pytest.approx(0.0, abs=1e-12)
    fallen = history.after(0.05, ON)
    slow, fast = 0.5 - 0.01 * 0.45, 0.5 - 0.3 * 0.45
    assert fallen.injected_share == pytest.approx(1.0 - fast / slow)
    assert fallen.after(0.05, ON).injected_share > fallen.injected_share


def test_a_fit_that_gets_better_asks_for_nothing():
    assert history_of([0.1, 0.2, 0.4, 0.8], ON).injected_share == 0.0
