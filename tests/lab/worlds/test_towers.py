"""Buildings with a lift."""

from __future__ import annotations

import numpy as np
import pytest

from firstfix.io.maps.site_yaml import read_site
from firstfix.lab.worlds.towers import LIFT, Likeness, TowerFloor, tower, write_tower


@pytest.fixture(scope="module")
def floors() -> list[TowerFloor]:
    return tower(1, 3, 400.0)


def test_the_first_two_floors_differ_in_furniture_only(floors):
    one, two, other = (floor.map for floor in floors)
    assert 0.0 < np.mean(one.cells != two.cells) < 0.05
    assert other.cells.shape != one.cells.shape or np.mean(other.cells != one.cells) > 0.05


def test_alike_floors_have_the_walls_of_each_other_and_a_lift_at_one_place():
    _, _, one, two = tower(1, 4, 400.0)
    assert one.likeness is two.likeness is Likeness.ALIKE
    assert one.T_map_lift == two.T_map_lift
    assert one.plan.plan() == two.plan.plan()
    assert 0.01 < np.mean(one.map.cells != two.map.cells) < 0.2


@pytest.mark.parametrize("level", [0, 2])
def test_a_robot_fits_in_the_lift_and_its_door_opens(floors, level):
    floor = floors[level]
    lift = floor.T_map_lift
    ahead = lift.apply(np.column_stack([np.linspace(0.0, 1.5, 40), np.zeros(40)]))
    column, row = np.floor(floor.map.to_cells(ahead)).astype(int).T
    assert (floor.map.cells[row, column] == 0).all()
    assert (floor.open_world.cells[row, column] == 0).all()
    assert (floor.closed_world.cells[row, column] == 100).any()


def test_a_tower_is_a_site(floors, tmp_path):
    site = read_site(write_tower(tmp_path / "tower", floors))
    assert [entry.id for entry in site.maps] == ["level_00", "level_01", "level_02"]
    (lift,) = site.transitions
    assert (lift.id, lift.kind, len(lift.ends)) == (LIFT, "lift", 3)
