"""Which poses are one place: the best of each is kept, and only those."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN, angle_error
from firstfix.core.se2 import SE2
from firstfix.global_localization.places import (
    SAME_PLACE_M,
    SAME_PLACE_RAD,
    distinct_places,
    is_same_place,
)

RESOLUTION = 0.05


def poses_of(seed: int, n: int, spread_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Crowded poses with headings from several turns, and scores with ties."""
    rng = np.random.default_rng(seed)
    cells = rng.uniform(0.0, spread_m / RESOLUTION, (n, 2))
    headings = rng.uniform(-2 * FULL_TURN, 2 * FULL_TURN, n)
    return np.column_stack([cells, headings]), rng.integers(0, 20, n).astype(np.float64)


def near(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    distance = math.hypot(*(a[:2] - b[:2])) * RESOLUTION
    return distance <= SAME_PLACE_M and angle_error(float(a[2]), float(b[2])) <= SAME_PLACE_RAD


crowds = st.builds(
    poses_of, st.integers(0, 2**32 - 1), st.integers(0, 60), st.sampled_from([0.6, 2.0, 6.0])
)


@settings(deadline=None)
@given(crowds)
def test_kept_places_are_apart_and_every_dropped_pose_has_a_better_one_near(crowd):
    poses, scores = crowd
    kept = distinct_places(poses, scores, RESOLUTION, len(poses) + 1).tolist()
    for i, a in enumerate(kept):
        assert not any(near(poses[a], poses[b]) for b in kept[:i])
    for dropped in set(range(len(poses))) - set(kept):
        assert any(
            near(poses[dropped], poses[k]) and (scores[k], k) < (scores[dropped], dropped)
            for k in kept
        )


@settings(deadline=None)
@given(crowds)
def test_best_first_and_of_equals_the_earlier(crowd):
    poses, scores = crowd
    kept = distinct_places(poses, scores, RESOLUTION, len(poses) + 1).tolist()
    assert [(scores[i], i) for i in kept] == sorted((scores[i], i) for i in kept)


@settings(deadline=None)
@given(crowds, st.integers(0, 10))
def test_asking_for_fewer_gives_the_first_of_them(crowd, most):
    poses, scores = crowd
    every = distinct_places(poses, scores, RESOLUTION, len(poses) + 1)
    assert distinct_places(poses, scores, RESOLUTION, most).tolist() == every[:most].tolist()


@settings(deadline=None)
@given(crowds)
def test_whole_turns_and_integer_scores_change_nothing(crowd):
    poses, scores = crowd
    kept = distinct_places(poses, scores, RESOLUTION, 100).tolist()
    # Eighths of a turn are exact, so wrapping rounds nothing.
    poses[:, 2] = np.round(poses[:, 2] * 8 / FULL_TURN) * FULL_TURN / 8
    exact = distinct_places(poses, scores, RESOLUTION, 100).tolist()
    turned = np.column_stack([poses[:, :2], poses[:, 2] + FULL_TURN])
    assert distinct_places(turned, scores, RESOLUTION, 100).tolist() == exact
    assert distinct_places(turned, scores.astype(np.int64), RESOLUTION, 100).tolist() == exact
    assert len(kept) == 0 or kept[0] == exact[0]


@pytest.mark.parametrize(
    ("apart_m", "a", "b", "places"),
    [
        (0.0, 179.0, -179.0, 1),  # 2 degrees across the seam
        (0.0, 350.0, 369.0, 1),
        (0.0, 170.0, -165.0, 2),  # 25 degrees across the seam
        (0.0, 0.0, 19.9, 1),
        (0.0, 0.0, 20.1, 2),
        (0.499, 0.0, 0.0, 1),
        (0.501, 0.0, 0.0, 2),
        (0.499, 0.0, 20.1, 2),
    ],
)
def test_the_limits_of_one_place(apart_m, a, b, places):
    poses = np.array([[10.0, 10.0, math.radians(a)], [10.0, 10.0, math.radians(b)]])
    poses[1, 0] += apart_m / RESOLUTION
    assert len(distinct_places(poses, np.zeros(2), RESOLUTION, 5)) == places


def test_no_pose_no_place():
    assert distinct_places(np.empty((0, 3)), np.empty(0), RESOLUTION, 5).tolist() == []


@pytest.mark.parametrize(
    ("off", "same"),
    [
        (SE2(0.49, 0.0, 0.0), True),
        (SE2(0.0, 0.51, 0.0), False),
        (SE2(0.3, -0.3, math.radians(19.0)), True),
        (SE2(0.0, 0.0, math.radians(-21.0)), False),
    ],
)
@pytest.mark.parametrize("pose", [SE2(0.0, 0.0, 0.0), SE2(-3.0, 8.0, 3.1)])
def test_the_same_place_is_half_a_metre_and_twenty_degrees(pose, off, same):
    assert is_same_place(pose, pose @ off) is same
    assert is_same_place(pose @ off, pose) is same


def test_distinct_places_and_is_same_place_agree() -> None:
    rng = np.random.default_rng(0)
    for a, b in rng.normal(0.0, [0.4, 0.4, 0.4], (300, 2, 3)):
        kept = distinct_places(np.array([a, b]), np.array([0.0, 1.0]), 1.0, 2)
        assert is_same_place(SE2(*a), SE2(*b)) is (len(kept) == 1)
