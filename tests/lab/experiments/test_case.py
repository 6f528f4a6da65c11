"""Cases: their truth, their scans, cut to smaller sensors, and the next other building."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.io.logs.npz import save_recording
from firstfix.io.maps.map_server import save_map
from firstfix.lab.experiments.case import (
    Case,
    SensorCut,
    evenly_spaced,
    find_cases,
    known_truth,
    next_elsewhere,
    parse_sensor,
)


@given(st.integers(1, 200), st.integers(1, 50))
def test_evenly_spaced_keeps_both_ends_and_repeats_nothing(n: int, limit: int) -> None:
    kept = evenly_spaced(np.arange(n), limit)
    assert len(kept) == min(n, limit)
    assert kept[0] == 0
    assert (np.diff(kept) > 0).all()
    if limit > 1:
        assert kept[-1] == n - 1


def test_no_limit_keeps_all() -> None:
    assert evenly_spaced(np.arange(7), 0).tolist() == list(range(7))


def test_the_next_case_elsewhere_goes_round_the_list(case: Case) -> None:
    a, b, c = (replace(case, name=n, site=s) for n, s in (("a", "x"), ("b", "x"), ("c", "y")))
    assert next_elsewhere([a, b, c], 0) is c
    assert next_elsewhere([a, b, c], 2) is a
    assert next_elsewhere([a, b], 0) is None


def test_a_case_needs_truth_somewhere(case: Case, cross: LaserScan) -> None:
    assert known_truth(case, case.recording()).shape == (5, 3)
    for truth in (None, np.full((1, 3), np.nan)):
        with pytest.raises(InputError, match="case hall with true poses"):
            known_truth(case, Recording((cross,), truth=truth))


def test_a_case_without_meta_is_named_after_its_folder(
    tmp_path: Path, case: Case, hall: OccupancyGrid
) -> None:
    folder = tmp_path / "nameless"
    folder.mkdir()
    save_map(hall, folder / "map.yaml")
    save_recording(case.recording(), folder / "scans.npz")
    for path in (folder, tmp_path):
        (found,) = find_cases([path])
        assert (found.name, found.site, found.kind) == ("nameless", "nameless", "unknown")


def scan_of(degrees: int, beams: int, first_deg: float) -> LaserScan:
    """A scan with ranges 0.1, 0.2 ... m."""
    ranges = 0.1 * np.arange(1, beams + 1)
    step = math.radians(degrees / beams)
    return LaserScan(ranges, math.radians(first_deg), step, 0.05, 30.0)


def test_a_cut_keeps_the_middle_of_the_view_and_the_range() -> None:
    scan = scan_of(180, 180, -90.0)
    cut = SensorCut(math.radians(60.0), 9.05).apply(scan)
    seen = ~np.isnan(cut.ranges)
    assert np.degrees(cut.bearings[seen]) == pytest.approx(np.arange(-30.0, 31.0))
    assert cut.range_max == 9.05
    assert np.isinf(cut.ranges[seen]).tolist() == (scan.ranges[seen] > 9.05).tolist()
    assert cut.ranges[seen & cut.hit].tolist() == scan.ranges[seen & cut.hit].tolist()


@pytest.mark.parametrize("first_deg", [0.0, -180.0, 90.0])
def test_a_cut_of_a_view_all_round_is_ahead_of_the_robot(first_deg: float) -> None:
    cut = SensorCut(math.radians(60.0), 50.0).apply(scan_of(360, 360, first_deg))
    ahead = np.degrees(cut.bearings[~np.isnan(cut.ranges)])
    assert np.sort((ahead + 180.0) % 360.0) == pytest.approx(np.arange(150.0, 211.0))


def test_a_sensor_that_sees_more_changes_nothing_that_was_measured() -> None:
    scan = scan_of(180, 180, -90.0)
    same = SensorCut(math.radians(360.0), 99.0).apply(scan)
    np.testing.assert_array_equal(same.ranges, scan.ranges)
    assert same.range_max == scan.range_max


def test_a_case_can_be_seen_by_another_sensor(case: Case) -> None:
    assert case.seen_by(None) is case
    narrow = case.seen_by(parse_sensor("60,5"))
    assert (narrow.name, narrow.sensor) == (case.name, "60° x 5 m")
    assert {scan.range_max for scan in narrow.recording().scans} == {5.0}


def test_recorded_is_the_sensor_as_it_is() -> None:
    assert parse_sensor("recorded") is None


@pytest.mark.parametrize("text", ["", "60", "60,5,1", "0,5", "361,5", "60,0", "60,inf", "nan,5"])
def test_other_sensors_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="--sensor FOV,RANGE"):
        parse_sensor(text)
