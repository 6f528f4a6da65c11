"""The default method, put together again: whole it is the same, and without a step it is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.estimate import Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.config import LocateConfig
from firstfix.global_localization.locate import locate
from firstfix.global_localization.verdict import SEES_TOO_LITTLE
from firstfix.lab.experiments.ablation import (
    AblatedMatcher,
    Without,
    ablate_case,
    ablation_document,
    ablation_table,
)
from firstfix.lab.experiments.case import Case
from firstfix.lab.experiments.machine import this_machine
from firstfix.lab.metrics.outcome import is_found
from firstfix.lab.reports.suite_reports import write_ablation_report
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import identical_rooms

POSES = [SE2(3.0, 2.0, 0.5), SE2(7.5, 5.0, -2.0), SE2(4.5, 4.0, 3.0)]


@pytest.fixture(scope="module")
def fields(hall_plan: OccupancyGrid) -> MapFields:
    return MapFields(hall_plan)


@pytest.fixture(scope="module")
def scans(hall_plan: OccupancyGrid) -> list[LaserScan]:
    lidar, rng = Lidar(beams=180), np.random.default_rng(0)
    return [lidar.scan(hall_plan, pose, rng) for pose in POSES]


def half_of(scan: LaserScan) -> LaserScan:
    """Return a scan of a view of 180 degrees x 9 m, which sees too little to decide alone."""
    ranges = np.where(scan.ranges < 9.0, scan.ranges, np.inf)
    ranges[len(scan) // 2 :] = np.nan
    return replace(scan, ranges=ranges, range_max=9.0)


def test_without_nothing_it_is_the_default_method(
    fields: MapFields, scans: list[LaserScan]
) -> None:
    whole = AblatedMatcher(fields, Without.NOTHING)
    alike = MapFields(identical_rooms(2))
    lidar = Lidar(beams=90)
    twin = lidar.scan(alike.grid, SE2(2.0, 2.0, 1.0), np.random.default_rng(1))
    blind = LaserScan(np.full(90, np.inf), 0.0, 0.07, 0.1, 12.0)
    cases = [(whole, scan, fields) for scan in [*scans, half_of(scans[0]), blind]]
    for matcher, scan, prepared in [*cases, (AblatedMatcher(alike, Without.NOTHING), twin, alike)]:
        ours, theirs = matcher.locate(scan), locate((scan,), prepared, LocateConfig())
        assert (ours.verdict, ours.reason) == (theirs.verdict, theirs.reason)
        assert ours.search == theirs.search
        assert len(ours.hypotheses) == len(theirs.hypotheses)
        for a, b in zip(ours.hypotheses, theirs.hypotheses, strict=True):
            assert (a.pose, a.score, a.probability) == (b.pose, b.score, b.probability)
            assert a.evidence == b.evidence
            np.testing.assert_array_equal(a.covariance, b.covariance)


@pytest.mark.parametrize("without", list(Without))
def test_an_easy_place_is_found_without_any_one_step(
    fields: MapFields, scans: list[LaserScan], without: Without
) -> None:
    result = AblatedMatcher(fields, without).locate(scans[0])
    assert result.best is not None
    assert is_found(result.best.pose, POSES[0])


def test_without_its_rules_one_scan_decides_whatever_it_sees(
    fields: MapFields, scans: list[LaserScan]
) -> None:
    scan = half_of(scans[0])
    answers = [AblatedMatcher(fields, w).locate(scan) for w in (Without.NOTHING, Without.RULES)]
    assert [answer.verdict for answer in answers] == [Verdict.AMBIGUOUS, Verdict.UNIQUE]
    assert SEES_TOO_LITTLE in answers[0].reason


def test_a_search_without_a_score_finds_other_places(
    fields: MapFields, scans: list[LaserScan]
) -> None:
    scores = {
        without: AblatedMatcher(fields, without).locate(scans[0]).hypotheses[-1].score
        for without in (Without.NOTHING, Without.EXPECTED_RANGES, Without.END_POINTS)
    }
    assert len(set(scores.values())) > 1


@pytest.mark.parametrize("without", [Without.COST, Without.LAW])
def test_without_a_verdict_the_first_is_published(without: Without) -> None:
    fields = MapFields(identical_rooms(2))
    scan = Lidar(beams=90).scan(fields.grid, SE2(2.0, 2.0, 1.0), np.random.default_rng(0))
    result = AblatedMatcher(fields, without).locate(scan)
    assert result.verdict is Verdict.UNIQUE
    assert [hypothesis.probability for hypothesis in result.hypotheses[:2]] == [1.0, 0.0]


def test_a_case_is_tried_without_each_step(
    hall_plan: OccupancyGrid, scans: list[LaserScan], tmp_path: Path
) -> None:
    truth = np.array([pose.as_array() for pose in POSES])
    recording = Recording(tuple(scans), truth=truth)
    case = Case("hall", "hall", "sim", lambda: hall_plan, lambda: recording)
    runs = ablate_case(case, hall_plan, 2)
    assert [run.without for run in runs] == list(Without)
    assert all([o.index for o in run.outcomes] == [0, 2] for run in runs)
    document = ablation_document(runs) | {"machine": this_machine()}
    assert [row["without"] for row in document["rows"]] == [without.value for without in Without]
    assert {row["n"] for row in document["cases"]} == {2}
    table = ablation_table(document)
    assert len(table.splitlines()) == 2 + len(Without)
    assert table.strip() in write_ablation_report(document, tmp_path).read_text(encoding="utf-8")
