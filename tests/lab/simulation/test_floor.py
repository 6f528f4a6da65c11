"""How much room there is, and where rays can leap."""

import math

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.clearance import chessboard_clearance
from firstfix.lab.simulation.floor import Floor


def field(T_map_grid: SE2) -> Floor:
    """4 x 3 m of free ground with a post in the middle of it."""
    cells = np.zeros((30, 40), np.int8)
    cells[15, 20] = 100
    return Floor(OccupancyGrid(cells, 0.1, T_map_grid))


@pytest.mark.parametrize("T_map_grid", [SE2.identity(), SE2(3.0, -2.0, 2.2)])
def test_room_ends_at_posts_and_at_the_border_wherever_the_map_lies(T_map_grid: SE2) -> None:
    floor = field(T_map_grid)

    def room_at(x: float, y: float) -> float:
        place = T_map_grid @ SE2(x, y, 0.0)
        return floor.room_at(place.x, place.y)

    assert room_at(2.05, 1.55) == 0.0
    assert room_at(1.55, 1.55) == pytest.approx(0.45)  # the post begins at x = 2
    assert room_at(0.25, 1.5) == pytest.approx(0.25)
    assert room_at(-0.01, 1.5) == 0.0
    assert room_at(1.5, 3.01) == 0.0


def test_unknown_cells_are_no_room_but_stops_no_ray() -> None:
    cells = np.zeros((9, 9), np.int8)
    cells[:, 5:] = -1
    floor = Floor(OccupancyGrid(cells, 0.1))
    assert floor.room_at(0.75, 0.45) == 0.0
    assert floor.room_at(0.45, 0.45) == pytest.approx(0.05)
    np.testing.assert_array_equal(floor.clearance, chessboard_clearance(np.zeros((9, 9), bool)))


def test_a_line_has_the_room_of_its_tightest_point() -> None:
    floor = field(SE2(0.0, 0.0, math.pi / 2))  # x of the grid is y of the map
    assert floor.has_room((-0.55, 1.0), (-0.55, 3.0), 0.5)
    assert not floor.has_room((-0.55, 1.0), (-0.55, 3.0), 0.6)
    assert not floor.has_room((-1.55, 1.0), (-1.55, 3.0), 0.05)
    assert not floor.has_room((-0.55, 1.0), (-0.55, 5.0), 0.0)
