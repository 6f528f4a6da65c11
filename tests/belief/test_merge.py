"""One pose for each place, under a name that lasts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.belief.merge import merge

NEAR = [(10.0, 10.0, math.pi - 0.05), (13.0, 10.0, -math.pi + 0.05), (10.0, 40.0, 0.0)]


def merged(ids, known, most=10):
    kept, names = merge(
        np.array(NEAR), np.array([-2.0, -1.0, -3.0]), np.array(ids), known, 0.05, most
    )
    return kept.tolist(), names.tolist()


def test_the_best_pose_of_each_place_stays_best_first():
    assert merged([1, 2, 3], (-1, 10))[0] == [1, 2]
    assert merged([1, 2, 3], (-1, 10), most=1)[0] == [1]


@pytest.mark.parametrize(
    ("ids", "known", "names"),
    [
        ([1, 2, 3], (-1, 10), [2, 3]),  # both are held: the better one's
        ([1, 12, 3], (-1, 10), [1, 3]),  # the better one has just entered
        ([11, 12, 13], (-1, 10), [12, 13]),  # all have
        ([1, 2, 3], (1, 10), [1, 3]),  # the favourite keeps its name
    ],
)
def test_a_place_keeps_its_name(ids, known, names):
    assert merged(ids, known)[1] == names
