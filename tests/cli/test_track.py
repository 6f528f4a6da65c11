"""``firstfix track``."""

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firstfix.io.logs.tum import load_trajectory
from firstfix.io.saved_pose import load_pose

KEYS = [
    "start", "end", "skipped", "restarts", "scans", "updates", "duration_s", "way_m",
    "particles_mean", "cpu_update_ms", "cpu_update_ms_p95", "n", "kept", "ape", "rpe",
]  # fmt: skip
ERRORS = ["rmse_m", "median_m", "max_m", "rmse_deg", "median_deg", "max_deg"]


def strict_json(text: str) -> dict[str, Any]:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    (line,) = text.splitlines()
    document = json.loads(line, parse_constant=refuse)
    assert isinstance(document, dict)
    return document


def changed(drive: Path, folder: Path, **changes: object) -> Path:
    """The log of the drive with other arrays, or without where they are None."""
    with np.load(drive / "scans.npz") as log:
        kept = dict(log) | changes
    path = folder / "changed.npz"
    np.savez(path, **{name: array for name, array in kept.items() if array is not None})
    return path


@pytest.fixture
def files(drive: Path) -> tuple[Path, Path]:
    return drive / "map.yaml", drive / "scans.npz"


def test_a_drive_is_described_in_text(cli, files: tuple[Path, Path]) -> None:
    ended = cli("track", *files)
    assert ended.status == 0
    printed = f"\n{ended.out}"
    for word in ("scans ", "drive ", "end ", "σ ", "elsewhere ", "particles ", "CPU ", "kept "):
        assert f"\n{word}" in printed
    assert "\nAPE          RMSE 0.0" in printed
    assert "\nRPE          RMSE 0.0" in printed
    assert "100.0% of 66 scans within 0.5 m and 10° of the truth" in printed
    assert ended.err == "note: starting at the first true pose of the log\n"


def test_json_has_the_agreed_keys(cli, files: tuple[Path, Path]) -> None:
    ended = cli("track", *files, "--json", "--start", "truth")
    assert ended.status == 0
    document = strict_json(ended.out)
    assert list(document) == KEYS
    assert list(document["start"]) == ["origin", "pose", "stamp"]
    assert list(document["end"]) == ["pose", "covariance", "elsewhere", "stamp"]
    assert list(document["ape"]) == list(document["rpe"]) == ERRORS
    assert document["start"]["origin"] == "truth"
    assert document["start"]["pose"] == pytest.approx([1.5, 1.5, 0.0])
    assert (document["start"]["stamp"], document["end"]["stamp"]) == pytest.approx((100.0, 106.5))
    assert (document["n"], document["scans"], document["skipped"]) == (66, 66, 0)
    assert document["kept"] == 1.0
    assert document["ape"]["max_m"] < 0.15
    assert document["way_m"] == pytest.approx(5.5 * 1.03, abs=0.01)
    assert document["duration_s"] == pytest.approx(6.5)
    assert np.shape(document["end"]["covariance"]) == (3, 3)


def test_without_truth_there_is_nothing_to_compare(
    cli, files: tuple[Path, Path], drive: Path, tmp_path: Path
) -> None:
    log = changed(drive, tmp_path, true_pose=None)
    document = strict_json(cli("track", files[0], log, "--json", "--start", "1.5,1.5,0").out)
    assert (document["n"], document["kept"], document["ape"], document["rpe"]) == (
        0,
        None,
        None,
        None,
    )
    assert "truth" not in cli("track", files[0], log, "--start", "1.5,1.5,0").out


@pytest.mark.parametrize(
    "start",
    [["--start", "-0.2,1.5,-0.5"], ["--start=-0.2,1.5,-0.5"], ["--start", "-.2, 1.5,-5e-1"]],
)
def test_a_start_may_be_negative(cli, files: tuple[Path, Path], start: list[str]) -> None:
    document = strict_json(cli("track", *files, *start, "--json").out)
    assert document["start"]["origin"] == "given"
    assert document["start"]["pose"] == pytest.approx([-0.2, 1.5, -0.5])


def test_the_trajectory_has_a_pose_for_every_scan(
    cli, files: tuple[Path, Path], tmp_path: Path
) -> None:
    document = strict_json(cli("track", *files, "--out", "new/drive.tum", "--json").out)
    trajectory = load_trajectory(tmp_path / "new" / "drive.tum")
    np.testing.assert_allclose(trajectory.stamps, 100.0 + 0.1 * np.arange(66))
    np.testing.assert_allclose(trajectory.poses[-1], document["end"]["pose"], atol=1e-9)


@pytest.mark.slow
def test_the_picture_is_drawn_where_it_was_asked_for(
    cli, files: tuple[Path, Path], tmp_path: Path
) -> None:
    ended = cli("track", *files, "--plot", "track.png", "--json")
    assert f"picture: {tmp_path / 'track.png'}" in ended.err
    assert (tmp_path / "track.png").stat().st_size > 5000
    strict_json(ended.out)


@pytest.fixture
def crowded(files: tuple[Path, Path], drive: Path, tmp_path: Path) -> tuple[Path, Path]:
    """From the tenth scan on, people stand around the robot: the particles alone know its pose."""
    with np.load(drive / "scans.npz") as log:
        ranges = log["ranges"].copy()
    hidden = slice(0, int(0.85 * ranges.shape[1]))
    ranges[10:, hidden] = np.minimum(ranges[10:, hidden], 0.4)
    return files[0], changed(drive, tmp_path, ranges=ranges)


def test_one_seed_is_one_track_and_the_parameters_name_one(
    cli, crowded: tuple[Path, Path], tmp_path: Path
) -> None:
    (tmp_path / "amcl.yaml").write_text("amcl:\n  ros__parameters:\n    random_seed: 4\n")
    options = (["--seed", 4], ["--params", "amcl.yaml"], ["--seed", 5], [])
    ends = [
        tuple(strict_json(cli("track", *crowded, "--json", *option).out)["end"]["pose"])
        for option in options
    ]
    assert ends[0] == ends[1]
    assert len(set(ends)) == 3


def test_parameters_of_nav2_are_obeyed(cli, files: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "amcl.yaml").write_text(
        "amcl:\n  ros__parameters:\n    min_particles: 50\n    max_particles: 60\n"
        "    set_initial_pose: true\n    initial_pose: {x: 1.4, y: 1.6, z: 0.0, yaw: 0.1}\n"
    )
    options = ["--params", "amcl.yaml", "--json"]
    document = strict_json(cli("track", *files, *options).out)
    assert 50 <= document["particles_mean"] <= 60
    assert document["start"]["origin"] == "parameters"
    assert document["start"]["pose"] == pytest.approx([1.4, 1.6, 0.1])
    truth = strict_json(cli("track", *files, *options, "--start", "truth").out)
    assert truth["start"]["origin"] == "truth"


def test_a_saved_pose_begins_the_next_part_of_a_drive(
    cli, files: tuple[Path, Path], drive: Path, tmp_path: Path
) -> None:
    with np.load(drive / "scans.npz") as log:
        arrays = dict(log)
    for name, part in (("first", slice(0, 40)), ("second", slice(40, None))):
        cut = {key: arrays[key][part] for key in ("ranges", "stamp", "odom")}
        np.savez(
            tmp_path / f"{name}.npz", **(arrays | cut | {"true_pose": arrays["true_pose"][part]})
        )
    assert cli("track", files[0], "first.npz", "--save-pose", "last.json").status == 0
    saved = load_pose(tmp_path / "last.json")
    assert saved.stamp == pytest.approx(103.9)
    assert saved.T_odom_base is not None
    ended = cli("track", files[0], "second.npz", "--start", "last.json", "--json")
    assert ended.status == 0, ended
    assert "moved along with odometry" in ended.err
    document = strict_json(ended.out)
    assert document["start"]["origin"] == "saved"
    assert document["ape"]["max_m"] < 0.3


def test_the_pose_is_saved_at_the_rate_of_the_parameters(
    cli, files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stamps: list[float] = []
    monkeypatch.setattr(
        "firstfix.ros.pose_memory.save_pose", lambda path, saved: stamps.append(saved.stamp)
    )
    cli("track", *files, "--save-pose", "last.json")
    np.testing.assert_allclose(stamps, [102.0, 104.0, 106.0, 106.5], atol=0.11)
    stamps.clear()
    (tmp_path / "never.yaml").write_text("amcl: {ros__parameters: {save_pose_rate: -1.0}}")
    cli("track", *files, "--save-pose", "last.json", "--params", "never.yaml")
    np.testing.assert_allclose(stamps, [106.5])


def test_a_saved_pose_of_another_map_is_refused(
    cli, files: tuple[Path, Path], unique: tuple[Path, Path], alike: tuple[Path, Path]
) -> None:
    assert cli("track", *files, "--save-pose", "last.json").status == 0
    ended = cli("track", alike[0], files[1], "--start", "last.json")
    ended.assert_refused("it is a pose in another map", "firstfix locate")


def test_a_log_without_odometry(cli, files: tuple[Path, Path], drive: Path, tmp_path: Path) -> None:
    log = changed(drive, tmp_path, odom=None)
    for start in ([], ["--start", "1,1,0"]):
        cli("track", files[0], log, *start).assert_refused("odometry", "/tf", "/odom")


def test_a_log_without_truth_needs_a_start(
    cli, files: tuple[Path, Path], drive: Path, tmp_path: Path
) -> None:
    log = changed(drive, tmp_path, true_pose=None)
    cli("track", files[0], log).assert_refused("--start search", "--start X,Y,YAW")
    cli("track", files[0], log, "--start", "truth").assert_refused("true poses")


@pytest.mark.parametrize(
    "start", ["1,2", "1,2,3,4", "nan,1,2", "1;2;3", "nowhere.json", "", "a,b,c"]
)
def test_a_start_that_is_none(cli, files: tuple[Path, Path], start: str) -> None:
    cli("track", *files, f"--start={start}").assert_refused("--start 1.5,-2,0.7")


def test_a_start_outside_the_map(cli, files: tuple[Path, Path]) -> None:
    cli("track", *files, "--start", "100,1,0").assert_refused("x 100.00 m", "-0.50 to 9.50 m")


def test_a_file_that_is_no_saved_pose(cli, files: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "last.json").write_text("[]")
    cli("track", *files, "--start", "last.json").assert_refused("last.json")


def test_parameters_that_are_none(cli, files: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "amcl.yaml").write_text("amcl: {ros__parameters: {max_particels: 5}}")
    cli("track", *files, "--params", "amcl.yaml").assert_refused("max_particles")
    cli("track", *files, "--params", "nowhere.yaml").assert_refused("nowhere.yaml")


def test_files_that_are_not_there(cli, files: tuple[Path, Path]) -> None:
    cli("track", "nowhere.yaml", files[1]).assert_refused("nowhere.yaml")
    cli("track", files[0], "nowhere.npz").assert_refused("nowhere.npz")


def test_results_that_cannot_be_written_are_refused_first(
    cli, files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    for option in ("--out", "--save-pose"):
        cli("track", *files, option, "file/result").assert_refused("file/result")
    cli("track", *files, "--plot", "file/track.png").assert_refused("track.png", "file")
    cli("track", *files, "--plot", "track.jpeg").assert_refused("track.jpeg")
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    cli("track", *files, "--plot", "track.png").assert_refused("firstfix[plot]")


def test_wrong_input_leaves_earlier_results_alone(
    cli, files: tuple[Path, Path], tmp_path: Path
) -> None:
    (tmp_path / "drive.tum").write_text("earlier")
    targets = ["--out", "drive.tum", "--save-pose", "new.json"]
    assert cli("track", *files, *targets, "--start", "100,1,0").status == 2
    assert (tmp_path / "drive.tum").read_text() == "earlier"
    assert not (tmp_path / "new.json").exists()


@pytest.mark.slow
@pytest.mark.shared
@pytest.mark.parametrize(
    ("case", "log", "start"),
    [
        ("olin_mac1_9_23", "olin_ros2", "6.43,-8.87,1.697"),
        ("intel_lab", "intel.carmen.log.gz", "0.67,-0.04,-0.355"),
    ],
)
def test_logs_of_real_robots_are_tracked(
    cli, shared: Path, case: str, log: str, start: str
) -> None:
    map_path = shared / "cases" / case / "map.yaml"
    document = strict_json(
        cli("track", map_path, shared / "bags" / log, "--start", start, "--json").out
    )
    assert document["updates"] > 20
    x, y, _ = document["end"]["pose"]
    assert math.isfinite(x + y)


@pytest.mark.shared
def test_a_simulated_case_is_kept_to_its_end(cli, shared: Path) -> None:
    case = shared / "cases" / "willow_track_00"
    document = strict_json(cli("track", case / "map.yaml", case / "scans.npz", "--json").out)
    assert document["kept"] == 1.0
    assert document["ape"]["rmse_m"] < 0.05


def test_a_search_needs_no_start(cli, files: tuple[Path, Path]) -> None:
    ended = cli("track", *files, "--start", "search", "--json", "--out", "found.tum")
    assert ended.status == 0, ended
    document = strict_json(ended.out)
    assert document["start"]["origin"] == "search"
    assert document["kept"] == 1.0
    assert "found after 0.0 s" in ended.err
    assert len(load_trajectory(Path("found.tum"))) == document["scans"]


def test_a_search_may_begin_near_a_pose(cli, files: tuple[Path, Path]) -> None:
    ended = cli("track", *files, "--start", "search", "--near", "3,3", "--radius", "6", "--json")
    assert ended.status == 0, ended
    assert strict_json(ended.out)["kept"] == 1.0
    for arguments in (("--near", "3,3"), ("--start", "search", "--near", "999,0")):
        ended = cli("track", *files, *arguments)
        assert (ended.status, ended.err.count("\n")) == (2, 1)


@pytest.mark.slow
def test_a_search_that_finds_nothing_gives_the_reason(
    cli, files: tuple[Path, Path], alike: tuple[Path, Path]
) -> None:
    ended = cli("track", alike[0], files[1], "--start", "search", "--out", "never.tum")
    assert ended.status == 1
    assert "found at none of" in ended.out
    assert not Path("never.tum").exists()


def test_the_seed_counts_for_a_search_too(cli, crowded: tuple[Path, Path]) -> None:
    def track(seed: int) -> str:
        ended = cli("track", *crowded, "--start", "search", "--seed", seed, "--out", "a.tum")
        assert ended.status == 0
        return Path("a.tum").read_text()

    assert track(1) == track(1)
    assert track(1) != track(2)
