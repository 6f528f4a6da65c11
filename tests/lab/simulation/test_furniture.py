"""Furniture hides walls and encloses no free space."""

import numpy as np
import pytest
from scipy import ndimage

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.furniture import furnished
from firstfix.lab.worlds.drawing import Drawing


def hall(yaw: float = 0.0) -> OccupancyGrid:
    plan = Drawing(9.0, 6.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 6.0, 6.0)
    plan.room(6.0, 0.0, 9.0, 6.0)
    plan.door(6.0, 3.0)
    grid = plan.grid()
    return OccupancyGrid(grid.cells, grid.resolution, SE2(0.0, 0.0, yaw) @ grid.T_map_grid)


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_boxes_stand_on_free_ground_and_leave_ways_round_them(yaw: float) -> None:
    grid = hall(yaw)
    after = furnished(grid, 5, np.random.default_rng(1))
    changed = after.cells != grid.cells
    _, boxes = ndimage.label(changed)
    assert boxes == 5
    assert grid.free[changed].all()
    assert 0.05 * 5 < changed.sum() * grid.resolution**2 < 0.81 * 5
    _, before = ndimage.label(Floor(grid).room > 0.23)
    _, parts = ndimage.label(Floor(after).room > 0.23)
    assert parts == before == 1


def test_where_the_robot_will_stand_nothing_comes() -> None:
    places = [SE2(2.0, 2.0, 0.0), SE2(7.5, 3.0, 1.0)]
    for seed in range(10):
        floor = Floor(furnished(hall(), 20, np.random.default_rng(seed), places))
        assert all(floor.room_at(place.x, place.y) > 0.45 for place in places)


def test_a_full_house_takes_no_more() -> None:
    plan = Drawing(1.5, 1.5, 0.05, 0.5)
    plan.room(0.0, 0.0, 1.5, 1.5)
    grid = plan.grid()
    np.testing.assert_array_equal(furnished(grid, 3, np.random.default_rng(0)).cells, grid.cells)
