"""Which beams of a scan the filter uses, and where they end."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.amcl.beam_selection import select_beams
from firstfix.amcl.config import AmclConfig
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2

INF, NAN = math.inf, math.nan


def scan_of(*ranges: float, range_max: float = 10.0, **rest: object) -> LaserScan:
    return LaserScan(np.array(ranges, np.float32), -1.0, 0.01, 0.1, range_max, **rest)


def test_each_kind_of_reading():
    scan = scan_of(2.0, INF, NAN, 0.0, -3.0, 0.05, 10.0, 12.0, 9.5, -INF)
    beams = select_beams(scan, AmclConfig())
    np.testing.assert_allclose(beams.bearings, [-1.0, -0.99, -0.94, -0.93, -0.92])
    assert beams.ranges.tolist() == [2.0, 10.0, 10.0, 10.0, 9.5]
    assert len(beams) == 5
    assert len(beams.hits) == 2
    assert beams.chosen == 10  # invalid readings are counted, too


@given(st.integers(1, 500), st.integers(2, 300))
def test_beams_are_evenly_chosen_from_the_first_to_the_last(n, most):
    scan = scan_of(*np.linspace(1.0, 9.0, n))
    beams = select_beams(scan, AmclConfig(max_beams=most))
    assert len(beams) == beams.chosen == min(n, most)
    steps = np.diff(beams.bearings) / 0.01
    assert beams.bearings[0] == scan.bearings[0]
    assert beams.bearings[-1] == scan.bearings[-1]
    if len(steps):
        assert steps.min() > 0.99
        assert np.ptp(steps) < 1.01


@pytest.mark.parametrize("mounting", Mounting)
def test_end_points_are_those_of_the_scan(mounting):
    ranges = np.random.default_rng(0).uniform(0.0, 12.0, 50)
    place = SE2(0.3, -0.2, 2.5)
    scan = scan_of(*ranges, T_base_laser=place, mounting=mounting)
    beams = select_beams(scan, AmclConfig(max_beams=50))
    np.testing.assert_allclose(beams.hits, scan.points())
    from_sensor = beams.ends - [place.x, place.y]
    np.testing.assert_allclose(np.hypot(*from_sensor.T), beams.ranges)
    # Bearings are given in the base frame: the end points agree.
    expected = beams.ranges[:, None] * np.column_stack(
        [np.cos(beams.bearings), np.sin(beams.bearings)]
    )
    np.testing.assert_allclose(from_sensor, expected, atol=1e-12)
    assert beams.T_base_laser == place


def test_the_longest_range_of_the_settings_is_a_limit_of_the_sensor():
    scan = scan_of(2.0, 6.0, 5.0, INF)
    beams = select_beams(scan, AmclConfig(laser_max_range=5.0))
    assert beams.range_max == 5.0
    assert beams.ranges.tolist() == [2.0, 5.0, 5.0, 5.0]
    assert len(beams.hits) == 1
    for wide in (-1.0, 10.0, 100.0):
        beams = select_beams(scan, AmclConfig(laser_max_range=wide))
        assert beams.range_max == 10.0
        assert beams.ranges.tolist() == [2.0, 6.0, 5.0, 10.0]


def test_nearer_than_the_shortest_range_is_left_out():
    scan = scan_of(0.2, 0.5, 3.0, INF)
    assert select_beams(scan, AmclConfig()).ranges[0] == pytest.approx(0.2)
    beams = select_beams(scan, AmclConfig(laser_min_range=0.5))
    assert beams.ranges.tolist() == [0.5, 3.0, 10.0]
    np.testing.assert_allclose(beams.bearings, [-0.99, -0.98, -0.97])
    assert beams.chosen == 4


@pytest.mark.parametrize("reading", [NAN, 0.0])
def test_a_scan_of_nothing_valid_has_no_beams(reading):
    beams = select_beams(scan_of(*[reading] * 30), AmclConfig())
    assert len(beams) == 0
    assert beams.hits.shape == (0, 2)
    assert beams.chosen == 30


def test_a_scan_of_no_returns_has_no_hits():
    beams = select_beams(scan_of(*[INF] * 30), AmclConfig())
    assert len(beams) == 30
    assert beams.hits.shape == (0, 2)


def test_a_single_beam_is_chosen():
    assert select_beams(scan_of(3.0), AmclConfig()).ranges.tolist() == [3.0]
