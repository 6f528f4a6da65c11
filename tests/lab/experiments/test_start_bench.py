"""Starts on drives: what is right, wrong and open, and which reports contain the true place."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.lab.experiments import start_bench
from firstfix.lab.experiments.case import Case, parse_sensor
from firstfix.lab.experiments.start_bench import Ending, StartRun, StartTask
from firstfix.lab.metrics.kidnap_trial import Instant

AWAY = SE2(0.0, 4.0, 0.0)


@pytest.fixture(scope="module")
def drive_case(hall_plan: OccupancyGrid, driven: Recording) -> Case:
    return Case("drive", "hall", "sim", lambda: hall_plan, lambda: driven)


@pytest.fixture
def started(case: Case, answer: Any) -> Any:
    def start(words: str) -> StartRun:
        """Judge a start of 1 m and 0.5 s a letter.

        p: the true pose is published; w: a wrong one; t: the true place is listed; e: other places
        with half of the probability; f: other places with all of it; -: nothing.
        """

        def instants() -> Iterator[Instant]:
            for i, word in enumerate(words):
                truth = SE2(float(i), 0.0, 0.0)
                shares = {"t": (truth, 0.5), "e": (AWAY, 0.5), "f": (AWAY, 1.0)}
                listed = None
                if word in shares:
                    pose, share = shares[word]
                    (place,) = answer(pose).hypotheses
                    listed = (replace(place, probability=share),)
                published = {"p": truth, "w": AWAY}.get(word)
                yield Instant(0.5 * i, truth, truth, published=published, places=listed, cpu_s=0.01)

        return start_bench._start(case, 3, instants())

    return start


@pytest.mark.parametrize(
    ("words", "ending", "way_m", "counts"),
    [
        ("p", Ending.RIGHT, 0.0, True),
        ("-tp", Ending.RIGHT, 2.0, True),
        ("tw", Ending.WRONG, 1.0, True),
        ("wp", Ending.WRONG, 0.0, True),
        ("----", Ending.OPEN, 3.0, False),
        ("------", Ending.OPEN, 5.0, True),
        (20 * "t", Ending.OPEN, 12.0, True),
    ],
)
def test_the_first_published_pose_decides_a_start(
    started: Any, words: str, ending: Ending, way_m: float, *, counts: bool
) -> None:
    run = started(words)
    assert (run.ending, run.way_m, run.time_s) == (ending, way_m, 0.5 * way_m)
    assert run.counts is counts
    assert len(run.cpu_ms) == run.scans == way_m + 1
    assert run.cpu_ms[0] == pytest.approx(10.0)


def test_reports_contain_the_true_place_or_leave_mass_elsewhere(started: Any) -> None:
    run = started("-tefp")
    assert (run.reports, run.listed, run.elsewhere) == (4, 2, 1)
    assert (run.case, run.site, run.sensor, run.scan) == ("hall", "here", "recorded", 3)


def test_a_drive_in_a_hall_is_found_at_once_and_places_depend_on_the_seed(
    drive_case: Case,
) -> None:
    runs = StartTask(drive_case, 2, 1)().runs
    assert [run.ending for run in runs] == [Ending.RIGHT] * 2
    assert {run.way_m for run in runs} == {0.0}
    narrow = drive_case.seen_by(parse_sensor("60,3"))
    assert [run.scan for run in StartTask(narrow, 2, 1)().runs] == [run.scan for run in runs]


def test_a_start_ends_with_its_run(drive_case: Case, driven: Recording) -> None:
    parted = replace(driven, runs=np.repeat([0, 1], [3, len(driven) - 3]))
    odometry = {i: SE2(0.1 * i, 0.0, 0.0) for i in range(len(driven)) if i != 1}
    seen = list(start_bench._observations(parted, odometry, 0))
    assert [observation.events[1] for observation in seen] == [driven.scans[0], driven.scans[2]]


def test_a_case_without_odometry_is_left_out_and_one_without_truth_is_refused(
    drive_case: Case, driven: Recording
) -> None:
    still = replace(drive_case, recording=lambda: replace(driven, odometry=None))
    assert StartTask(still, 2, 0)().left_out == "no odometry"
    blind = replace(drive_case, recording=lambda: replace(driven, truth=None))
    with pytest.raises(InputError, match="case drive with true poses"):
        StartTask(blind, 2, 0)()
