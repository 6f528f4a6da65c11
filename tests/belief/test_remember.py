"""Which views a belief keeps on a long way."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from firstfix.belief.config import BeliefConfig
from firstfix.belief.evidence import NEW_M
from firstfix.belief.remember import remembered
from firstfix.belief.view import Observation, View
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2

CONFIG = BeliefConfig(window=4, memory=3)


def along(poses: list[SE2]) -> tuple[Observation, ...]:
    scan = LaserScan(np.ones(9, np.float32), -0.5, 0.125, 0.05, 5.0)
    return tuple(Observation((View.of(scan, pose),), 0.05) for pose in poses)


def kept_on(poses: list[SE2]) -> list[int]:
    """Return the numbers of the poses that are kept at the end, as a belief does it."""
    names: list[int] = []
    views = along(poses)
    for i in range(len(poses)):
        if len(names) >= CONFIG.window:
            chosen = remembered([views[n] for n in names], CONFIG)
            names = [names[k] for k in chosen]
        names.append(i)
    return names


def test_the_latest_views_stay():
    assert kept_on([SE2(0.3 * i, 0.0, 0.0) for i in range(4)]) == [0, 1, 2, 3]
    assert kept_on([SE2(0.3 * i, 0.0, 0.0) for i in range(40)])[-4:] == [36, 37, 38, 39]


def test_older_views_stay_if_they_are_apart():
    older = kept_on([SE2(0.3 * i, 0.0, 0.0) for i in range(60)])[:-4]
    assert len(older) == CONFIG.memory
    assert all(0.3 * (b - a) >= NEW_M - 1e-6 for a, b in itertools.pairwise(older))
    assert 0.3 * (56 - older[0]) <= (CONFIG.memory + 1) * (NEW_M + 0.3)


def test_a_turn_on_the_spot_is_remembered():
    older = kept_on([SE2(0.0, 0.0, 0.3 * i) for i in range(12)])[:-4]
    assert len(older) >= 2
    assert all(0.3 * (b - a) >= 1.0 for a, b in itertools.pairwise(older))


@pytest.mark.parametrize("count", [1, 3, 4, 30])
def test_a_belief_without_memory_keeps_the_latest_views_only(count):
    config = BeliefConfig(window=4, memory=0)
    views = along([SE2(3.0 * i, 0.0, math.pi * i) for i in range(count)])
    assert remembered(views, config) == list(range(max(0, count - 3), count))
