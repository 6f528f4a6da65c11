"""The law of one scan, chosen without a building and judged there."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.estimate import Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.experiments.calibration import (
    CHOSEN,
    THE_PACKAGES,
    CalibrationRun,
    Claim,
    Law,
    calibration_document,
    calibration_tables,
    choose,
    claim,
    counted,
)
from firstfix.lab.reports.suite_reports import write_calibration_report
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import identical_rooms

POSE = SE2(3.0, 2.0, 0.5)


def claims(n: int, cost: float, rival: float, *, is_right: bool) -> tuple[Claim, ...]:
    return (Claim((cost, rival), 1.0, 0.0, is_right),) * n


def run(building: str, own: tuple[Claim, ...], elsewhere: tuple[Claim, ...] = ()) -> CalibrationRun:
    return CalibrationRun(building, "recorded", own, elsewhere)


def cut(scan: LaserScan, range_m: float, kept: slice) -> LaserScan:
    ranges = np.full(len(scan), np.nan, np.float32)
    ranges[kept] = np.where(scan.ranges < range_m, scan.ranges, np.inf)[kept]
    return replace(scan, ranges=ranges, range_max=range_m)


def test_the_packages_law_gives_the_packages_verdicts(hall_plan: OccupancyGrid) -> None:
    """For whole and cut scans, in a map that they fit and in one of identical rooms."""
    hall, rooms = ScanMatcher(hall_plan), ScanMatcher(identical_rooms(2))
    whole = Lidar(beams=180).scan(hall_plan, POSE, np.random.default_rng(0))
    alike = Lidar(beams=180).scan(rooms.fields.grid, POSE, np.random.default_rng(0))
    asked = [
        (hall, whole),
        (hall, cut(whole, 6.0, slice(0, 180))),
        (hall, cut(whole, 9.0, slice(0, 60))),
        (hall, cut(whole, 0.3, slice(0, 180))),
        (rooms, alike),
        (rooms, whole),
    ]
    got = [claim(matcher, scan, POSE) for matcher, scan in asked]
    verdicts = [matcher.locate(scan).verdict for matcher, scan in asked]
    assert [one.is_unique(THE_PACKAGES) for one in got] == [v is Verdict.UNIQUE for v in verdicts]
    assert {Verdict.UNIQUE, Verdict.AMBIGUOUS} <= set(verdicts)
    assert got[0].is_right
    assert not claim(hall, whole, None).is_right


def test_a_stricter_law_answers_less() -> None:
    some = Claim((0.2, 0.35), 1.0, 0.0, is_right=True)
    answers = [some.is_unique(Law(e, 0.2, 0.95)) for e in (6.0, 8.0, 10.0, 12.0, 17.0)]
    assert answers == sorted(answers)
    assert some.is_unique(Law(12.0, 0.1, 0.9))
    assert not some.is_unique(Law(12.0, 0.4, 0.99))
    assert not replace(some, needed=2.0).is_unique(Law(20.0, 0.1, 0.9))


def test_the_choice_avoids_errors_first_and_gaps_second() -> None:
    clear, narrow = claims(50, 0.1, 2.0, is_right=True), claims(50, 0.2, 0.3, is_right=True)
    lenient = choose([run("a", clear), run("b", narrow)])
    assert counted([run("b", narrow)], lenient)["unique"] == 50
    wrong = claims(5, 0.2, 0.3, is_right=False)
    strict = choose([run("a", clear), run("b", (*narrow, *wrong))])
    assert counted([run("a", (*clear, *wrong))], strict) == {
        "scans": 55,
        "unique": 50,
        "wrong": 0,
        "wrong_map_scans": 0,
        "wrong_map_unique": 0,
    }
    on_wrong_map = claims(5, 0.2, 0.3, is_right=False)
    also_strict = choose([run("a", clear), run("b", narrow, on_wrong_map)])
    assert counted([run("b", narrow, on_wrong_map)], also_strict)["wrong_map_unique"] == 0


def test_a_building_is_judged_by_a_law_that_never_saw_it(tmp_path: Path) -> None:
    """Its errors change the choice of the others, and not its own."""
    clear, narrow = claims(50, 0.1, 2.0, is_right=True), claims(50, 0.2, 0.3, is_right=True)
    wrong = claims(5, 0.2, 0.3, is_right=False)
    runs = [run("a", (*clear, *wrong)), run("b", narrow), run("c", clear)]
    document = calibration_document(runs)
    rows = {row["building"]: row for row in document["rows"] if row["law"] == CHOSEN}
    assert rows["a"]["wrong"] == 5
    assert rows["b"]["unique"] == 0
    assert rows["a"]["exponent"] > rows["b"]["exponent"] or rows["a"]["floor"] < rows["b"]["floor"]
    totals = [total for total in document["totals"] if total["law"] == CHOSEN]
    assert [(total["scans"], total["wrong"]) for total in totals] == [(155, 5)]
    totals_table, rows_table = calibration_tables(document)
    page = write_calibration_report(document, tmp_path).read_text(encoding="utf-8")
    assert totals_table.strip() in page
    assert rows_table.strip() in page


@pytest.mark.parametrize("share", [0.3, 1.0, 1.2])
def test_few_beams_are_less_sure_and_several_sensors_more(share: float) -> None:
    at_limit = [Claim((0.2, 0.2 + gap), share, 0.0, is_right=True) for gap in np.arange(0, 2, 0.01)]
    first = next(i for i, one in enumerate(at_limit) if one.is_unique(THE_PACKAGES))
    usual = [replace(one, share=1.0) for one in at_limit]
    as_usual = next(i for i, one in enumerate(usual) if one.is_unique(THE_PACKAGES))
    assert np.sign(first - as_usual) == -np.sign(share - 1.0)
