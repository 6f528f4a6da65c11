"""Where a search looks: every free place, gathered into tiles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.fields.search_grid import SPACING_M, TILE_COLUMNS, TILE_ROWS, build_search_grid

cells = arrays(
    np.int8,
    array_shapes(min_dims=2, max_dims=2, max_side=60),
    elements=st.sampled_from([UNKNOWN, FREE, FREE, FREE, OCCUPIED]),
)
resolutions = st.sampled_from([0.01, 0.02, 0.05, 0.1, 0.25])
hall = OccupancyGrid(np.zeros((300, 900), np.int8), 0.05)


@settings(deadline=None)
@given(cells, resolutions, st.sampled_from([None, 0.1, 0.5]), st.integers(0, 1000))
def test_exactly_the_free_blocks_that_someone_has_seen_are_searched(cells, resolution, share, seed):
    unseen = None if share is None else np.random.default_rng(seed).random(cells.shape) < share
    grid = OccupancyGrid(cells, resolution, unseen=unseen)
    free = grid.free if unseen is None else grid.free & ~unseen
    positions = build_search_grid(grid)
    found = set(zip(positions.rows.tolist(), positions.columns.tolist(), strict=True))
    stride = positions.stride
    for row in range(-(-grid.height // stride)):
        for column in range(-(-grid.width // stride)):
            y, x = row * stride + stride // 2, column * stride + stride // 2
            inside = y < grid.height and x < grid.width
            block = free[row * stride : (row + 1) * stride, column * stride : (column + 1) * stride]
            mostly_free = 2 * np.count_nonzero(block) >= stride**2
            searched = inside and not grid.occupied[y, x] and (free[y, x] or mostly_free)
            assert ((row, column) in found) == searched


@settings(deadline=None)
@given(cells, resolutions)
def test_positions_are_centres_of_cells_without_a_wall(cells, resolution):
    grid = OccupancyGrid(cells, resolution)
    positions = build_search_grid(grid)
    x, y = positions.centres(np.arange(len(positions)))
    assert (x % 1.0 == 0.5).all()
    assert (y % 1.0 == 0.5).all()
    assert not grid.occupied[y.astype(int), x.astype(int)].any()
    assert (x.astype(int) // positions.stride == positions.columns).all()
    assert (y.astype(int) // positions.stride == positions.rows).all()


@settings(deadline=None)
@given(cells, resolutions)
def test_tiles_hold_every_position_once_in_order(cells, resolution):
    positions = build_search_grid(OccupancyGrid(cells, resolution))
    assert positions.tile_starts[0] == 0
    assert positions.tile_starts[-1] == len(positions)
    assert len(positions.tile_starts) == len(positions.tile_rows) + 1
    assert (np.diff(positions.tile_starts) > 0).all()
    tile = np.repeat(np.arange(len(positions.tile_rows)), np.diff(positions.tile_starts))
    within_row = positions.rows - positions.tile_rows[tile]
    within_column = positions.columns - positions.tile_columns[tile]
    assert ((within_row >= 0) & (within_row < TILE_ROWS)).all()
    assert ((within_column >= 0) & (within_column < TILE_COLUMNS)).all()
    order = (tile * TILE_ROWS + within_row) * TILE_COLUMNS + within_column
    assert (np.diff(order) > 0).all()


def test_a_map_without_free_space_has_no_position():
    positions = build_search_grid(OccupancyGrid(np.full((9, 9), UNKNOWN, np.int8), 0.05))
    assert len(positions) == 0
    assert positions.tile_starts.tolist() == [0]


@pytest.mark.parametrize("resolution", [0.01, 0.02, 0.025, 0.05, 0.1, 0.2, 0.25])
def test_positions_have_the_spacing_for_any_size_of_cells(resolution):
    stride = build_search_grid(OccupancyGrid(np.zeros((50, 50), np.int8), resolution)).stride
    assert stride == 1 or stride % 2 == 0
    assert abs(stride * resolution - SPACING_M) <= max(resolution, 0.05)


def test_tiles_of_a_hall():
    positions = build_search_grid(hall)
    across = -(-900 // positions.stride // TILE_COLUMNS)
    up = -(-300 // positions.stride // TILE_ROWS)
    assert len(positions.tile_rows) == up * across
    assert len(positions) == (900 // positions.stride) * (300 // positions.stride)
