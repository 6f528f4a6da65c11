"""Which tasks a benchmark has, and what its document says."""

import json
from dataclasses import asdict, replace
from functools import partial

import numpy as np
import pytest

from firstfix.core.errors import InputError, MapError
from firstfix.core.estimate import Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.pose_error import PoseError
from firstfix.core.recording import Recording
from firstfix.global_localization.config import Method
from firstfix.lab.experiments.case import Case
from firstfix.lab.experiments.case_runs import CaseRun, WrongMapRun
from firstfix.lab.experiments.case_tasks import case_tasks, run_tasks, wrong_map_tasks
from firstfix.lab.metrics.metrics import summarize
from firstfix.lab.metrics.outcome import NO_POSE, Outcome
from firstfix.lab.reports.document import bench_document
from firstfix.lab.reports.tables import bench_table, markdown_table, wrong_map_table

KEYS = {
    "name", "method", "n", "success", "success_02", "recall_10", "unique", "wrong_unique",
    "median_m", "median_deg", "p95_m", "cpu_s", "cpu_s_p95", "wall_s", "prepare_s", "rss_mb",
}  # fmt: skip

HIT = Outcome(0, Verdict.UNIQUE, PoseError(0.02, 0.001), 1, 0.03, 0.04, 0.99)
WRONG = Outcome(1, Verdict.UNIQUE, PoseError(5.0, 0.001), None, 0.05, 0.06, 0.96)
LOST = Outcome(2, Verdict.NO_MATCH, NO_POSE, None, 0.01, 0.02, 0.0)


def run(name: str, method: Method, *outcomes: Outcome) -> CaseRun:
    return CaseRun(name, name, "sim", method, outcomes, 100.0, 0.5, 200.0)


RUNS = [
    run("a", Method.FAST, HIT, HIT, WRONG),
    run("b", Method.FAST, LOST),
    run("a", Method.PAPER, WRONG),
]
WRONG_MAP = [
    WrongMapRun("a", "b", Method.FAST, 3, 1, "real", (0.97, 0.4, 0.0)),
    WrongMapRun("b", "a", Method.FAST, 1, 0, "sim", (0.3,)),
    WrongMapRun("a", "b", Method.PAPER, 3, 3, "real", (1.0, 1.0, 1.0)),
]
METHODS = [Method.FAST, Method.PAPER]
DOCUMENT = bench_document(RUNS, WRONG_MAP, METHODS)


def test_every_case_meets_every_method(case: Case) -> None:
    other = replace(case, name="other", site="there")
    tasks = case_tasks([case, other], METHODS, 3)
    assert [(t.case.name, t.method.value) for t in tasks] == [
        ("hall", "fast"), ("other", "fast"), ("hall", "paper"), ("other", "paper"),
    ]  # fmt: skip
    assert {t.limit for t in tasks} == {3}


def test_wrong_maps_are_those_of_the_next_other_building(case: Case) -> None:
    cases = [replace(case, name=n, site=n[0]) for n in ("x1", "x2", "y1")]
    pairs = [(t.case.name, t.on.name) for t in wrong_map_tasks(cases, [Method.FAST], 0)]
    assert pairs == [("x1", "y1"), ("x2", "y1"), ("y1", "x1")]
    assert wrong_map_tasks(cases[:2], [Method.FAST], 0) == []


@pytest.mark.slow
def test_a_case_that_cannot_be_loaded_ends_the_benchmark() -> None:
    unloadable = Case(
        "broken",
        "here",
        "sim",
        partial(OccupancyGrid, np.zeros((0, 0)), 1.0),
        partial(Recording, ()),
    )
    with pytest.raises(InputError, match="at least one scan"):
        run_tasks(case_tasks([unloadable], [Method.FAST], 0), 1, print)
    wrong_map = wrong_map_tasks([unloadable, replace(unloadable, site="there")], [Method.FAST], 0)
    with pytest.raises((MapError, InputError)):
        run_tasks(wrong_map, 2, print)


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
    document = bench_document(RUNS, [], METHODS)
    assert document["wrong_map"] == {"n": 0, "unique": 0}
    assert document["wrong_map_cases"] == []


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
