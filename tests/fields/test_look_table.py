"""The bounds hold what an ideal sensor would measure anywhere in a block."""

from __future__ import annotations

import numpy as np
import pytest

from firstfix.core.angles import FULL_TURN
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.fields.look_table import LOOK_DIRECTIONS, LookTable
from firstfix.fields.map_fields import MapFields
from firstfix.fields.range_table import FARTHEST, REACH_M, UNIT_M
from firstfix.fields.raycast import cast_rays
from firstfix.lab.worlds.floors import RandomFloor

HALF = FULL_TURN / LOOK_DIRECTIONS / 2


def walled(height: int, width: int, resolution: float) -> OccupancyGrid:
    cells = np.full((height, width), FREE, np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = OCCUPIED
    return OccupancyGrid(cells, resolution)


@pytest.mark.parametrize("seed", [1, 2])
def test_cast_ranges_lie_between_the_bounds(seed: int) -> None:
    fields = MapFields(RandomFloor(seed, 300.0).map())
    grid, table = fields.grid, fields.look
    rng = np.random.default_rng(seed)
    rows, columns = np.nonzero(grid.seen_free & (fields.clearance > 2))
    block = {(r, c): i for i, (r, c) in enumerate(zip(table.rows, table.columns, strict=True))}
    alone = {key for key in block if np.sum((table.rows == key[0]) & (table.columns == key[1])) < 2}
    outside = total = 0
    for i in rng.choice(len(rows), 200, replace=False):
        key = (rows[i] // table.stride, columns[i] // table.stride)
        if key not in alone:
            continue
        angles = np.arange(LOOK_DIRECTIONS) * 2 * HALF + rng.uniform(-HALF, HALF, LOOK_DIRECTIONS)
        reach = REACH_M / grid.resolution
        ranges = cast_rays(grid.occupied, columns[i] + 0.5, rows[i] + 0.5, angles, reach)
        counts = np.minimum(ranges * grid.resolution / UNIT_M, FARTHEST)
        low, high = table.bounds[block[key]].astype(np.float64)
        outside += np.count_nonzero((counts < low - 2) | (counts > high + 2))
        total += LOOK_DIRECTIONS
    # Samples of block and directions, and digital lines: corners are missed now and then.
    assert total > 5000
    assert outside < 0.02 * total


def test_in_an_empty_room_the_bounds_are_the_walls() -> None:
    table = MapFields(walled(84, 124, 0.05)).look
    middle = np.argmin(np.abs(table.rows - 5) + np.abs(table.columns - 7))
    block = table.rows[middle], table.columns[middle]
    east, north = LOOK_DIRECTIONS * 0, LOOK_DIRECTIONS // 4
    for direction, cells, at in ((east, 123, block[1]), (north, 83, block[0])):
        low, high = table.bounds[middle, :, direction]
        nearest, farthest = cells - (at + 1) * table.stride, cells - at * table.stride
        # The neighbouring half directions are a little longer.
        assert nearest * 0.05 / UNIT_M - 1 <= low <= high <= 1.02 * farthest * 0.05 / UNIT_M + 1


def test_the_sides_of_a_thin_wall_are_entries_of_their_own() -> None:
    cells = walled(40, 81, 0.05).cells.copy()
    cells[:, 43] = OCCUPIED  # in the block of columns 40 to 47
    table = MapFields(OccupancyGrid(cells, 0.05)).look
    assert table.stride == 8
    assert (table.columns == 5).sum() <= (table.rows == 2).sum()
    east = table.bounds[table.columns == 4][:, 1, 0]
    assert (east <= round(12 * 0.05 / UNIT_M) + 1).all()  # nothing sees through


@pytest.mark.parametrize("resolution", [0.02, 0.05, 0.1, 0.2, 0.5])
def test_any_size_of_cells(resolution: float) -> None:
    side = max(12, round(4.0 / resolution))
    table = MapFields(walled(side, side, resolution)).look
    assert len(table) > 0
    assert (table.bounds[:, 0] <= table.bounds[:, 1]).all()
    assert table.bounds.max() <= 1.5 * side * resolution / UNIT_M


def test_nothing_free_is_no_entry() -> None:
    grid = OccupancyGrid(np.full((20, 20), UNKNOWN, np.int8), 0.05)
    assert len(MapFields(grid).look) == 0


def test_a_packed_table_is_read_back() -> None:
    table = MapFields(walled(40, 50, 0.05)).look
    again = LookTable.unpacked(table.packed())
    assert again.stride == table.stride
    for name in ("rows", "columns", "bounds", "spreads"):
        np.testing.assert_array_equal(getattr(again, name), getattr(table, name))
