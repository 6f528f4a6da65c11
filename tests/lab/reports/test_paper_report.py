"""Attempts in figures, counted by hand, and their pictures and report."""

import json
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.metrics.paper_trial import (
    NO_CLOUD,
    Attempt,
    Belief,
    Ending,
    Start,
    judge_attempt,
)
from firstfix.lab.reports.paper_picture import Shown, draw_starts
from firstfix.lab.reports.paper_report import (
    details_table,
    paper_document,
    paper_table,
    worlds_table,
    write_paper_report,
)

AWAY = SE2(-3.0, 1.0, 0.0)


def attempt_of(words: str, start: Start = Start.FAST) -> Attempt:
    """Make an attempt of one second and one metre a letter.

    r: right; w: certain of a wrong place; u: a wrong place, not certain; -: no pose.
    """
    beliefs = []
    for i, word in enumerate(words):
        truth = SE2(float(i), 0.0, 0.0)
        pose = {"r": truth, "-": None}.get(word, truth @ AWAY)
        beliefs.append(Belief(float(i), truth, pose, sure=word in "rw", cpu_s=0.01))
    return Attempt(start, 0.5, tuple(beliefs), NO_CLOUD, NO_CLOUD)


@pytest.mark.parametrize(
    ("words", "ending", "time_s", "misled_s"),
    [
        ("rrrrrrr", Ending.RIGHT, 0.0, 0.0),
        ("rr", Ending.RIGHT, 0.0, 0.0),
        ("-urrrrrrr", Ending.RIGHT, 2.0, 0.0),
        ("wwrrrrrrr", Ending.RIGHT, 2.0, 2.0),
        ("rrrwrrrrrrr", Ending.RIGHT, 4.0, 1.0),
        ("rrrrrrrww", Ending.WRONG, None, 1.0),
        ("rrrrrrruu", Ending.OPEN, None, 0.0),
        ("-------", Ending.OPEN, None, 0.0),
        ("wwwwwwwrr", Ending.OPEN, None, 7.0),
    ],
)
def test_how_an_attempt_ends(
    words: str, ending: Ending, time_s: float | None, misled_s: float
) -> None:
    trial = judge_attempt("hall", 3, attempt_of(words))
    assert (trial.world, trial.seed, trial.start) == ("hall", 3, Start.FAST)
    assert (trial.ending, trial.time_s, trial.driven_m) == (ending, time_s, time_s)
    assert trial.misled_s == misled_s


@pytest.mark.parametrize(("words", "scans"), [("rrrr", 1), ("--rr", 3), ("----", 4)])
def test_the_start_costs_the_map_and_all_scans_up_to_the_first_pose(words: str, scans: int) -> None:
    trial = judge_attempt("hall", 0, attempt_of(words))
    assert trial.start_cpu_s == pytest.approx(0.5 + 0.01 * scans)
    assert trial.cpu_ms_per_scan == pytest.approx(10.0 if scans < 4 else 0.0)


@pytest.fixture
def document() -> dict[str, object]:
    trials = [
        judge_attempt(world, seed, attempt_of(words, start))
        for world, seed, start, words in (
            ("hall", 0, Start.UNIFORM, "wwwwwwww"),
            ("hall", 0, Start.FAST, "--rrrrrrr"),
            ("hall", 1, Start.UNIFORM, "uuuuuuuu"),
            ("hall", 1, Start.FAST, "rrrrrrrrr"),
            ("house", 0, Start.UNIFORM, "urrrrrrrr"),
            ("house", 0, Start.FAST, "---------"),
        )
    ]
    return paper_document(trials, 0, 8.0)


def test_worlds_and_ways_are_counted(document: dict) -> None:
    assert (document["drives"], document["drive_s"]) == (2, 8.0)
    counts = [
        [row[key] for key in ("world", "start", "drives", "right", "wrong", "open", "misled")]
        for row in document["rows"]
    ]
    assert counts == [
        ["hall", "uniform", 2, 0, 1, 1, 1],
        ["hall", "fast", 2, 2, 0, 0, 0],
        ["house", "uniform", 1, 1, 0, 0, 0],
        ["house", "fast", 1, 0, 0, 1, 0],
    ]
    fast = document["rows"][1]
    assert (fast["time_s"], fast["time_s_max"], fast["driven_m"]) == (1.0, 2.0, 1.0)
    assert document["rows"][3]["time_s"] is None
    assert [row["right"] for row in document["totals"]] == [1, 2]
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_tables_show_every_row(document: dict) -> None:
    assert "1 / 0 / 0" in worlds_table(document)
    for table, rows in (
        (paper_table(document), 2),
        (worlds_table(document), 2),
        (details_table(document), 4),
    ):
        lines = table.splitlines()
        assert len(lines) == 2 + rows
        assert len({len(line) for line in lines}) == 1


@pytest.fixture
def shown(hall: OccupancyGrid, cross: LaserScan, middle: SE2) -> Shown:
    def estimated(start: Start, *poses: SE2 | None) -> Attempt:
        beliefs = [Belief(float(i), middle, pose, False, 0.0) for i, pose in enumerate(poses)]
        cloud = np.array([[1.0, 1.0, 0.0]]) if poses[-1] else NO_CLOUD
        return Attempt(start, 0.0, tuple(beliefs), cloud, cloud)

    attempts = (
        estimated(Start.UNIFORM, SE2(2.0, 2.0, 1.0), SE2(8.0, 2.0, 1.0)),
        estimated(Start.BY_HAND, middle, middle),
        estimated(Start.SYSTEM, None, None),
    )
    return Shown("hall", 4, hall, (cross, cross), attempts)


@pytest.mark.slow
def test_a_drive_becomes_a_picture(tmp_path: Path, shown: Shown) -> None:
    assert draw_starts(shown, tmp_path / "hall.png").stat().st_size > 5000


@pytest.mark.slow
def test_the_report_has_tables_ways_and_pictures(
    tmp_path: Path, shown: Shown, document: dict
) -> None:
    page = write_paper_report([shown], document, tmp_path / "report")
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# firstfix bench --suite paper")
    assert details_table(document).strip() in text
    assert "- *uniform*: " in text
    assert "- *by hand*: " not in text
    assert "![hall](hall.png)" in text
    assert (page.parent / "hall.png").exists()
