"""Counts come back from files as they were; other files are refused in one sentence."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from firstfix.changes.counts import DayCounts
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.io.map_changes import load_counts, save_counts

GRID = OccupancyGrid(np.zeros((3, 4), np.int8), 0.05)


def counts(day: int) -> DayCounts:
    arrays = np.random.default_rng(day).integers(0, 60_000, (3, 3, 4)).astype(np.uint16)
    return DayCounts(day, *arrays, views=7, beams=900, explained=800)


def test_they_come_back(tmp_path: Path) -> None:
    days = [counts(20_001), counts(20_000)]
    paths = save_counts(days, GRID, tmp_path)
    assert [path.name for path in paths] == ["counts-2024-10-05.npz", "counts-2024-10-04.npz"]
    for got, expected in zip(load_counts(tmp_path, GRID), reversed(days), strict=True):
        for name in ("hits", "near", "passes"):
            np.testing.assert_array_equal(getattr(got, name), getattr(expected, name))
        assert (got.day, got.views) == (expected.day, expected.views)
        assert (got.beams, got.explained) == (expected.beams, expected.explained)


def test_a_folder_without_counts_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has 0 files"):
        load_counts(tmp_path, GRID)
    with pytest.raises(InputError, match="has 0 files"):
        load_counts("a\0b", GRID)


def test_counts_of_another_map_are_refused(tmp_path: Path) -> None:
    save_counts([counts(3)], GRID, tmp_path)
    other = OccupancyGrid(np.full((3, 4), 100, np.int8), 0.05)
    with pytest.raises(InputError, match="another map"):
        load_counts(tmp_path, other)


@pytest.mark.parametrize(
    "change",
    [
        {"hits": np.zeros((3, 4), np.float64)},
        {"passes": np.zeros((4, 3), np.uint16)},
        {"near": np.array([None] * 12)},
        {"day": np.array([1, 2])},
        {"day": np.array(10**17)},
        {"views": np.array(-1)},
        {"explained": np.array(901)},
        {"hits": np.zeros((300, 400), np.uint16)},
        {"views": None},
    ],
)
def test_damaged_and_hostile_files_are_refused(tmp_path: Path, change: dict[str, object]) -> None:
    (path,) = save_counts([counts(3)], GRID, tmp_path)
    with np.load(path) as archive:
        arrays = dict(archive) | change
    np.savez(path, **{name: array for name, array in arrays.items() if array is not None})
    with pytest.raises(InputError, match="damaged"):
        load_counts(tmp_path, GRID)


def test_cut_and_false_archives_are_refused(tmp_path: Path) -> None:
    (path,) = save_counts([counts(3)], GRID, tmp_path)
    whole = path.read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"not an archive"):
        path.write_bytes(content)
        with pytest.raises(InputError, match="damaged"):
            load_counts(tmp_path, GRID)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("hits.npy", b"x" * 100_000)
    with pytest.raises(InputError, match="damaged"):
        load_counts(tmp_path, GRID)
