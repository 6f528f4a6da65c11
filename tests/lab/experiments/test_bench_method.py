"""Other localizers in the benchmark: a function, and a file of poses."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.bench_method import (
    NO_ANSWER,
    Estimates,
    OwnMethod,
    parse_method,
    read_estimates,
)
from firstfix.lab.experiments.case import Case
from firstfix.lab.experiments.locate_bench import CaseTask
from firstfix.lab.metrics.outcome import Answer

HEADER = "case,scan,x,y,yaw,confidence\n"


@pytest.fixture
def theirs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Write a module of somebody else into the working folder."""

    def write(body: str) -> None:
        (tmp_path / "their_localizer.py").write_text(f"def locate(grid, scan):\n    {body}\n")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "their_localizer", raising=False)
    return write


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("return None", NO_ANSWER),
        ("return (1, 2, 0.5)", Answer((SE2(1.0, 2.0, 0.5),), 1.0, Verdict.UNIQUE)),
        ("return [1.0, 2.0, 0.5], 0.99", Answer((SE2(1.0, 2.0, 0.5),), 0.99, Verdict.UNIQUE)),
        ("return (1, 2, 0.5), 0.3", Answer((SE2(1.0, 2.0, 0.5),), 0.3, Verdict.AMBIGUOUS)),
    ],
)
def test_a_function_of_map_and_scan_is_a_method(
    theirs, body: str, expected: Answer, hall: OccupancyGrid, cross: LaserScan
) -> None:
    theirs(body)
    method = parse_method("their_localizer:locate")
    assert method.name == "their_localizer:locate"
    assert method.prepare("hall", hall)(0, cross) == expected


def test_a_function_is_judged_like_ours(theirs, case: Case, middle: SE2) -> None:
    theirs(f"return {middle.as_array().tolist()}")
    run = CaseTask(case, parse_method("their_localizer:locate"))()
    assert run.method == "their_localizer:locate"
    assert all(outcome.is_found and outcome.probability == 1.0 for outcome in run.outcomes)


@pytest.mark.parametrize(
    "body", ["return 'here'", "return (1, 2)", "return (1, 2, float('nan'))", "return (1, 2, 3), 7"]
)
def test_answers_that_are_no_pose_are_refused(
    theirs, body: str, hall: OccupancyGrid, cross: LaserScan
) -> None:
    theirs(body)
    with pytest.raises(InputError, match="return one of these"):
        parse_method("their_localizer:locate").prepare("hall", hall)(0, cross)


def test_a_function_that_fails_is_named_with_the_scan(
    theirs, hall: OccupancyGrid, cross: LaserScan
) -> None:
    theirs("return 1 / 0")
    with pytest.raises(InputError, match=r"their_localizer:locate.*ZeroDivisionError at scan 3"):
        parse_method("their_localizer:locate").prepare("hall", hall)(3, cross)


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("their_localizer:other", "AttributeError"),
        ("no_such_module:locate", "ModuleNotFoundError"),
        ("their_localizer:__name__", "as a function"),
        (":", "cannot|imported"),
        ("quick", "fast, paper"),
    ],
)
def test_what_cannot_be_imported_is_refused(theirs, name: str, word: str) -> None:
    theirs("return None")
    with pytest.raises(InputError, match=word):
        parse_method(name)


def test_our_own_methods_go_by_their_names() -> None:
    assert isinstance(parse_method("paper"), OwnMethod)


def test_given_poses_are_judged_like_answers(case: Case, middle: SE2, tmp_path: Path) -> None:
    path = tmp_path / "peer.csv"
    x, y, yaw = middle.as_array()
    path.write_text(
        f"{HEADER}hall,0,{x},{y},{yaw},0.99\nhall,2,{x + 5},{y},{yaw},\nelsewhere,3,0,0,0,1\n"
    )
    run = CaseTask(case, Estimates(path))()
    assert run.method == "peer"
    assert {o.index: o.verdict.value for o in run.outcomes} == {
        0: "UNIQUE",
        2: "UNIQUE",
        3: "NO_MATCH",
        4: "NO_MATCH",
    }
    assert [o.is_found for o in run.outcomes] == [True, False, False, False]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("scan,x,y,yaw\n1,2,3,4\n", "none named case"),
        ("", "none named case"),
        (HEADER + "hall,one,2,3,4,1\n", "line 2"),
        (HEADER + "hall,1,2,3,inf,1\n", "line 2"),
        (HEADER + "hall,1,2,3\n", "line 2"),
        (HEADER + "hall,1,2,3,4,1.5\n", "confidence"),
        (HEADER + "hall,1,2,3,4,1\nhall,1,2,3,4,1\n", "twice"),
        (HEADER + 'hall,1,"' + "9" * 200_000 + '",3,4,1\n', "CSV"),
    ],
)
def test_damaged_files_are_refused(text: str, word: str, tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=word) as refused:
        read_estimates(path)
    assert len(str(refused.value)) < 1000


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="as CSV"):
        read_estimates(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00case")
    with pytest.raises(InputError, match="as CSV"):
        read_estimates(tmp_path / "bytes.csv")
