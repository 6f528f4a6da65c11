"""Pictures of tracks: what is drawn is where it was tracked."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from firstfix.amcl.config import AmclConfig
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.lab.experiments.drive import plan_drive
from firstfix.lab.experiments.drive_tracking import (
    TRUE_START,
    TrackedScan,
    follow_drive,
    make_tracker,
)
from firstfix.lab.reports import track_report
from firstfix.lab.reports.track_report import anchored_odometry, draw_track, end_points


@pytest.fixture(scope="module")
def tracked(hall_plan: OccupancyGrid, driven: Recording) -> list[TrackedScan]:
    config = AmclConfig()
    drive = plan_drive(replace(driven, runs=np.repeat([0, 1], [40, 26])), None)
    rng = np.random.default_rng(0)
    return [*follow_drive(drive, make_tracker(hall_plan, config), config, TRUE_START, rng)]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["track.png", "track.svg"])
def test_a_track_becomes_a_picture(
    tmp_path: Path, hall_plan: OccupancyGrid, tracked: list[TrackedScan], name: str
) -> None:
    path = draw_track(hall_plan, tracked, tmp_path / name, "a drive")
    assert path == (tmp_path / name).resolve()
    assert path.stat().st_size > 5000
    if path.suffix == ".png":
        assert np.ptp(np.asarray(Image.open(path).convert("L"))) > 100


@pytest.mark.slow
def test_one_blind_scan_without_truth_is_a_picture_too(
    tmp_path: Path, hall_plan: OccupancyGrid, tracked: list[TrackedScan]
) -> None:
    first = tracked[0]
    blind = replace(first.sight.scan, ranges=np.full(120, np.inf, np.float32))
    alone = replace(first, sight=replace(first.sight, scan=blind, truth=None))
    draw_track(hall_plan, [alone], tmp_path / "blind.png", "nothing seen")


def test_end_points_lie_on_walls_where_the_track_is_right(
    hall_plan: OccupancyGrid, tracked: list[TrackedScan]
) -> None:
    column, row = hall_plan.to_cells(end_points(tracked)).T.astype(int)
    near = np.zeros(hall_plan.cells.shape, bool)
    for dy in range(-2, 3):
        for dx in range(-2, 3):
            near |= np.roll(hall_plan.occupied, (dy, dx), (0, 1))
    assert near[row, column].mean() > 0.95


def test_large_drives_are_thinned(
    tracked: list[TrackedScan], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(track_report, "MOST_SCANS", 10)
    monkeypatch.setattr(track_report, "MOST_POINTS", 300)
    assert 100 < len(end_points(tracked)) <= 300


def test_odometry_alone_begins_at_every_start(tracked: list[TrackedScan]) -> None:
    poses = anchored_odometry(tracked)
    for i in (0, 40):
        assert poses[i].distance_to(tracked[i].T_map_base) < 1e-9
    assert poses[39].distance_to(tracked[39].T_map_base) > 0.1
