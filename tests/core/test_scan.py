"""A scan: the meaning of its numbers, and which numbers are refused."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.angles import FULL_TURN
from firstfix.core.errors import ScanError
from firstfix.core.scan import MAX_BEAMS, LaserScan, Mounting
from firstfix.core.se2 import SE2


def make(ranges: Any = (1.0, 2.0, 3.0), **changes: Any) -> LaserScan:
    numbers = {
        "angle_min": -0.1,
        "angle_increment": 0.1,
        "range_min": 0.2,
        "range_max": 10.0,
    } | changes
    return LaserScan(ranges, **numbers)


readings = st.one_of(
    st.floats(width=32),
    st.sampled_from([0.0, -0.0, 0.2, 10.0, math.nan, math.inf, -math.inf, 0.199]),
)


@given(st.lists(readings, min_size=1, max_size=50))
def test_every_beam_is_a_hit_or_no_return_or_invalid(ranges: list[float]) -> None:
    scan = make(np.array(ranges, np.float32))
    assert not (scan.hit & scan.no_return).any()
    hits = scan.ranges[scan.hit]
    assert ((hits >= scan.range_min) & (hits < scan.range_max)).all()
    invalid = ~(scan.hit | scan.no_return)
    assert not (scan.ranges[invalid] >= scan.range_max).any()
    assert scan.points().shape == (len(hits), 2)
    assert np.isfinite(scan.points()).all()


@pytest.mark.parametrize("reading", [math.nan, -math.inf, 0.0, -1.0, 0.1])
def test_invalid_readings_are_ignored(reading: float) -> None:
    scan = make([reading])
    assert not scan.hit.any()
    assert not scan.no_return.any()


@pytest.mark.parametrize("reading", [math.inf, 10.0, 11.0, 1e39])
def test_readings_at_range_max_or_beyond_mean_open_space(reading: float) -> None:
    scan = make(np.array([reading]))
    assert scan.no_return.all()
    assert not scan.hit.any()


def test_zero_is_no_hit_even_where_range_min_is_zero() -> None:
    assert not make([0.0], range_min=0.0).hit.any()


def test_range_max_may_be_infinite() -> None:
    scan = make([5.0, math.inf], range_max=math.inf)
    assert scan.hit.tolist() == [True, False]
    assert scan.no_return.tolist() == [False, True]


def test_bearings_count_from_angle_min() -> None:
    np.testing.assert_allclose(make().bearings, [-0.1, 0.0, 0.1], atol=1e-15)
    np.testing.assert_allclose(make(angle_increment=-0.1).bearings, [-0.1, -0.2, -0.3], atol=1e-15)


def test_upside_down_mirrors_the_points() -> None:
    upright = make()
    hanging = make(mounting=Mounting.UPSIDE_DOWN)
    np.testing.assert_array_equal(hanging.bearings, -upright.bearings)
    np.testing.assert_allclose(hanging.points(), upright.points() * [1.0, -1.0])


def test_points_lie_in_the_base_frame() -> None:
    scan = make([2.0], angle_min=0.0, T_base_laser=SE2(1.0, 0.5, math.pi / 2))
    np.testing.assert_allclose(scan.points(), [[1.0, 2.5]], atol=1e-12)


def test_ranges_become_read_only_float32_and_keep_the_callers_array_as_it_was() -> None:
    ranges = np.array([1.0, 2.0], np.float32)
    scan = make(ranges)
    ranges[0] = 9.0
    assert scan.ranges.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        scan.ranges[0] = 0.0
    assert make([1, 2]).ranges.dtype == np.float32


def test_one_beam_needs_no_increment() -> None:
    assert len(make([1.0], angle_increment=0.0)) == 1


@pytest.mark.parametrize(
    "ranges",
    [[], [[1.0, 2.0]], 1.0, ["near", "far"], [1.0 + 2.0j], [None], np.zeros(MAX_BEAMS + 1)],
)
def test_invalid_ranges_are_refused(ranges: Any) -> None:
    with pytest.raises(ScanError, match="ranges"):
        make(ranges, angle_increment=1e-6)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"angle_min": math.nan}, "angle_min"),
        ({"angle_min": 2.1 * FULL_TURN}, "angle_min"),
        ({"angle_increment": 0.0}, "angle_increment"),
        ({"angle_increment": math.inf}, "angle_increment"),
        ({"angle_increment": 120.0}, "at most one turn"),
        ({"range_min": -0.1}, "range_min"),
        ({"range_min": math.nan}, "range_min"),
        ({"range_max": 0.2}, "range_max above range_min"),
        ({"range_max": math.nan}, "range_max above range_min"),
        ({"stamp": math.nan}, "stamp"),
    ],
)
def test_invalid_limits_are_refused(changes: dict[str, float], expected: str) -> None:
    with pytest.raises(ScanError, match=expected):
        make(**changes)


def test_a_hundred_thousand_beams_are_still_a_scan() -> None:
    assert len(make(np.ones(MAX_BEAMS), angle_increment=FULL_TURN / MAX_BEAMS)) == MAX_BEAMS
