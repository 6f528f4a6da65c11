"""Drawn buildings are maps one can live in."""

import numpy as np
import pytest
from scipy import ndimage

from firstfix.core.errors import InputError, MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.worlds.catalog import (
    ROOM_PITCH,
    WORLDS,
    identical_rooms,
    random_free_pose,
    random_free_poses,
)
from firstfix.lab.worlds.office import office


@pytest.mark.parametrize("name", WORLDS)
def test_every_world_has_walls_between_free_and_unknown(name: str) -> None:
    grid = WORLDS[name]()
    around_free = ndimage.binary_dilation(grid.free)
    unknown = ~(grid.free | grid.occupied)
    assert grid.free_area > 50.0
    assert unknown.any()
    assert not (around_free & unknown).any()


def test_identical_rooms_are_closed_and_alike_cell_by_cell() -> None:
    grid = identical_rooms(3)
    _, count = ndimage.label(grid.free)
    assert count == 3
    pitch = round(ROOM_PITCH / grid.resolution)
    first, second, third = (grid.cells[:, i * pitch : (i + 1) * pitch] for i in range(3))
    assert (first == second).all()
    assert (first == third).all()
    assert (first != first[::-1, ::-1]).any()


def test_no_room_is_no_world() -> None:
    with pytest.raises(InputError, match="at least 1 room"):
        identical_rooms(0)


@pytest.mark.parametrize("yaw", [0.0, 1.0])
def test_random_poses_stand_free_of_walls(yaw: float) -> None:
    cells = np.zeros((40, 60), np.int8)
    cells[:, 30:] = 100
    grid = OccupancyGrid(cells, 0.1, SE2(5.0, -3.0, yaw))
    rng = np.random.default_rng(1)
    for _ in range(200):
        pose = random_free_pose(grid, rng, clearance_m=0.5)
        column, row = grid.to_cells(np.array([pose.x, pose.y]))
        assert 4.999 <= column <= 25.001
        assert 4.999 <= row <= 35.001


def test_one_seed_gives_one_pose() -> None:
    grid = office()
    a, b = (random_free_pose(grid, np.random.default_rng(7)) for _ in range(2))
    assert a == b


def test_many_poses_are_the_single_ones_in_turn() -> None:
    one, many = (np.random.default_rng(7) for _ in range(2))
    singles = [random_free_pose(office(), one) for _ in range(4)]
    assert random_free_poses(office(), many, 4) == singles
    assert random_free_poses(office(), many, 0) == []


def test_a_map_without_a_place_to_stand_is_refused() -> None:
    with pytest.raises(MapError, match="without one"):
        random_free_pose(OccupancyGrid(np.zeros((5, 5), np.int8), 0.05), np.random.default_rng(0))
