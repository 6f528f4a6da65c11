"""``firstfix map changes``."""

import json
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.io.logs.npz import save_recording
from firstfix.io.logs.tum import save_trajectory
from firstfix.io.maps.map_server import load_map, save_map
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.drawing import Drawing


def hall(*, with_cabinet: bool) -> OccupancyGrid:
    plan = Drawing(9.0, 7.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 9.0, 7.0)
    plan.solid(0.1, 5.0, 2.0, 6.9)
    plan.solid(6.0, 2.0, 6.5, 3.5)
    if with_cabinet:
        plan.solid(3.0, 4.0, 3.8, 4.4)
    return plan.grid()


@pytest.fixture
def changed(tmp_path: Path) -> Path:
    """A map, and a drive through the hall after a cabinet was put there; TUM poses besides."""
    save_map(hall(with_cabinet=False), tmp_path / "map.yaml")
    rng, lidar, now = np.random.default_rng(0), Lidar(beams=180), hall(with_cabinet=True)
    truth = [SE2(1.2 + 0.1 * k, 1.4, 0.0) for k in range(40)]
    stamps = 1.7e9 + 0.2 * np.arange(len(truth))
    scans = tuple(
        lidar.scan(now, pose, rng, stamp)
        for pose, stamp in zip(truth, stamps.tolist(), strict=True)
    )
    poses = np.array([pose.as_array() for pose in truth])
    recording = Recording(scans, odometry=Trajectory(stamps, poses - poses[0]), truth=poses)
    save_recording(recording, tmp_path / "log.npz")
    save_trajectory(Trajectory(stamps, poses), tmp_path / "poses.tum")
    return tmp_path


def without(folder: Path, *names: str) -> Path:
    with np.load(folder / "log.npz") as log:
        arrays = dict(log)
    path = folder / "less.npz"
    np.savez(path, **{name: array for name, array in arrays.items() if name not in names})
    return path


@pytest.mark.parametrize("poses", [[], ["--truth"], ["--poses", "poses.tum"]])
def test_a_new_cabinet_is_reported(cli, changed: Path, poses: list[str]) -> None:
    ended = cli("map", "changes", "map.yaml", "log.npz", *poses, "--json")
    assert ended.status == 0, ended
    document = json.loads(ended.out)
    assert document["days"] == ["2023-11-14"]
    (area,) = document["areas"]
    assert area["change"] == "new"
    assert area["position"] == pytest.approx([3.4, 4.0], abs=0.3)
    assert document["area_m2"]["new"] == area["area_m2"] > 0.02


def test_the_folder_has_all_a_planner_and_a_person_need(cli, changed: Path) -> None:
    ended = cli("map", "changes", "map.yaml", "log.npz", "--out", "out", "--plot", "c.png")
    assert ended.status == 0, ended
    assert "things that are new" in ended.out
    assert (changed / "c.png").stat().st_size > 1000
    assert {path.name for path in (changed / "out").iterdir()} == {
        "changes.yaml", "changes.pgm", "map.yaml", "map.pgm", "changes.json", "changes.png",
        "counts-2023-11-14.npz",
    }  # fmt: skip
    before, layer, now = (
        load_map(changed / name) for name in ("map.yaml", "out/changes.yaml", "out/map.yaml")
    )
    assert layer.T_map_grid == before.T_map_grid
    new = layer.occupied
    assert new.any()
    assert not before.occupied[new].any()
    np.testing.assert_array_equal(now.occupied, before.occupied | new)


def test_days_add_up_over_runs(cli, changed: Path) -> None:
    cli("map", "changes", "map.yaml", "log.npz", "--truth", "--out", "first")
    with np.load(changed / "log.npz") as log:
        arrays = dict(log)
    arrays["stamp"] = arrays["stamp"] + 86400.0
    np.savez(changed / "next.npz", **arrays)
    command = ["map", "changes", "map.yaml", "next.npz", "--truth", "--json", "--days", 2]
    assert json.loads(cli(*command).out)["areas"] == []
    document = json.loads(cli(*command, "--earlier", "first").out)
    assert document["days"] == ["2023-11-14", "2023-11-15"]
    assert [area["days"] for area in document["areas"]] == [2]


def assert_refused(ended, *words: str) -> None:
    assert ended.status == 2, ended
    assert ended.out == ""
    assert ended.err.count("firstfix: ") == 1
    for word in words:
        assert word in ended.err


def test_a_map_of_another_building_stops(cli, changed: Path) -> None:
    plan = Drawing(9.0, 7.0, 0.05, 0.5)
    plan.free(0.0, 0.0, 9.0, 7.0)
    plan.solid(8.8, 6.8, 8.9, 6.9)
    save_map(plan.grid(), changed / "other.yaml")
    ended = cli("map", "changes", "other.yaml", "log.npz", "--truth", "--out", "out")
    assert_refused(ended, "of the beams of", "another building")
    assert list((changed / "out").iterdir()) == []
    assert_refused(cli("map", "changes", "other.yaml", "log.npz"), "found at none of 40 scans")


def test_logs_without_poses_are_refused(cli, changed: Path) -> None:
    log = without(changed, "odom")
    assert_refused(cli("map", "changes", "map.yaml", log), "no odometry", "--poses")
    log = without(changed, "true_pose")
    assert_refused(cli("map", "changes", "map.yaml", log, "--truth"), "no true poses")
    both = cli("map", "changes", "map.yaml", log, "--truth", "--poses", "poses.tum")
    assert_refused(both, "Choose one")


def test_poses_of_another_time_are_refused(cli, changed: Path) -> None:
    later = Trajectory([2e9, 2e9 + 1.0], np.zeros((2, 3)))
    save_trajectory(later, changed / "later.tum")
    ended = cli("map", "changes", "map.yaml", "log.npz", "--poses", "later.tum")
    assert_refused(ended, "do not overlap")


def test_counts_that_cannot_be_used_are_refused(cli, changed: Path) -> None:
    ended = cli("map", "changes", "map.yaml", "log.npz", "--truth", "--earlier", "nowhere")
    assert_refused(ended, "has 0 files")


def test_the_layer_helps_to_locate(cli, changed: Path) -> None:
    cli("map", "changes", "map.yaml", "log.npz", "--truth", "--out", "found")
    located = ("locate", "map.yaml", "log.npz", "--index", "20", "--json")
    costs = [
        json.loads(cli(*located, *more).out)["hypotheses"][0]["score"]
        for more in ([], ["--changes", "found/changes.yaml"])
    ]
    assert costs[1] < costs[0]


def test_changes_of_another_map_are_one_sentence(cli, changed: Path) -> None:
    save_map(OccupancyGrid(np.zeros((9, 9), np.int8), 0.05), changed / "other.yaml")
    ended = cli("locate", "map.yaml", "log.npz", "--changes", "other.yaml")
    assert ended.status == 2
    assert "another map" in ended.err
    assert ended.err.count("\n") == 1
    ended = cli("track", "map.yaml", "log.npz", "--changes", "other.yaml")
    assert (ended.status, ended.err.count("\n")) == (2, 1)
    assert "--start search" in ended.err
