"""The figures of `firstfix bench CASES`, counted by hand."""

import json
from dataclasses import asdict

import pytest

from firstfix.core.estimate import Verdict
from firstfix.core.pose_error import PoseError
from firstfix.lab.experiments.locate_bench import CaseRun, WrongMapRun
from firstfix.lab.metrics.metrics import summarize
from firstfix.lab.metrics.outcome import NO_POSE, Outcome
from firstfix.lab.reports.locate_document import (
    bench_document,
    bench_table,
    buildings_table,
    sensors_table,
    wrong_map_table,
)
from firstfix.lab.reports.text import markdown_table

KEYS = {
    "name", "method", "sensor", "n", "success", "success_02", "recall_10", "unique", "wrong_unique",
    "median_m", "median_deg", "p95_m", "cpu_s", "cpu_s_p95", "wall_s", "prepare_s", "rss_mb",
}  # fmt: skip

HIT = Outcome(0, Verdict.UNIQUE, PoseError(0.02, 0.001), 1, 0.03, 0.04, 0.99)
WRONG = Outcome(1, Verdict.UNIQUE, PoseError(5.0, 0.001), None, 0.05, 0.06, 0.96)
LOST = Outcome(2, Verdict.NO_MATCH, NO_POSE, None, 0.01, 0.02, 0.0)


def run(name: str, method: str, *outcomes: Outcome, sensor: str = "recorded") -> CaseRun:
    return CaseRun(name, name, "sim", sensor, method, outcomes, 100.0, 0.5, 200.0)


def wrong(case: str, on: str, method: str, n: int, unique: int, *p: float) -> WrongMapRun:
    return WrongMapRun(case, case, "sim", "recorded", on, method, n, unique, p)


RUNS = [
    run("a", "fast", HIT, HIT, WRONG),
    run("b", "fast", LOST),
    run("a", "paper", WRONG),
]
WRONG_MAP = [
    wrong("a", "b", "fast", 3, 1, 0.97, 0.4, 0.0),
    wrong("b", "a", "fast", 1, 0, 0.3),
    wrong("a", "b", "paper", 3, 3, 1.0, 1.0, 1.0),
]
DOCUMENT = bench_document(RUNS, WRONG_MAP)


def test_the_document_has_the_agreed_keys_and_is_json() -> None:
    for row in [*DOCUMENT["cases"], DOCUMENT["total"]]:
        assert row.keys() >= KEYS
    assert DOCUMENT["total"].keys() >= KEYS
    assert json.loads(json.dumps(DOCUMENT, allow_nan=False)) == DOCUMENT


def test_the_document_has_the_figures_of_each_case() -> None:
    row = DOCUMENT["cases"][0]
    assert asdict(summarize(RUNS[0].outcomes)).items() <= row.items()
    assert (row["name"], row["method"], row["prepare_s"], row["rss_mb"]) == (
        "a",
        "fast",
        0.5,
        200.0,
    )
    assert DOCUMENT["cases"][1]["median_m"] is None


def test_totals_are_of_one_method_each_and_the_first_comes_first() -> None:
    total = DOCUMENT["total"]
    assert (total["name"], total["method"]) == ("total", "fast")
    assert (total["n"], total["wrong_unique"]) == (4, 1)
    assert total["success"] == pytest.approx((2 / 3 + 0) / 2)
    assert [t["method"] for t in DOCUMENT["totals"]] == ["fast", "paper"]
    assert DOCUMENT["wrong_map"] == {"n": 4, "unique": 1}
    assert len(DOCUMENT["wrong_map_cases"]) == 3


def test_no_wrong_map_is_nothing_counted() -> None:
    document = bench_document(RUNS)
    assert document["wrong_map"] == {"n": 0, "unique": 0}
    assert document["wrong_map_cases"] == []


def test_sensors_and_buildings_count_every_scan_alike() -> None:
    narrow = run("b", "fast", HIT, sensor="60° x 5 m")
    document = bench_document([*RUNS[:2], narrow], WRONG_MAP[:2])
    recorded, cut = document["sensors"]
    assert (recorded["sensor"], recorded["n"], recorded["wrong_unique"]) == ("recorded", 4, 1)
    assert recorded["wrong_of_unique"] == pytest.approx(1 / 3)
    assert (recorded["wrong_map_n"], recorded["wrong_map_unique"]) == (4, 0.25)
    assert (cut["sensor"], cut["n"], cut["wrong_map_unique"]) == ("60° x 5 m", 1, None)
    rows = [(row["site"], row["sensor"], row["n"]) for row in document["buildings"]]
    assert rows == [("a", "recorded", 3), ("b", "recorded", 1), ("b", "60° x 5 m", 1)]
    assert len(sensors_table(document).splitlines()) == 2 + 2
    assert len(buildings_table(document).splitlines()) == 2 + 3


def test_tables_show_every_row_aligned() -> None:
    lines = bench_table(DOCUMENT).splitlines()
    assert len(lines) == 2 + 3 + 2
    assert len({len(line) for line in lines}) == 1
    assert "66.7%" in lines[2]
    assert "–" in lines[3]
    assert len(wrong_map_table(DOCUMENT).splitlines()) == 2 + 3


def test_numbers_stand_right_and_words_left() -> None:
    table = markdown_table(["word", "number"], [["a", "10"], ["long word", "9"]])
    assert table.splitlines() == [
        "| word      | number |",
        "| --------- | -----: |",
        "| a         |     10 |",
        "| long word |      9 |",
    ]
