"""The places of a belief: found again from clouds that were put there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from firstfix.amcl.bins import BIN_RAD, HEADINGS, bin_of
from firstfix.amcl.clusters import MAX_CLUSTERS, _label, find_clusters
from firstfix.amcl.particles import Particles, equal_weights
from firstfix.core.angles import angle_error, wrap
from firstfix.core.se2 import SE2


def cloud(
    rng: np.random.Generator, centre: tuple[float, float, float], n: int, spread: float = 0.1
) -> NDArray[np.float64]:
    return centre + rng.normal(0.0, 1.0, (n, 3)) * [spread, 2 * spread, spread / 2]


def touching(a: tuple[int, int, int], b: tuple[int, int, int]) -> bool:
    turn = abs(a[2] - b[2])
    return max(abs(a[0] - b[0]), abs(a[1] - b[1]), min(turn, HEADINGS - turn)) <= 1


def brute_force_labels(poses: NDArray[np.float64]) -> list[int]:
    """Spread the number of every first particle over all bins that touch, again and again."""
    bins = [bin_of(*pose) for pose in poses]
    label = [-1] * len(bins)
    count = 0
    for first in range(len(bins)):
        if label[first] >= 0:
            continue
        label[first] = count
        front = [first]
        while front:
            k = front.pop()
            for i in range(len(bins)):
                if label[i] < 0 and touching(bins[k], bins[i]):
                    label[i] = count
                    front.append(i)
        count += 1
    return label


def about(
    poses: NDArray[np.float64], weight: NDArray[np.float64], pose: SE2
) -> NDArray[np.float64]:
    """Covariance about a pose, written down directly."""
    off = poses - pose.as_array()
    off[:, 2] = wrap(off[:, 2])
    return (off * weight[:, None]).T @ off / weight.sum()


@settings(deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 60), st.floats(0.3, 4.0), st.floats(0.1, 3.0))
def test_labels_are_those_of_brute_force(seed, n, width, turns):
    rng = np.random.default_rng(seed)
    poses = rng.uniform(-1.0, 1.0, (n, 3)) * [width, width, turns]
    poses[:, 2] = wrap(poses[:, 2] + rng.uniform(-4.0, 4.0))
    label, count = _label(*np.ascontiguousarray(poses.T))
    assert label.tolist() == brute_force_labels(poses)
    assert count == label.max() + 1


def test_two_clouds_are_two_clusters():
    rng = np.random.default_rng(0)
    here, there = cloud(rng, (1.2, 2.3, 0.4), 300), cloud(rng, (-7.0, 4.0, -2.0), 700)
    poses = rng.permutation(np.concatenate([here, there]))
    belief = equal_weights(poses)
    heavy, light = find_clusters(belief, belief.weight)
    assert heavy.mass == pytest.approx(0.7)
    assert light.mass == pytest.approx(0.3)
    for cluster, members in ((heavy, there), (light, here)):
        np.testing.assert_allclose(cluster.pose.as_array(), members.mean(axis=0))
        np.testing.assert_allclose(cluster.covariance, np.cov(members.T, ddof=0))


def test_weights_count_in_mass_mean_and_covariance():
    rng = np.random.default_rng(1)
    poses = np.concatenate([cloud(rng, (0.2, 0.2, 1.0), 50), cloud(rng, (5.0, 5.0, 1.0), 50)])
    belief = equal_weights(poses).reweighed(rng.random(100) ** 3)
    clusters = find_clusters(belief, belief.weight)
    for members, cluster in zip(
        sorted((slice(0, 50), slice(50, 100)), key=lambda s: -belief.weight[s].sum()),
        clusters,
        strict=True,
    ):
        weight = belief.weight[members]
        assert cluster.mass == pytest.approx(weight.sum())
        mean = np.average(poses[members], axis=0, weights=weight)
        np.testing.assert_allclose(cluster.pose.as_array(), mean)
        expected = np.cov(poses[members].T, aweights=weight, ddof=0)
        np.testing.assert_allclose(cluster.covariance, expected, atol=1e-15)


@pytest.mark.parametrize("centre", [math.pi, -math.pi + 0.02, math.pi - 0.02, 0.0, -3.0])
def test_headings_are_averaged_on_the_circle(centre):
    rng = np.random.default_rng(2)
    turns = rng.normal(0.0, 0.1, 400)
    poses = np.column_stack([np.full(400, 0.2), np.full(400, 0.3), centre + turns])
    belief = equal_weights(poses)
    (cluster,) = find_clusters(belief, belief.weight)
    assert angle_error(cluster.pose.yaw, centre + turns.mean()) < 1e-12
    assert cluster.covariance[2, 2] == pytest.approx(turns.var())
    np.testing.assert_allclose(cluster.covariance[:2], 0.0, atol=1e-15)


def test_a_known_position_with_unknown_heading_is_one_place():
    yaw = (np.arange(HEADINGS) + 0.5) * BIN_RAD
    poses = np.column_stack([np.full(HEADINGS, 0.2), np.full(HEADINGS, 0.2), yaw])
    belief = equal_weights(poses)
    (cluster,) = find_clusters(belief, belief.weight)
    assert cluster.mass == pytest.approx(1.0)
    gap = equal_weights(np.delete(poses, [5, 6, 20, 21], axis=0))
    assert len(find_clusters(gap, gap.weight)) == 2
    once = equal_weights(np.delete(poses, [5, 6], axis=0))
    assert len(find_clusters(once, once.weight)) == 1  # still connected the other way round


def test_many_places_are_cut_to_the_heaviest():
    n = 100
    poses = np.column_stack([np.arange(n) * 3.0, np.zeros(n), np.zeros(n)])
    weight = np.random.default_rng(3).permutation(np.arange(1.0, n + 1))
    belief = equal_weights(poses).reweighed(weight)
    clusters = find_clusters(belief, belief.weight)
    assert len(clusters) == MAX_CLUSTERS
    heaviest = np.argsort(-weight)[:MAX_CLUSTERS]
    assert [c.pose.x for c in clusters] == poses[heaviest, 0].tolist()
    np.testing.assert_allclose([c.mass for c in clusters], belief.weight[heaviest])


@settings(deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 200))
def test_clusters_share_out_the_belief(seed, n):
    rng = np.random.default_rng(seed)
    belief = equal_weights(rng.normal(0.0, 0.8, (n, 3))).reweighed(rng.random(n))
    clusters = find_clusters(belief, belief.weight)
    masses = [c.mass for c in clusters]
    assert masses == sorted(masses, reverse=True)
    assert sum(masses) <= 1.0 + 1e-12
    if len(clusters) < MAX_CLUSTERS:
        assert sum(masses) == pytest.approx(1.0)
    for cluster in clusters:
        np.testing.assert_array_equal(cluster.covariance, cluster.covariance.T)
        assert np.linalg.eigvalsh(cluster.covariance).min() > -1e-12


def test_the_order_of_particles_changes_nothing():
    rng = np.random.default_rng(4)
    poses = np.concatenate([cloud(rng, (k * 3.0, 0.0, k), 100 + k, 0.2) for k in range(4)])
    weight = rng.random(len(poses))
    order = rng.permutation(len(poses))
    a = equal_weights(poses).reweighed(weight)
    b = equal_weights(poses[order]).reweighed(weight[order])
    for one, other in zip(find_clusters(a, a.weight), find_clusters(b, b.weight), strict=True):
        assert one.mass == pytest.approx(other.mass)
        np.testing.assert_allclose(one.pose.as_array(), other.pose.as_array(), atol=1e-12)
        np.testing.assert_allclose(one.covariance, other.covariance, atol=1e-12)


def test_covariance_is_about_the_reported_pose():
    """A sharper belief moves the mean, and the covariance is about that mean."""
    rng = np.random.default_rng(5)
    poses = cloud(rng, (2.2, -1.2, math.pi), 500)
    belief = equal_weights(poses).reweighed(rng.random(500))
    emphasis = belief.reweighed(np.exp(10.0 * (poses[:, 0] - 2.2))).weight
    (cluster,) = find_clusters(belief, emphasis)
    mean = np.average(poses, axis=0, weights=emphasis)
    np.testing.assert_allclose(cluster.pose.as_array()[:2], mean[:2])
    assert angle_error(cluster.pose.yaw, mean[2]) < 1e-12
    assert cluster.pose.x > 2.25
    expected = about(poses, belief.weight, cluster.pose)
    np.testing.assert_allclose(cluster.covariance, expected, atol=1e-15)
    assert cluster.covariance[0, 0] > np.cov(poses.T, aweights=belief.weight)[0, 0]
    assert cluster.mass == pytest.approx(1.0)  # the mass of the belief, not of the emphasis


def test_a_place_without_emphasis_is_still_a_place():
    rng = np.random.default_rng(6)
    poses = np.concatenate([cloud(rng, (0.0, 0.0, 0.0), 60), cloud(rng, (8.0, 0.0, 0.0), 40)])
    belief = equal_weights(poses)
    emphasis = np.where(np.arange(100) < 60, 1.0 / 60, 0.0)
    _, second = find_clusters(belief, emphasis)
    assert second.mass == pytest.approx(0.4)
    np.testing.assert_array_equal(second.pose.as_array(), belief.poses()[60])  # one of its own
    expected = about(poses[60:], belief.weight[60:], second.pose)
    np.testing.assert_allclose(second.covariance, expected)


def test_a_place_without_mass_is_none():
    poses = np.array([[0.0, 0.0, 0.0], [9.0, 9.0, 0.0], [0.1, 0.1, 0.0]])
    belief = equal_weights(poses).reweighed(np.array([1.0, 0.0, 3.0]))
    (cluster,) = find_clusters(belief, belief.weight)
    assert cluster.mass == pytest.approx(1.0)
    assert cluster.pose.x == pytest.approx(0.075)


def test_one_particle_is_one_place_without_spread():
    belief = Particles(*(np.array([v]) for v in (1.0, -2.0, math.pi, 1.0)))
    (cluster,) = find_clusters(belief, belief.weight)
    assert (cluster.mass, cluster.pose) == (1.0, SE2(1.0, -2.0, math.pi))
    assert not cluster.covariance.any()
    with pytest.raises(ValueError, match="read-only"):
        cluster.covariance[0, 0] = 1.0
