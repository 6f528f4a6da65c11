"""Scans with few valid beams, or with more than a map contains."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.core.angles import FULL_TURN
from firstfix.core.estimate import Verdict
from firstfix.core.scan import LaserScan
from firstfix.global_localization.config import Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_pose

LIDAR = Lidar(beams=360, sigma_m=0.01)


SILENT = {
    "NaN": math.nan,
    "zero": 0.0,
    "negative": -1.0,
    "too near": 0.01,
    "minus infinity": -math.inf,
    "no return": math.inf,
    "at the limit": 12.0,
}


@pytest.mark.parametrize("reading", SILENT.values(), ids=SILENT.keys())
@pytest.mark.parametrize("method", Method)
def test_a_scan_without_a_hit_is_no_match_with_a_reason(reading, method, draw_room):
    matcher = ScanMatcher(draw_room(0.25), method=method)
    scan = LaserScan(np.full(360, reading, np.float32), -np.pi, FULL_TURN / 360, 0.1, 12.0)
    result = matcher.locate(scan)
    assert result.verdict is Verdict.NO_MATCH
    assert "only 0 of 360 beams" in result.reason
    assert result.best is None
    assert not result.search.proven


@pytest.mark.parametrize("n", [1, 2, 7])
def test_a_handful_of_beams_is_too_few(n, office_locator):
    result = office_locator.locate(LaserScan(np.full(n, 2.0), 0.0, 0.5, 0.1, 12.0))
    assert result.verdict is Verdict.NO_MATCH
    assert f"only {n} of {n} beams" in result.reason


@pytest.mark.parametrize("n", [8, 20])
def test_few_beams_are_never_sure_of_a_wrong_place(n, office_locator, found):
    grid = office_locator.fields.grid
    for seed in range(10):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(grid, rng)
        result = office_locator.locate(Lidar(beams=n, sigma_m=0.01).scan(grid, truth, rng))
        assert result.verdict is not Verdict.UNIQUE or found(result, truth, 0.5, 10.0)


@pytest.mark.parametrize("n", [100, 2_000, 100_000])
def test_any_number_of_beams(n, office_locator, found):
    rng = np.random.default_rng(12)
    grid = office_locator.fields.grid
    truth = random_free_pose(grid, rng)
    result = office_locator.locate(Lidar(beams=n, sigma_m=0.01).scan(grid, truth, rng))
    assert result.verdict is Verdict.UNIQUE
    assert found(result, truth, 0.05, 0.5)


def test_ranges_far_beyond_the_map_are_no_trouble(room):
    ranges = np.full(90, 1.5, np.float32)
    ranges[::9] = [200.0, 1e4, 1e9, 1e30, 3e38] * 2
    scan = LaserScan(ranges, -np.pi, FULL_TURN / 90, 0.1, math.inf)
    assert ScanMatcher(room.grid).locate(scan).verdict is not Verdict.UNIQUE


def test_the_paper_takes_ranges_far_beyond_the_map_as_well(room):
    ranges = np.full(90, 1.5, np.float32)
    ranges[7] = 3e38
    scan = LaserScan(ranges, -np.pi, FULL_TURN / 90, 0.1, math.inf)
    assert ScanMatcher(room.grid, method=Method.PAPER).locate(scan).hypotheses
