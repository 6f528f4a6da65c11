"""The table holds what an ideal sensor would measure at every position."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstfix.core.angles import FULL_TURN
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.clearance import chessboard_clearance
from firstfix.fields.range_table import (
    DIRECTIONS,
    FARTHEST,
    REACH_M,
    UNIT_M,
    build_range_table,
)
from firstfix.fields.raycast import expected_ranges
from firstfix.fields.search_grid import build_search_grid

directions = np.arange(DIRECTIONS) * (FULL_TURN / DIRECTIONS)


def build(grid):
    positions = build_search_grid(grid)
    return positions, build_range_table(
        grid.occupied, chessboard_clearance(grid.occupied), grid.resolution, positions
    )


def random_grid(seed, shape, resolution):
    rng = np.random.default_rng(seed)
    cells = rng.choice(np.array([FREE, UNKNOWN, OCCUPIED], np.int8), shape, p=[0.8, 0.15, 0.05])
    return OccupancyGrid(cells, resolution)


@settings(deadline=None, max_examples=30)
@given(
    st.integers(0, 2**32 - 1),
    st.tuples(st.integers(12, 40), st.integers(12, 40)),
    st.sampled_from([0.05, 0.1, 0.25]),
)
def test_every_entry_is_the_cast_range(seed, shape, resolution):
    grid = random_grid(seed, shape, resolution)
    positions, table = build(grid)
    assert table.shape == (len(positions), 2 * DIRECTIONS)
    x, y = positions.centres(np.arange(len(positions)))
    for i in range(len(positions)):
        pose = SE2(x[i] * resolution, y[i] * resolution, 0.0)
        ranges = expected_ranges(grid, pose, directions, REACH_M)
        counts = np.minimum(ranges / UNIT_M, FARTHEST)
        # Half a count; a diagonal meets corners of cells exactly, and rounding decides the side.
        off = np.abs(table[i, :DIRECTIONS] - counts) > 0.5 + 1e-6
        off[DIRECTIONS // 8 :: DIRECTIONS // 4] = False
        assert not off.any()


def test_every_row_is_written_twice():
    _, table = build(random_grid(3, (40, 50), 0.05))
    np.testing.assert_array_equal(table[:, :DIRECTIONS], table[:, DIRECTIONS:])


@pytest.mark.parametrize("quarter", [1, 2, 3])
def test_turning_the_map_shifts_the_rows(quarter):
    cells = np.zeros((41, 41), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = OCCUPIED
    cells[5:9, 28:33] = OCCUPIED
    resolution = 0.25  # one position a cell: turned, positions fall on positions
    straight = dict(by_cell(OccupancyGrid(cells, resolution)))
    # Row 0 is below: against the clock on the floor is with it in memory.
    turned = dict(by_cell(OccupancyGrid(np.rot90(cells, -quarter).copy(), resolution)))
    where = np.rot90(np.arange(cells.size).reshape(cells.shape), -quarter).ravel()
    shifted = 0
    for cell, row in turned.items():
        before = np.roll(straight[int(where[cell])], quarter * DIRECTIONS // 4)
        # Where a ray touches a corner the two may decide differently.
        shifted += np.count_nonzero(row != before)
    assert shifted <= 0.01 * len(turned) * DIRECTIONS


def by_cell(grid):
    positions, table = build(grid)
    index = positions.rows * grid.width + positions.columns
    return zip(index.tolist(), table[:, :DIRECTIONS], strict=True)


def test_what_is_out_of_reach_reads_as_the_farthest():
    cells = np.zeros((3, 300), np.int8)
    cells[:, -1] = OCCUPIED
    positions, table = build(OccupancyGrid(cells, 0.25))  # 75 m long
    x, _ = positions.centres(np.arange(len(positions)))
    distance = (299 - x) * 0.25
    east, west = table[:, 0], table[:, DIRECTIONS // 2]
    assert (west == FARTHEST).all()
    assert (east[distance > REACH_M] == FARTHEST).all()
    near = distance < REACH_M - UNIT_M
    np.testing.assert_allclose(east[near] * UNIT_M, distance[near], atol=0.5 * UNIT_M + 1e-9)


def test_unknown_space_is_transparent():
    cells = np.full((1, 40), UNKNOWN, np.int8)
    cells[0, 0], cells[0, -1] = FREE, OCCUPIED
    _, table = build(OccupancyGrid(cells, 0.25))
    assert table[0, 0] == round(38.5 * 0.25 / UNIT_M)
