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
from firstfix.lab.experiments import case_runs as runs
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
    monkeypatch.setattr(runs, "ScanMatcher", Clairvoyant)
    return Clairvoyant


def test_a_case_is_run_over_the_scans_whose_truth_is_known(
    case: Case, hall: OccupancyGrid, matcher: type[Clairvoyant]
) -> None:
    run = runs.run_case(case, Method.PAPER)
    assert (run.case, run.site, run.kind, run.method) == ("hall", "here", "sim", Method.PAPER)
    assert [o.index for o in run.outcomes] == [0, 2, 3, 4]
    assert all(o.is_found and o.cpu_s >= 0.0 and o.wall_s >= 0.0 for o in run.outcomes)
    assert run.free_area_m2 == pytest.approx(hall.free_area)
    assert run.prepare_s >= 0.0
    assert run.rss_mb is not None
    assert run.rss_mb > 10.0


def test_it_warms_up_elsewhere_first_and_never_reads_a_cache(
    case: Case, hall: OccupancyGrid, matcher: type[Clairvoyant]
) -> None:
    runs.run_case(case, Method.FAST, limit=2)
    (small, _, _), (grid, method, _) = matcher.made
    assert small is not hall
    assert (grid, method) == (hall, Method.FAST)
    assert all(cache_dir is None for _, _, cache_dir in matcher.made)
    warm, *own = matcher.asked
    assert warm.hit.any()
    assert len(own) == 2


def test_wrong_map_scans_need_no_truth_and_every_unique_is_counted(
    case: Case, cross: LaserScan, matcher: type[Clairvoyant]
) -> None:
    nameless = replace(case, recording=lambda: Recording((cross,) * 3))
    run = runs.run_wrong_map(nameless, replace(case, name="elsewhere"), Method.FAST)
    assert (run.case, run.on, run.n, run.unique) == ("hall", "elsewhere", 3, 3)
    matcher.answers = replace(matcher.answers, verdict=Verdict.AMBIGUOUS)
    assert runs.run_wrong_map(nameless, case, Method.FAST, limit=2).unique == 0


def test_a_case_without_truth_is_refused(case: Case, cross: LaserScan) -> None:
    with pytest.raises(InputError, match="true poses"):
        runs.run_case(replace(case, recording=lambda: Recording((cross,))), Method.FAST)


def test_the_truth_counts_not_the_order(
    case: Case, matcher: type[Clairvoyant], answer: Any
) -> None:
    matcher.answers = answer(SE2(0.0, 0.0, 0.0), SE2(5.1, 3.0, 0.0))
    run = runs.run_case(case, Method.FAST)
    assert {o.rank for o in run.outcomes} == {2}
    assert np.allclose([o.error.metres for o in run.outcomes], 34**0.5)
