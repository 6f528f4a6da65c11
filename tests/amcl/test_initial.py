"""Where a belief begins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstfix.amcl.initial import around_hypotheses, around_pose, free_poses, over_free_space
from firstfix.core.angles import wrap
from firstfix.core.errors import InputError
from firstfix.core.estimate import Evidence, Hypothesis
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.se2 import SE2

COVARIANCE = np.array([[0.3, 0.1, 0.02], [0.1, 0.2, -0.03], [0.02, -0.03, 0.05]])
TINY = np.diag([1e-6, 1e-6, 1e-6])
EVIDENCE = Evidence(explained=1.0, short=0.0, through_wall=0.0, unknown=0.0, beams=60)


def place(x: float, probability: float, covariance=TINY) -> Hypothesis:
    return Hypothesis(SE2(x, 0.0, 0.0), covariance, 0.1, probability, EVIDENCE)


@pytest.mark.parametrize("yaw", [0.3, math.pi])
def test_around_a_pose_mean_and_covariance_are_as_asked(yaw):
    n = 200_000
    pose = SE2(3.0, -4.0, yaw)
    particles = around_pose(pose, COVARIANCE, n, np.random.default_rng(0))
    off = particles.poses() - pose.as_array()
    off[:, 2] = wrap(off[:, 2])
    sigma = np.sqrt(np.diag(COVARIANCE))
    assert len(particles) == n
    assert (np.abs(off.mean(axis=0)) < 5 * sigma / math.sqrt(n)).all()
    np.testing.assert_allclose(np.cov(off.T), COVARIANCE, atol=0.015 * sigma.max() ** 2)
    # Normal: in every direction as many within one and two sigma.
    whitened = np.linalg.solve(np.linalg.cholesky(COVARIANCE), off.T)
    assert np.allclose((np.abs(whitened) < 1).mean(axis=1), 0.6827, atol=0.006)
    assert np.allclose((np.abs(whitened) < 2).mean(axis=1), 0.9545, atol=0.003)
    assert particles.weight.sum() == pytest.approx(1.0)


def test_a_pose_known_exactly_is_where_all_particles_are():
    particles = around_pose(SE2(1.0, 2.0, 3.0), np.zeros((3, 3)), 10, np.random.default_rng(0))
    np.testing.assert_allclose(particles.poses(), [[1.0, 2.0, 3.0]] * 10)
    line = around_pose(SE2(1.0, 2.0, 3.0), np.diag([1.0, 0.0, 0.0]), 10, np.random.default_rng(0))
    np.testing.assert_allclose(line.poses()[:, 1:], [[2.0, 3.0]] * 10)
    assert np.ptp(line.x) > 0.5


@pytest.mark.parametrize(
    "covariance",
    [
        np.diag([1.0, 1.0, -0.1]),
        np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        np.diag([1.0, 1.0]),
        np.ones(9),
        np.full((3, 3), math.nan),
        np.diag([1.0, math.inf, 1.0]),
    ],
)
def test_what_is_no_covariance_is_an_error(covariance):
    with pytest.raises(InputError, match="symmetric covariance"):
        around_pose(SE2.identity(), covariance, 5, np.random.default_rng(0))
    with pytest.raises(InputError, match="symmetric covariance"):
        around_hypotheses([place(0.0, 1.0, covariance)], 5, np.random.default_rng(0))


@settings(deadline=None)
@given(
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30).filter(lambda p: sum(p) > 1e-3),
    st.integers(1, 3000),
)
def test_every_place_gets_its_share_within_one(probabilities, n):
    hypotheses = [place(10.0 * i, p) for i, p in enumerate(probabilities)]
    particles = around_hypotheses(hypotheses, n, np.random.default_rng(0))
    counts = np.bincount(np.rint(particles.x / 10.0).astype(int), minlength=len(hypotheses))
    shares = n * np.array(probabilities) / sum(probabilities)
    assert len(particles) == n
    assert np.abs(counts - shares).max() < 1.0 + 1e-9
    assert not counts[np.array(probabilities) == 0.0].any()


def test_every_place_has_its_own_spread():
    hypotheses = [place(0.0, 0.3), place(100.0, 0.3, 25 * COVARIANCE)]
    particles = around_hypotheses(hypotheses, 20_000, np.random.default_rng(1))
    near, far = particles.poses()[particles.x < 50.0], particles.poses()[particles.x > 50.0]
    np.testing.assert_allclose(np.cov(near.T), TINY, atol=5e-8)
    np.testing.assert_allclose(np.cov(far[:, :2].T), 25 * COVARIANCE[:2, :2], atol=0.4)


@pytest.mark.parametrize("hypotheses", [[], [place(0.0, 0.0), place(1.0, 0.0)]])
def test_no_place_at_all_is_an_error(hypotheses):
    with pytest.raises(InputError, match="positive probability"):
        around_hypotheses(hypotheses, 100, np.random.default_rng(0))


def drawn() -> OccupancyGrid:
    cells = np.full((6, 9), UNKNOWN, np.int8)
    cells[1:5, 2:8] = FREE
    cells[2:4, 3:5] = OCCUPIED
    cells[1, 7] = 50  # neither free nor occupied
    unseen = np.zeros(cells.shape, np.bool_)
    unseen[4, 6] = True
    return OccupancyGrid(cells, 0.5, SE2(-3.0, 7.0, 2.1), unseen)


def test_anywhere_is_evenly_over_free_cells_in_any_direction():
    from scipy import stats  # 1 s: only in the process that runs this test

    grid, n = drawn(), 40_000
    particles = over_free_space(grid, n, np.random.default_rng(2))
    cells = grid.to_cells(particles.poses()[:, :2])
    counts = np.zeros(grid.cells.shape, int)
    column, row = np.floor(cells).astype(int).T
    np.add.at(counts, (row, column), 1)
    assert not counts[~grid.seen_free].any()
    assert stats.chisquare(counts[grid.seen_free]).pvalue > 1e-4
    within = cells - np.floor(cells)
    assert stats.kstest(within[:, 0], "uniform").pvalue > 1e-4
    assert stats.kstest(within[:, 1], "uniform").pvalue > 1e-4
    turns = particles.yaw / (2 * math.pi) + 0.5
    assert stats.kstest(turns, "uniform").pvalue > 1e-4
    assert np.abs(np.corrcoef(np.column_stack([within, turns]).T) - np.eye(3)).max() < 0.03
    assert particles.weight.sum() == pytest.approx(1.0)


def test_free_poses_are_as_many_as_asked():
    for n in (0, 1, 17):
        assert free_poses(drawn(), n, np.random.default_rng(0)).shape == (n, 3)


@pytest.mark.parametrize("value", [OCCUPIED, UNKNOWN, 50])
def test_a_map_without_free_space_is_an_error(value):
    grid = OccupancyGrid(np.full((3, 4), value, np.int8), 0.1)
    with pytest.raises(InputError, match="free space"):
        over_free_space(grid, 10, np.random.default_rng(0))


def test_one_seed_is_one_belief():
    a, b, c = (over_free_space(drawn(), 50, np.random.default_rng(s)).poses() for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert (a != c).any(axis=1).all()
