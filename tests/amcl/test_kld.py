"""How many particles a belief needs: Fox 2003, and a slow twin that draws in the same order."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import special

from firstfix.amcl.bins import bin_of
from firstfix.amcl.config import AmclConfig
from firstfix.amcl.kld import adapted_size, sample_size
from firstfix.amcl.particles import Particles, equal_weights
from firstfix.amcl.resampling import systematic

errors = st.floats(0.005, 0.5)
quantiles = st.floats(0.0, 4.0)


def cloud(n: int, spread: tuple[float, float, float], seed: int = 0) -> Particles:
    rng = np.random.default_rng(seed)
    particles = equal_weights(rng.normal(0.0, 1.0, (n, 3)) * spread)
    return particles.reweighed(rng.random(n))


@settings(deadline=None)
@given(st.integers(2, 100_000), errors, quantiles)
def test_the_size_is_equation_7(bins, error, quantile):
    config = AmclConfig(pf_err=error, pf_z=quantile, min_particles=1, max_particles=10_000_000)
    k = bins
    bracket = 1 - 2 / (9 * (k - 1)) + math.sqrt(2 / (9 * (k - 1))) * quantile
    expected = min((k - 1) / (2 * error) * bracket**3, 10_000_000)
    assert expected - 1e-6 * expected <= sample_size(bins, config) <= expected * (1 + 1e-6) + 1


@pytest.mark.parametrize("quantile", [0.0, 0.99, 2.326])
@pytest.mark.parametrize("bins", [10, 50, 200, 3000])
def test_the_size_is_a_quantile_of_chi_square(bins, quantile):
    """Equation 6, of which equation 7 is the approximation: good to about a per cent."""
    config = AmclConfig(pf_z=quantile, min_particles=1, max_particles=10_000_000)
    # As scipy.stats computes it, which takes a second to import.
    chi_square = 2.0 * special.gammaincinv((bins - 1) / 2, special.ndtr(quantile))
    exact = chi_square / (2 * config.pf_err)
    assert sample_size(bins, config) == pytest.approx(exact, rel=0.01)


@settings(deadline=None)
@given(st.integers(0, 10_000), errors, quantiles)
def test_more_bins_need_more_particles(bins, error, quantile):
    config = AmclConfig(pf_err=error, pf_z=quantile, min_particles=5, max_particles=5000)
    sizes = [sample_size(b, config) for b in (bins, bins + 1, 2 * bins + 1)]
    assert sizes == sorted(sizes)
    assert 5 <= sizes[0] <= sizes[-1] <= 5000


def test_the_limits_hold():
    config = AmclConfig(min_particles=500, max_particles=2000)
    assert sample_size(0, config) == sample_size(1, config) == 500
    assert sample_size(100_000, config) == 2000
    between = sample_size(100, config)
    assert 500 < between < 2000


def test_a_belief_in_one_bin_needs_the_least():
    particles = equal_weights(np.full((3000, 3), 0.1))
    assert adapted_size(particles, AmclConfig(), np.random.default_rng(0)) == 500


def test_a_belief_in_one_bin_of_all_that_weigh_needs_the_least():
    poses = np.random.default_rng(1).uniform(-50.0, 50.0, (3000, 3))
    poses[1000:2000] = 0.1
    weight = np.zeros(3000)
    weight[1000:2000] = 1.0
    particles = equal_weights(poses).reweighed(weight)
    assert adapted_size(particles, AmclConfig(), np.random.default_rng(0)) == 500


def test_a_belief_over_a_huge_area_needs_the_most():
    poses = np.random.default_rng(0).uniform(-500.0, 500.0, (3000, 3))
    assert adapted_size(equal_weights(poses), AmclConfig(), np.random.default_rng(0)) == 2000


def twin(particles: Particles, config: AmclConfig, rng: np.random.Generator) -> int:
    """Table 8.4 of the textbook: draw until there are as many as the bins need."""
    order = rng.permutation(systematic(particles.weight, config.max_particles, rng))
    filled = set()
    for drawn, i in enumerate(order.tolist(), 1):
        filled.add(bin_of(*particles.poses()[i]))
        if drawn >= sample_size(len(filled), config):
            return drawn
    return config.max_particles


@pytest.mark.parametrize("spread", [0.05, 0.3, 0.6, 1.0, 2.0, 30.0])
@pytest.mark.parametrize(("least", "most"), [(20, 2000), (100, 1500), (500, 600)])
def test_the_size_is_that_of_the_slow_twin(spread, least, most):
    config = AmclConfig(min_particles=least, max_particles=most)
    for seed in range(3):
        particles = cloud(400, (spread, spread, spread / 3), seed)
        size = adapted_size(particles, config, np.random.default_rng(seed))
        assert size == twin(particles, config, np.random.default_rng(seed))
        assert least <= size <= most


def test_wider_beliefs_get_more():
    config = AmclConfig(min_particles=10, max_particles=20_000)
    sizes = [
        adapted_size(cloud(2000, (s, s, s / 3)), config, np.random.default_rng(3))
        for s in (0.01, 0.5, 1.0, 2.0)
    ]
    assert sizes == sorted(set(sizes))


def test_a_fixed_number_is_that_number():
    config = AmclConfig(min_particles=321, max_particles=321)
    assert adapted_size(cloud(50, (9.0, 9.0, 9.0)), config, np.random.default_rng(0)) == 321
