"""One method on one case, with a matcher that answers what the test wants."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.estimate import LocateResult, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import Method
from firstfix.lab.experiments import bench_method
from firstfix.lab.experiments import locate_bench as bench
from firstfix.lab.experiments.bench_method import OwnMethod
from firstfix.lab.experiments.case import Case


class Clairvoyant:
    """Answers every scan with one answer, and remembers what it was asked."""

    made: list[tuple[OccupancyGrid, Method, Path | None]]
    asked: list[LaserScan]
    answers: LocateResult

    def __init__(self, grid: OccupancyGrid, *, method: Method, cache_dir: Path | None) -> None:
        self.made.append((grid, method, cache_dir))

    def locate(self, scan: LaserScan) -> LocateResult:
        self.asked.append(scan)
        return self.answers


@pytest.fixture
def matcher(monkeypatch: pytest.MonkeyPatch, answer: Any, middle: SE2) -> type[Clairvoyant]:
    Clairvoyant.made, Clairvoyant.asked = [], []
    Clairvoyant.answers = answer(middle)
    monkeypatch.setattr(bench_method, "ScanMatcher", Clairvoyant)
    return Clairvoyant


def test_a_case_is_run_over_the_scans_whose_truth_is_known(
    case: Case, hall: OccupancyGrid, matcher: type[Clairvoyant]
) -> None:
    run = bench.CaseTask(case, OwnMethod(Method.PAPER))()
    assert (run.case, run.site, run.kind, run.sensor) == ("hall", "here", "sim", "recorded")
    assert run.method == "paper"
    assert [o.index for o in run.outcomes] == [0, 2, 3, 4]
    assert all(o.is_found and o.cpu_s >= 0.0 and o.wall_s >= 0.0 for o in run.outcomes)
    assert run.free_area_m2 == pytest.approx(hall.free_area)
    assert run.prepare_s >= 0.0
    assert run.rss_mb is not None
    assert run.rss_mb > 10.0


def test_the_kernels_are_compiled_first_and_no_cache_is_read(
    case: Case,
    hall: OccupancyGrid,
    matcher: type[Clairvoyant],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compiled: list[list[Method]] = []
    monkeypatch.setattr(bench_method, "precompile", lambda *, methods: compiled.append(methods))
    bench.CaseTask(case, OwnMethod(Method.FAST), limit=2)()
    assert compiled == [[Method.FAST]]
    assert matcher.made == [(hall, Method.FAST, None)]
    assert len(matcher.asked) == 2


def test_wrong_map_scans_need_no_truth_and_every_unique_is_counted(
    case: Case, cross: LaserScan, matcher: type[Clairvoyant]
) -> None:
    nameless = replace(case, recording=lambda: Recording((cross,) * 3))
    run = bench.WrongMapTask(nameless, replace(case, name="elsewhere"), OwnMethod(Method.FAST))()
    assert (run.case, run.on, run.n, run.unique) == ("hall", "elsewhere", 3, 3)
    matcher.answers = replace(matcher.answers, verdict=Verdict.AMBIGUOUS)
    assert bench.WrongMapTask(nameless, case, OwnMethod(Method.FAST), limit=2)().unique == 0


def test_a_case_without_truth_is_refused(case: Case, cross: LaserScan) -> None:
    with pytest.raises(InputError, match="true poses"):
        bench.CaseTask(
            replace(case, recording=lambda: Recording((cross,))), OwnMethod(Method.FAST)
        )()


def test_the_truth_counts_not_the_order(
    case: Case, matcher: type[Clairvoyant], answer: Any
) -> None:
    matcher.answers = answer(SE2(0.0, 0.0, 0.0), SE2(5.1, 3.0, 0.0))
    run = bench.CaseTask(case, OwnMethod(Method.FAST))()
    assert {o.rank for o in run.outcomes} == {2}
    assert np.allclose([o.error.metres for o in run.outcomes], 34**0.5)


def test_wrong_maps_are_those_of_the_next_other_building(case: Case) -> None:
    cases = [replace(case, name=n, site=n[0]) for n in ("x1", "x2", "y1")]
    pairs = [
        (t.case.name, t.on.name) for t in bench.wrong_map_tasks(cases, [OwnMethod(Method.FAST)], 0)
    ]
    assert pairs == [("x1", "y1"), ("x2", "y1"), ("y1", "x1")]
    assert bench.wrong_map_tasks(cases[:2], [OwnMethod(Method.FAST)], 0) == []
