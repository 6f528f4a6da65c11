"""Which beams are compared, and how a missing return counts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.angles import FULL_TURN, angle_error
from firstfix.core.scan import LaserScan, Mounting
from firstfix.fields.range_table import DIRECTIONS
from firstfix.global_localization.beams import LONGEST_M, Beams, by_direction, usable_beams

INF, NAN = math.inf, math.nan


def scan_of(*ranges: float, range_max: float = 10.0, **rest: object) -> LaserScan:
    return LaserScan(np.array(ranges, np.float32), -1.0, 0.5, 0.1, range_max, **rest)


readings = st.one_of(
    st.floats(0.0, 60.0, width=32), st.sampled_from([INF, -INF, NAN, 0.0, -1.0, 0.05])
)
bearing_sets = st.lists(st.floats(-13.0, 13.0), min_size=1, max_size=300)


def beams_at(bearings: list[float], seed: int = 0) -> Beams:
    rng = np.random.default_rng(seed)
    n = len(bearings)
    return Beams(np.array(bearings), rng.uniform(0.1, 20.0, n), rng.random(n) < 0.7)


def test_each_kind_of_reading():
    beams = usable_beams(scan_of(2.0, INF, NAN, 0.0, -3.0, 0.05, 10.0, 12.0, 9.5, -INF))
    assert beams.bearings.tolist() == [-1.0, -0.5, 2.0, 2.5, 3.0]
    assert beams.ranges.tolist() == [2.0, 10.0, 10.0, 10.0, 9.5]
    assert beams.hit.tolist() == [True, False, False, False, True]


@given(st.lists(readings, min_size=1, max_size=12), st.sampled_from([5.0, 40.0, INF]))
def test_every_used_beam_has_a_free_range(ranges, range_max):
    scan = scan_of(*ranges, range_max=range_max)
    beams = usable_beams(scan)
    assert len(beams) == np.count_nonzero(scan.hit | scan.no_return)
    free_to = min(range_max, LONGEST_M)
    assert ((beams.ranges > 0.0) & (beams.ranges <= free_to)).all()
    assert (beams.ranges[~beams.hit] == free_to).all()
    assert (beams.ranges[beams.hit] < free_to).all()


def test_farther_than_the_longest_counts_as_free_up_to_there():
    beams = usable_beams(scan_of(6.0, 4.0), longest_m=5.0)
    assert beams.ranges.tolist() == [5.0, 4.0]
    assert beams.hit.tolist() == [False, True]


def test_bearings_are_those_of_the_upright_sensor():
    upright = usable_beams(scan_of(1.0, 2.0, 3.0))
    hanging = usable_beams(scan_of(1.0, 2.0, 3.0, mounting=Mounting.UPSIDE_DOWN))
    assert hanging.bearings.tolist() == (-upright.bearings).tolist()
    assert hanging.ranges.tolist() == upright.ranges.tolist()


def test_hits_are_the_beams_that_hit():
    beams = usable_beams(scan_of(2.0, INF, 3.0))
    assert beams.hits().ranges.tolist() == [2.0, 3.0]
    assert beams.hits().hit.all()


@given(st.integers(0, 300), st.integers(1, 300))
def test_thinned_beams_are_evenly_chosen(n, most):
    beams = Beams(np.arange(n, dtype=np.float64), np.arange(n) + 0.5, np.ones(n, np.bool_))
    kept = beams.thinned(most)
    assert len(kept) == min(n, most)
    np.testing.assert_array_equal(kept.ranges, kept.bearings + 0.5)
    if 1 < len(kept) < n:
        steps = np.diff(kept.bearings)
        assert kept.bearings[[0, -1]].tolist() == [0.0, n - 1.0]
        assert steps.min() >= 1
        assert np.ptp(steps) <= 1


@given(bearing_sets, st.integers(0, 100))
def test_each_direction_speaks_once_by_one_of_its_own_beams(bearings, seed):
    beams = beams_at(bearings, seed)
    directions, chosen = by_direction(beams)
    assert (np.diff(directions) > 0).all()
    assert ((directions >= 0) & (directions < DIRECTIONS)).all()
    step = FULL_TURN / DIRECTIONS
    np.testing.assert_allclose(chosen.bearings, directions * step)
    for bearing in beams.bearings:  # every beam has its direction
        assert angle_error(chosen.bearings, float(bearing)).min() <= step / 2 + 1e-9
    for direction, range_m, hit in zip(chosen.bearings, chosen.ranges, chosen.hit, strict=True):
        near = angle_error(beams.bearings, float(direction)) <= step / 2 + 1e-9
        assert (range_m, hit) in set(
            zip(beams.ranges[near].tolist(), beams.hit[near].tolist(), strict=True)
        )


@given(bearing_sets, st.integers(-3, 3))
def test_a_full_turn_changes_no_direction(bearings, turns):
    # Away from the limit between two directions, where rounding decides.
    step = FULL_TURN / DIRECTIONS
    bearings = [(round(b / step) + 0.3) * step for b in bearings]
    turned = [b + turns * FULL_TURN for b in bearings]
    (d1, b1), (d2, b2) = (by_direction(beams_at(b)) for b in (bearings, turned))
    assert d1.tolist() == d2.tolist()
    assert b1.ranges.tolist() == b2.ranges.tolist()


@pytest.mark.parametrize(
    ("ranges", "middle"), [([3.0, 1.0, 2.0], 2.0), ([4.0], 4.0), ([4.0, 1.0], 1.0)]
)
def test_the_beam_of_middle_length_speaks(ranges, middle):
    n = len(ranges)
    beams = Beams(np.full(n, 0.01), np.array(ranges), np.ones(n, np.bool_))
    directions, chosen = by_direction(beams)
    assert directions.tolist() == [0]
    assert chosen.ranges.tolist() == [middle]


def test_a_beam_without_return_is_longer_than_a_hit():
    """Its range is the limit of the sensor, so a single hit next to two free beams is outvoted."""
    beams = Beams(np.zeros(3), np.array([10.0, 2.0, 10.0]), np.array([False, True, False]))
    _, chosen = by_direction(beams)
    assert not chosen.hit[0]
