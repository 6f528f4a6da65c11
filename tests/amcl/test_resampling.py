"""Systematic resampling: copies in proportion to weight, never off by one or more."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from firstfix.amcl.resampling import _comb, systematic

LEAST = 5e-324  # smallest number above 0

weights = (
    st.lists(st.floats(0.0, 1.0) | st.sampled_from([0.0, LEAST, 1e-300, 1.0]), min_size=1)
    .map(np.array)
    .filter(lambda w: w.sum() > 1e-300)
)


def copies(weight: NDArray[np.float64], n: int, offset: float) -> NDArray[np.int64]:
    return np.bincount(_comb(weight, n, offset), minlength=len(weight))


@settings(deadline=None)
@given(weights, st.integers(1, 300), st.integers(0, 1000))
def test_copies_are_never_off_by_one_or_more(weight, n, seed):
    drawn = systematic(weight, n, np.random.default_rng(seed))
    assert drawn.shape == (n,)
    assert drawn.dtype == np.int64
    assert (np.diff(drawn) >= 0).all()
    expected = n * (weight / weight.sum())
    assert np.abs(np.bincount(drawn, minlength=len(weight)) - expected).max() < 1.0 + 1e-9


@settings(deadline=None)
@given(weights, st.integers(1, 300), st.sampled_from([0.0, 1e-17, 0.5, np.nextafter(1.0, 0.0)]))
def test_what_weighs_nothing_is_never_drawn(weight, n, offset):
    assert weight[_comb(weight, n, offset)].min() > 0.0


@settings(max_examples=50, deadline=None)
@given(weights, st.integers(1, 100))
def test_expected_copies_are_n_times_the_weight(weight, n):
    """Over all offsets of the comb; the midpoint rule is off by at most one step in two places."""
    offsets = (np.arange(1000) + 0.5) / 1000
    mean = np.mean([copies(weight, n, offset) for offset in offsets], axis=0)
    np.testing.assert_allclose(mean, n * (weight / weight.sum()), atol=2.1e-3)


def test_the_comb_is_a_search_in_the_sum():
    rng = np.random.default_rng(5)
    for _ in range(100):
        weight = rng.random(rng.integers(1, 200)) ** 8
        n, offset = int(rng.integers(1, 500)), rng.random()
        teeth = (np.arange(n) + offset) / n * weight.sum()
        twin = np.searchsorted(np.cumsum(weight), teeth, side="right")
        assert _comb(weight, n, offset).tolist() == twin.tolist()


def test_the_offset_is_drawn_from_the_generator():
    weight = np.random.default_rng(1).random(50)
    drawn = systematic(weight, 80, np.random.default_rng(2))
    assert drawn.tolist() == _comb(weight, 80, np.random.default_rng(2).random()).tolist()


@pytest.mark.parametrize(
    ("weight", "only"),
    [
        ([0.3], 0),
        ([0.0, 0.0, 1.0], 2),
        ([1.0, 0.0, 0.0], 0),
        ([0.0, LEAST, 0.0], 1),
    ],
)
@pytest.mark.parametrize("offset", [0.0, 0.3, np.nextafter(1.0, 0.0)])
def test_one_that_has_all_the_weight_is_all_that_is_drawn(weight, only, offset):
    drawn = _comb(np.array(weight), 7, offset)
    assert drawn.tolist() == [only] * 7


def test_equal_weights_are_drawn_once_each():
    for n in (1, 7, 500, 2000):
        drawn = systematic(np.full(n, 1.0 / n), n, np.random.default_rng(n))
        assert drawn.tolist() == list(range(n))
