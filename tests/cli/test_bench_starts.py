"""``firstfix bench --starts`` and ``--sensor``."""

import json
from pathlib import Path

import pytest


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_starts_are_reported_by_sensor(cli, drive: Path, cases: Path, tmp_path: Path) -> None:
    sensors = ["--sensor", "60,3", "--sensor", "recorded"]
    arguments = ["--starts", "--runs", 2, "--seed", 1, "--out", "s.json", "--report", "out"]
    ended = cli("bench", drive, cases, *sensors, *arguments)
    assert ended.status == 0, ended
    assert "left out: unique (no odometry)" in ended.err
    document = json.loads((tmp_path / "s.json").read_text())
    assert [row["sensor"] for row in document["sensors"]] == ["60° x 3 m", "recorded"]
    assert [row["starts"] for row in document["sensors"]] == [2, 2]
    assert "| recorded " in ended.out
    assert (tmp_path / "out" / "way_to_first_pose.png").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_scans_are_located_by_every_sensor(cli, cases: Path, tmp_path: Path) -> None:
    sensors = ["--sensor", "recorded", "--sensor", "30,3"]
    ended = cli("bench", cases / "unique", "--limit", 2, *sensors, "--out", "b.json")
    assert ended.status == 0, ended
    document = json.loads((tmp_path / "b.json").read_text())
    assert [row["sensor"] for row in document["totals"]] == ["recorded", "30° x 3 m"]
    whole, narrow = document["sensors"]
    assert (whole["n"], narrow["n"]) == (2, 2)
    assert whole["unique"] == 1.0
    assert narrow["unique"] < 1.0
    assert "wrong when UNIQUE" in ended.out
