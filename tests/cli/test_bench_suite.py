"""``firstfix bench --suite``."""

import json
from pathlib import Path

import numpy as np
import pytest

from firstfix.cli.bench_scaling import bench_scaling
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.lab.experiments.paper_runner import (
    PAPER_WORLDS,
    at_home,
    follow_with_system,
    simulated_drive,
)
from firstfix.lab.experiments.starts import Start
from firstfix.lab.metrics.outcome import is_found
from firstfix.lab.simulation.floor import Floor


def test_the_origin_of_every_world_is_a_place_where_a_robot_can_be() -> None:
    for draw in PAPER_WORLDS.values():
        assert Floor(at_home(draw())).room_at(0.0, 0.0) > 0.18


def test_the_system_lives_through_a_drive(hall_plan: OccupancyGrid, driven: Recording) -> None:
    lived = follow_with_system(driven, hall_plan)
    assert lived.start is Start.SYSTEM
    assert [belief.stamp for belief in lived.beliefs] == [scan.stamp for scan in driven.scans]
    last = lived.beliefs[-1]
    assert last.T_map_base is not None
    assert is_found(last.T_map_base, last.truth)
    assert len(lived.last_cloud) > 0


def test_a_drive_is_as_long_as_asked_for_and_repeats(hall_plan: OccupancyGrid) -> None:
    once, again = (simulated_drive(hall_plan, 3, 4.0) for _ in range(2))
    assert len(once) == 40
    assert once.truth is not None
    assert again.truth is not None
    np.testing.assert_array_equal(once.truth, again.truth)


@pytest.mark.slow
def test_the_papers_experiments_are_run_and_told(cli, tmp_path: Path) -> None:
    arguments = ["--worlds", "house", "--runs", 1, "--seed", 2]
    ended = cli("bench", "--suite", "paper", *arguments, "--json", "p.json", "--report", "out")
    assert ended.status == 0, ended
    assert "| house " in ended.out
    document = json.loads((tmp_path / "p.json").read_text())
    assert [row["start"] for row in document["totals"]] == [start.value for start in Start]
    assert {row["drives"] for row in document["rows"]} == {1}
    assert document["machine"]["cores"] >= 1
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"report.md", "house.png"}


@pytest.mark.slow
def test_steps_are_left_out_over_cases(cli, cases: Path, tmp_path: Path) -> None:
    arguments = [cases / "unique", "--limit", 2, "--json", "a.json", "--report", "out"]
    ended = cli("bench", "--suite", "ablation", *arguments)
    assert ended.status == 0, ended
    assert "verdict law" in ended.out
    document = json.loads((tmp_path / "a.json").read_text())
    assert {row["n"] for row in document["rows"]} == {2}
    assert (tmp_path / "out" / "report.md").exists()


@pytest.mark.slow
def test_costs_of_one_office_are_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    json_file = tmp_path / "s.json"
    bench_scaling(seed=0, json_file=json_file, report=tmp_path / "out", offices=(1,), beams=(100,))
    assert "| paper " in capsys.readouterr().out
    document = json.loads(json_file.read_text())
    assert [row["beams"] for row in document["beams"]] == [100, 100]
    assert [row["threads"] for row in document["threads"]] == [1, 2]
    assert (tmp_path / "out" / "scaling.png").exists()


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--suite", "paper", "--worlds", "moon"], "'moon'"),
        (["--suite", "paper", "--wrong-map"], "--wrong-map"),
        (["--suite", "paper", "--limit", "3"], "--limit"),
        (["--suite", "paper", "--kidnap"], "--kidnap"),
        (["--suite", "paper", "--worlds", "house", "--json", "file/b.json"], "file/b.json"),
        (["--suite", "paper", "--worlds", "house", "--report", "file/out"], "file/out"),
        (["somewhere", "--suite", "paper"], "CASES"),
        (["somewhere", "--suite", "scaling"], "CASES"),
        (["--suite", "scaling", "--jobs", "2"], "--jobs"),
        (["--suite", "scaling", "--runs", "2"], "--runs"),
        (["--suite", "ablation"], "CASES"),
        (["--suite", "ablation", "--seed", "2"], "--seed"),
        (["--suite", "ablation", "nowhere"], "nowhere"),
        (["--runs", "3"], "--runs"),
        (["--track", "--runs", "3"], "--runs"),
        (["--kidnap", "--suite", "paper"], "--kidnap"),
    ],
)
def test_options_that_do_not_fit_are_refused(
    cli, tmp_path: Path, options: list[str], word: str
) -> None:
    (tmp_path / "file").write_text("in the way")
    ended = cli("bench", *options)
    assert (ended.status, ended.out) == (2, "")
    assert ended.err.startswith("firstfix: expected ")
    assert ended.err.count("\n") == 1
    assert word in ended.err
