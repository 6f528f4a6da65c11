"""``firstfix bench --track``."""

import json
from pathlib import Path

import pytest


@pytest.mark.usefixtures("in_this_process")
def test_cases_with_odometry_are_tracked_and_others_named(
    cli, cases: Path, drive: Path, tmp_path: Path
) -> None:
    ended = cli("bench", drive, cases, "--track", "--jobs", 2, "--out", "out/bench.json")
    assert ended.status == 0, ended
    assert "left out, because without odometry: alike, unique" in ended.err
    assert ended.out.startswith("| case ")
    document = json.loads((tmp_path / "out" / "bench.json").read_text())
    (row,) = document["cases"]
    assert (row["name"], row["n"], row["kept"]) == ("drive", 66, 1.0)
    assert row["rss_mb"] > 20.0
    assert document["total"]["all_kept"] == 1
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["bench.json"]


@pytest.mark.usefixtures("in_this_process")
def test_seed_and_parameters_reach_the_filter(cli, drive: Path, tmp_path: Path) -> None:
    (tmp_path / "amcl.yaml").write_text(
        "amcl: {ros__parameters: {min_particles: 50, max_particles: 60, random_seed: 3}}"
    )
    errors = []
    for options in ([], ["--seed", 3], ["--seed", 4]):
        arguments = ["--track", "--params", "amcl.yaml", "--out", "b.json", *options]
        assert cli("bench", drive, *arguments).status == 0
        (row,) = json.loads((tmp_path / "b.json").read_text())["cases"]
        assert 50 <= row["particles_mean"] <= 60
        errors.append(row["ape_rmse_m"])
    assert errors[0] == errors[1] != errors[2]


def test_files_that_do_not_fit_are_refused(cli, drive: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    cli("bench", drive, "--track", "--params", "nowhere.yaml").assert_refused("nowhere.yaml")
    cli("bench", drive, "--track", "--out", "file/b.json").assert_refused("file/b.json")


@pytest.mark.usefixtures("in_this_process")
def test_cases_without_any_odometry_are_refused(cli, cases: Path, tmp_path: Path) -> None:
    ended = cli("bench", cases / "unique", "--track", "--out", "b.json")
    assert (ended.status, ended.out) == (2, "")
    assert "expected cases with odometry, received only unique without" in ended.err
    assert not (tmp_path / "b.json").exists()
