"""Floors of one plan, furnished each in its own way."""

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.lab.worlds.many_offices import many_offices
from firstfix.lab.worlds.office import office


@pytest.mark.parametrize(("count", "rows", "columns"), [(1, 1, 1), (3, 1, 3), (6, 2, 3)])
def test_floors_stand_in_a_rectangle(count: int, rows: int, columns: int) -> None:
    grid, plan = many_offices(count, np.random.default_rng(0)), office()
    assert grid.cells.shape == (rows * plan.height, columns * plan.width)
    assert grid.resolution == plan.resolution


def test_every_floor_has_the_walls_of_the_plan_and_furniture_of_its_own() -> None:
    plan = office()
    west, east = np.hsplit(many_offices(2, np.random.default_rng(0)).occupied, 2)
    for floor in (west, east):
        assert floor[plan.occupied].all()
        assert floor.sum() > plan.occupied.sum()
    assert (west != east).any()


def test_no_floor_is_refused() -> None:
    with pytest.raises(InputError, match="at least 1 office"):
        many_offices(0, np.random.default_rng(0))
