"""Random floors: no two alike, and a world that differs from its map a little."""

from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from firstfix.core.errors import InputError
from firstfix.io.maps.map_server import load_map
from firstfix.lab.worlds.catalog import random_free_poses, world_or_map
from firstfix.lab.worlds.floors import RandomFloor, floor_id, write_site


def test_one_seed_is_one_floor_and_another_seed_another() -> None:
    first, again, other = (RandomFloor(seed, 600.0) for seed in (4, 4, 5))
    assert (first.map().cells == again.map().cells).all()
    assert (first.world().cells == again.world().cells).all()
    assert first.map().cells.shape != other.map().cells.shape


@pytest.mark.parametrize("seed", range(8))
def test_a_floor_is_mostly_connected_free_space_within_walls(seed: int) -> None:
    grid = RandomFloor(seed, 700.0).map()
    around_free = ndimage.binary_dilation(grid.free)
    labels, _ = ndimage.label(grid.free)
    largest = np.bincount(labels.ravel())[1:].max() * grid.resolution**2
    assert not (around_free & (grid.cells < 0)).any()
    assert 300.0 < grid.free_area < 700.0
    assert largest > 100.0
    assert len(random_free_poses(grid, np.random.default_rng(0), 3)) == 3


def test_a_floor_without_a_corridor_is_no_court() -> None:
    assert RandomFloor(10031).map().free_area > 100.0


def test_the_world_has_the_frame_of_the_map_and_most_of_its_walls() -> None:
    for seed in range(5):
        floor = RandomFloor(seed, 700.0)
        grid, world = floor.map(), floor.world()
        assert grid.T_map_grid == world.T_map_grid
        assert grid.cells.shape == world.cells.shape
        near = ndimage.binary_dilation(world.occupied, iterations=2)
        share = np.count_nonzero(grid.occupied & near) / np.count_nonzero(grid.occupied)
        assert 0.7 < share < 1.0
        assert (grid.occupied != world.occupied).any()


def test_areas_are_drawn_between_the_limits() -> None:
    areas = [RandomFloor(seed).plan().outline.area_m2 for seed in range(30)]
    assert 450.0 < min(areas) < 4000.0
    assert 16_000.0 < max(areas) < 20_100.0


def test_a_site_is_written_once_and_read_back(tmp_path: Path) -> None:
    floors = [RandomFloor(seed, 300.0) for seed in (1, 2)]
    done: list[int] = []
    folder = write_site(tmp_path / "site", floors, done.append)
    assert done == [1, 2]
    assert sorted(path.name for path in folder.glob("*.yaml")) == [
        "floor_00001.yaml",
        "floor_00002.yaml",
    ]
    loaded = load_map(folder / f"{floor_id(floors[1])}.yaml")
    assert (loaded.cells == floors[1].map().cells).all()
    before = (folder / "floor_00001.pgm").stat().st_mtime_ns
    write_site(folder, floors, done.append)
    assert (folder / "floor_00001.pgm").stat().st_mtime_ns == before


def test_a_floor_has_a_name_in_the_catalog() -> None:
    assert (world_or_map("floor:3").cells == RandomFloor(3).map().cells).all()
    with pytest.raises(InputError, match="floor:SEED"):
        world_or_map("floor:x")


@pytest.mark.parametrize("floor", [(-1, None), (0, 50.0), (0, float("nan"))])
def test_impossible_floors_are_refused(floor: tuple[int, float | None]) -> None:
    with pytest.raises(InputError, match="at least 100 m²"):
        RandomFloor(*floor)
