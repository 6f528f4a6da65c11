"""A drawn hall on disk, and the command line in this process."""

import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firstfix.cli.app import run
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.io.logs.npz import save_recording
from firstfix.io.maps.map_server import save_map
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import identical_rooms
from firstfix.lab.worlds.drawing import Drawing


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    status: int
    out: str
    err: str

    def assert_one_sentence(self, *words: str) -> None:
        """Assert that the command was refused in one sentence with these words."""
        assert (self.status, self.out) == (2, ""), self
        assert self.err.startswith("firstfix: ")
        assert self.err.count("\n") == 1
        for word in words:
            assert word in self.err

    def assert_refused(self, *words: str) -> None:
        """Assert that one sentence says what is expected, what was received, and what to do."""
        self.assert_one_sentence("firstfix: expected ", ", received ", "; ", *words)


Cli = Callable[..., Ended]


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Cli:
    """Run a command line in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def call(*arguments: object) -> Ended:
        status = run([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Ended(status, captured.out, captured.err)

    return call


def _sent(thing: Any) -> Any:
    return pickle.loads(pickle.dumps(thing))  # noqa: S301 - our own


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the tasks of a benchmark here: each process of its own takes a second or two to start.

    Tasks and results go through pickle, as on their way to a process and back. The processes have
    tests of their own.
    """

    def run(
        tasks: Sequence[Callable[[], Any]], jobs: int, on_done: Callable[[int, Any], None]
    ) -> list[Any]:
        results = []
        for i, task in enumerate(tasks):
            results.append(_sent(_sent(task)()))
            on_done(i, results[i])
        return results

    monkeypatch.setattr("firstfix.lab.experiments.benchmark.run_in_processes", run)


def write_case(folder: Path, grid: OccupancyGrid, poses: list[SE2], site: str) -> Path:
    """Write a case as ``bench`` reads it; every pose is that of the sensor."""
    folder.mkdir(parents=True)
    save_map(grid, folder / "map.yaml")
    (folder / "meta.json").write_text(f'{{"site": "{site}", "kind": "sim"}}')
    lidar, rng = Lidar(beams=180), np.random.default_rng(0)
    scans = [lidar.scan(grid, pose, rng) for pose in poses]
    np.savez(
        folder / "scans.npz",
        ranges=np.stack([scan.ranges for scan in scans]),
        angle_min=scans[0].angle_min,
        angle_increment=scans[0].angle_increment,
        range_min=scans[0].range_min,
        range_max=scans[0].range_max,
        true_pose=np.stack([pose.as_array() for pose in poses]),
    )
    return folder


@pytest.fixture(scope="session")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two cases: one room that is like no other place, and two that are alike."""
    folder = tmp_path_factory.mktemp("cases")
    plan = Drawing(9.0, 7.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 9.0, 7.0)
    plan.solid(0.1, 5.0, 2.0, 6.9)
    plan.solid(6.0, 2.0, 6.5, 3.5)
    places = [SE2(3.0, 2.0, 0.5), SE2(7.5, 5.0, -2.0), SE2(4.5, 4.0, 3.0)]
    write_case(folder / "unique", plan.grid(), places, "hall")
    write_case(folder / "alike", identical_rooms(2), [SE2(2.0, 2.0, 1.0)], "rooms")
    return folder


@pytest.fixture
def unique(cases: Path) -> tuple[Path, Path]:
    """Map and scans of a place that is like no other."""
    return cases / "unique" / "map.yaml", cases / "unique" / "scans.npz"


@pytest.fixture
def alike(cases: Path) -> tuple[Path, Path]:
    """Map and scans of a place that there is twice."""
    return cases / "alike" / "map.yaml", cases / "alike" / "scans.npz"


@pytest.fixture(scope="session")
def drive(
    tmp_path_factory: pytest.TempPathFactory, hall_plan: OccupancyGrid, driven: Recording
) -> Path:
    """A case with odometry: a drive through the hall."""
    folder = tmp_path_factory.mktemp("drives") / "drive"
    folder.mkdir()
    save_map(hall_plan, folder / "map.yaml")
    save_recording(driven, folder / "scans.npz")
    return folder
