"""The belief: weights that sum to one, whatever evidence comes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.amcl.particles import Particles, equal_weights
from firstfix.core.angles import angle_error

likelihoods = st.lists(
    st.floats(0.0, 1.0) | st.sampled_from([0.0, 5e-324, 1e-310, 1e-200]), min_size=1, max_size=50
).map(np.array)


def somewhere(n: int, seed: int = 0) -> Particles:
    return equal_weights(np.random.default_rng(seed).normal(0.0, 3.0, (n, 3)))


@given(likelihoods, likelihoods)
def test_weights_sum_to_one_after_any_evidence(first, second):
    n = min(len(first), len(second))
    after = somewhere(n).reweighed(first[:n]).reweighed(second[:n])
    assert after.weight.sum() == pytest.approx(1.0, abs=1e-12)
    assert after.weight.min() >= 0.0


def test_a_weight_is_multiplied_by_its_likelihood():
    after = somewhere(4).reweighed(np.array([0.0, 1.0, 3.0, 4.0]))
    np.testing.assert_allclose(after.weight, [0.0, 1 / 8, 3 / 8, 4 / 8])
    twice = after.reweighed(np.array([1.0, 8.0, 1.0, 0.0]))
    np.testing.assert_allclose(twice.weight, [0.0, 8 / 11, 3 / 11, 0.0])
    np.testing.assert_array_equal(twice.poses(), somewhere(4).poses())


@given(likelihoods, st.floats(1e-3, 1e3))
def test_a_factor_common_to_all_changes_nothing(likelihood, factor):
    likelihood = np.where(likelihood < 1e-100, 0.0, likelihood)  # what can be scaled exactly enough
    before = somewhere(len(likelihood))
    np.testing.assert_allclose(
        before.reweighed(factor * likelihood).weight, before.reweighed(likelihood).weight
    )


def test_evidence_between_the_least_of_numbers_still_counts():
    after = somewhere(4).reweighed(np.array([0.0, 5e-323, 5e-323, 0.0]))
    assert after.weight.tolist() == [0.0, 0.5, 0.5, 0.0]


@pytest.mark.parametrize("nothing", [0.0, math.nan])
def test_evidence_against_all_particles_changes_nothing(nothing):
    before = somewhere(5).reweighed(np.arange(5.0))
    assert before.reweighed(np.full(5, nothing)) is before


def test_effective_sample_size_counts_those_that_weigh():
    assert somewhere(40).effective == pytest.approx(40.0)
    assert somewhere(40).reweighed(np.eye(40)[7]).effective == pytest.approx(1.0)
    half = np.repeat([0.0, 1.0], 20)
    assert somewhere(40).reweighed(half).effective == pytest.approx(20.0)


def test_copies_weigh_the_same():
    before = somewhere(10).reweighed(np.arange(10.0))
    index = np.array([9, 9, 3, 0])
    after = before.drawn(index)
    np.testing.assert_array_equal(after.poses(), before.poses()[index])
    assert after.weight.tolist() == [0.25] * 4


@given(st.lists(st.tuples(*[st.floats(-100.0, 100.0)] * 3), min_size=1, max_size=20))
def test_poses_go_in_and_come_out_with_headings_wrapped(rows):
    poses = np.array(rows)
    particles = equal_weights(poses)
    assert len(particles) == len(poses)
    np.testing.assert_array_equal(particles.poses()[:, :2], poses[:, :2])
    assert ((particles.yaw > -math.pi) & (particles.yaw <= math.pi)).all()
    assert angle_error(particles.yaw, poses[:, 2]).max() < 1e-12
    assert particles.weight.sum() == pytest.approx(1.0)


def test_a_belief_cannot_be_changed_from_outside():
    poses = np.zeros((3, 3))
    particles = equal_weights(poses)
    poses[:] = 7.0
    assert not particles.poses().any()
    for array in (particles.x, particles.y, particles.yaw, particles.weight):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
