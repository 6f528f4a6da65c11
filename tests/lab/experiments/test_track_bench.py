"""Cases followed from their true start, and the document of it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.lab.experiments.case import Case
from firstfix.lab.experiments.track_bench import (
    TrackRun,
    TrackTask,
    track_document,
    track_table,
)

KEYS = [
    "name", "sensor", "n", "updates", "ape_rmse_m", "ape_rmse_deg", "ape_median_m", "ape_max_m",
    "kept", "cpu_update_ms", "cpu_update_ms_p95", "particles_mean", "rss_mb",
    "rpe_rmse_m", "rpe_rmse_deg",
]  # fmt: skip


@pytest.fixture(scope="module")
def drive_case(hall_plan: OccupancyGrid, driven: Recording) -> Case:
    return Case("drive", "hall", "sim", lambda: hall_plan, lambda: driven)


@pytest.fixture(scope="module")
def run(drive_case: Case) -> TrackRun:
    return TrackTask(drive_case, AmclConfig(), 1)()


def test_a_case_is_tracked_from_its_true_start(run: TrackRun, driven: Recording) -> None:
    assert (run.case, run.notes) == ("drive", ())
    assert run.figures is not None
    assert run.figures.n == run.figures.scans == len(driven)
    assert run.figures.kept == 1.0
    assert run.rss_mb is not None
    assert run.rss_mb > 10.0


def test_a_case_without_odometry_is_left_out(drive_case: Case, driven: Recording) -> None:
    still = replace(drive_case, recording=lambda: replace(driven, odometry=None))
    left_out = TrackTask(still, AmclConfig(), 0)()
    assert left_out.figures is None


def test_a_case_without_truth_is_refused(drive_case: Case, driven: Recording) -> None:
    blind = replace(drive_case, recording=lambda: replace(driven, truth=None))
    with pytest.raises(InputError, match="case drive with true poses"):
        TrackTask(blind, AmclConfig(), 0)()


def test_the_document_has_the_agreed_keys_and_is_json(run: TrackRun) -> None:
    document = track_document([run, TrackRun("still", "recorded", None, (), None)])
    (row,) = document["cases"]
    assert list(row) == KEYS
    assert list(document["total"]) == [*KEYS, "all_kept"]
    assert list(document) == ["cases", "total"]
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_totals_are_sums_of_counts_and_means_of_the_rest(run: TrackRun) -> None:
    assert run.figures is not None
    assert run.figures.ape is not None
    worse = replace(run.figures, kept=0.5, n=10, updates=4)
    worse = replace(worse, ape=replace(run.figures.ape, max_m=run.figures.ape.max_m + 2.0))
    blind = replace(run, case="blind", rss_mb=None, figures=replace(run.figures, rpe=None))
    total = track_document([run, replace(run, case="worse", figures=worse), blind])["total"]
    assert (total["name"], total["all_kept"]) == ("total", 2)
    assert total["n"] == 2 * run.figures.n + 10
    assert total["updates"] == 2 * run.figures.updates + 4
    assert total["kept"] == pytest.approx(2.5 / 3)
    assert total["ape_max_m"] == pytest.approx(run.figures.ape.max_m + 2.0 / 3)
    assert total["rss_mb"] == pytest.approx(run.rss_mb)
    assert run.figures.rpe is not None
    assert total["rpe_rmse_m"] == pytest.approx(run.figures.rpe.rmse_m)


def test_the_table_shows_every_row_aligned(run: TrackRun) -> None:
    assert run.figures is not None
    short = replace(run, case="short", figures=replace(run.figures, rpe=None))
    lines = track_table(track_document([run, short])).splitlines()
    assert len(lines) == 2 + 2 + 1
    assert len({len(line) for line in lines}) == 1
    assert "–" in lines[3]


def test_a_first_scan_without_truth_is_waited_for(drive_case: Case, driven: Recording) -> None:
    assert driven.truth is not None
    truth = driven.truth.copy()
    truth[:3] = np.nan
    late = replace(drive_case, recording=lambda: replace(driven, truth=truth))
    run = TrackTask(late, AmclConfig(), 0)()
    assert run.figures is not None
    assert run.figures.n == len(driven) - 3
    assert len(run.notes) == 1
