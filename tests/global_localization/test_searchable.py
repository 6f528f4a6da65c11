"""A map without walls, or without room for a robot, is refused before any search."""

import numpy as np
import pytest

from firstfix.core.errors import MapError
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.searchable import check_positions, check_searchable


@pytest.mark.parametrize(
    ("value", "missing"), [(FREE, "occupied"), (UNKNOWN, "occupied"), (OCCUPIED, "free")]
)
def test_a_map_of_one_kind_cannot_be_searched(value, missing):
    with pytest.raises(MapError, match=f"none of them {missing}"):
        check_searchable(OccupancyGrid(np.full((5, 7), value, np.int8), 0.05))


def test_unseen_free_space_cannot_be_searched():
    cells = np.array([[FREE, OCCUPIED]], np.int8)
    with pytest.raises(MapError, match="none of them free"):
        check_searchable(OccupancyGrid(cells, 0.05, unseen=np.array([[True, False]])))


def test_one_wall_and_one_free_cell_can_be_searched():
    check_searchable(OccupancyGrid(np.array([[FREE, OCCUPIED]], np.int8), 0.05))


def test_free_space_must_be_wide_enough_to_stand_in():
    narrow = np.full((30, 30), OCCUPIED, np.int8)
    narrow[:, 1] = FREE  # 5 cm wide
    with pytest.raises(MapError, match="30 free cells"):
        check_positions(MapFields(OccupancyGrid(narrow, 0.05)))
    check_positions(MapFields(OccupancyGrid(narrow, 0.25)))
