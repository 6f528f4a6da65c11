"""``firstfix bench --suite``."""

import json
from functools import partial
from pathlib import Path

import pytest

from firstfix.lab.experiments.scaling import scaling_tasks
from firstfix.lab.metrics.paper_trial import Start


@pytest.mark.slow
def test_the_papers_experiments_are_run_and_reported(cli, tmp_path: Path) -> None:
    arguments = ["--worlds", "house", "--runs", 1, "--seed", 2]
    ended = cli("bench", "--suite", "paper", *arguments, "--out", "p.json", "--report", "out")
    assert ended.status == 0, ended
    assert "| house " in ended.out
    document = json.loads((tmp_path / "p.json").read_text())
    assert [row["start"] for row in document["totals"]] == [start.value for start in Start]
    assert {row["drives"] for row in document["rows"]} == {1}
    assert document["machine"]["cores"] >= 1
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"report.md", "house.png"}


@pytest.mark.slow
def test_steps_are_left_out_over_cases(cli, cases: Path, tmp_path: Path) -> None:
    drawn = ["--floors", 7]
    arguments = [cases / "unique", *drawn, "--limit", 2, "--out", "a.json", "--report", "out"]
    ended = cli("bench", "--suite", "ablation", *arguments)
    assert ended.status == 0, ended
    assert "verdict law" in ended.out
    document = json.loads((tmp_path / "a.json").read_text())
    assert {(row["kind"], row["n"]) for row in document["rows"]} == {("sim", 2), ("drawn", 2)}
    assert (tmp_path / "out" / "report.md").exists()


@pytest.mark.slow
def test_the_law_is_chosen_without_each_building(cli, cases: Path, tmp_path: Path) -> None:
    arguments = [cases / "unique", "--floors", "7-8", "--limit", 2, "--out", "c.json"]
    ended = cli("bench", "--suite", "calibration", *arguments, "--report", "out")
    assert ended.status == 0, ended
    assert "| recorded | chosen without it " in ended.out
    document = json.loads((tmp_path / "c.json").read_text())
    assert {row["building"] for row in document["rows"]} == {"hall", "floor_00007", "floor_00008"}
    assert {(row["scans"], row["wrong_map_scans"]) for row in document["rows"]} == {(2, 2)}
    assert (tmp_path / "out" / "report.md").exists()


@pytest.mark.slow
def test_costs_of_one_office_are_measured(
    cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("firstfix.lab.experiments.scaling._SCANS", 2)
    one_office = partial(scaling_tasks, offices=(1,), beams=(100,))
    monkeypatch.setattr("firstfix.lab.benchmarks.scaling_tasks", one_office)
    ended = cli("bench", "--suite", "scaling", "--out", "s.json", "--report", "out")
    assert "| paper " in ended.out
    document = json.loads((tmp_path / "s.json").read_text())
    assert [row["beams"] for row in document["beams"]] == [100, 100]
    assert [row["threads"] for row in document["threads"]] == [1, 2]
    assert (tmp_path / "out" / "scaling.png").exists()
