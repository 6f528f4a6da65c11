"""Splitting a field into phases loses nothing and moves nothing."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from firstfix.fields.phased_field import PhasedField, lay_out
from firstfix.fields.search_grid import TILE_COLUMNS, TILE_ROWS

sides = st.integers(1, 4)
phase_counts = st.integers(1, 5)
margins = st.integers(1, 4)
sizes = st.integers(1, 30)
seeds = st.integers(0, 2**32 - 1)


def with_margin(seed: int, height: int, width: int, phases: int, margin: int) -> NDArray[np.uint16]:
    """A field without two equal values, so that a wrong place shows."""
    shape = (height + 2 * margin * phases, width + 2 * margin * phases)
    values = np.random.default_rng(seed).permutation(shape[0] * shape[1]) + 1
    return values.astype(np.uint16).reshape(shape)


def read(field: PhasedField, block: tuple[int, int], dy: float, dx: float) -> int:
    row, column = (np.array([n], np.int32) for n in block)
    index = field.base(row, column) + field.offsets(np.array([dy]), np.array([dx]))
    return int(field.values[index[0]])


@settings(deadline=None)
@given(seeds, sizes, sizes, sides, phase_counts, margins, st.data())
def test_an_end_point_reads_the_cell_it_lies_in(seed, height, width, side, phases, margin, data):
    """Wherever a block stands, in the map or in its margin."""
    padded = with_margin(seed, height, width, phases, margin)
    field = lay_out(padded, side, phases, margin)
    row = data.draw(st.integers(0, (height - 1) // phases), "row of the block")
    column = data.draw(st.integers(0, (width - 1) // phases), "column of the block")
    y = data.draw(st.integers(0, padded.shape[0] - 1), "row of the field")
    x = data.draw(st.integers(0, padded.shape[1] - 1), "column of the field")
    within_y, within_x = data.draw(st.tuples(st.floats(0.0, 0.999), st.floats(0.0, 0.999)))
    dy = (y - (margin + row) * phases + within_y) * side
    dx = (x - (margin + column) * phases + within_x) * side
    assert read(field, (row, column), dy, dx) == padded[y, x]


@settings(deadline=None)
@given(seeds, sizes, sizes, phase_counts, margins)
def test_neighbouring_blocks_read_neighbouring_values(seed, height, width, phases, margin):
    field = lay_out(with_margin(seed, height, width, phases, margin), 1, phases, margin)
    rows, columns = np.mgrid[: -(-height // phases), : -(-width // phases)].astype(np.int32)
    base = field.base(rows, columns)
    assert (np.diff(base, axis=1) == 1).all()
    assert (np.diff(base, axis=0) == field.columns).all()


@settings(deadline=None)
@given(seeds, sizes, sizes, sides, phase_counts, margins)
def test_a_whole_tile_may_be_read_from_any_end_point(seed, height, width, side, phases, margin):
    """The kernels read tiles of full size also at the upper right corner."""
    field = lay_out(with_margin(seed, height, width, phases, margin), side, phases, margin)
    last = np.array([(height - 1) // phases], np.int32), np.array([(width - 1) // phases], np.int32)
    # Every phase, at the far end of the margin.
    reach = np.arange(margin * phases * side, (margin + 1) * phases * side, dtype=np.float64)
    farthest = field.base(*last) + field.offsets(reach[:, None], reach[None, :])
    tile = (TILE_ROWS - 1) * field.columns + TILE_COLUMNS
    assert farthest.max() + tile <= field.values.size


def test_every_value_is_there_once():
    padded = with_margin(1, 7, 9, 3, 2)
    field = lay_out(padded, 2, 3, 2)
    kept = field.values[field.values > 0]
    assert sorted(kept.tolist()) == sorted(padded.ravel().tolist())
    assert field.values.dtype == padded.dtype


def test_a_drawn_field():
    # Two phases, a margin of one block; the map's own cells are 1 to 4.
    padded = np.pad(np.array([[1, 2], [3, 4]], np.uint8), 2, constant_values=9)
    field = lay_out(padded, 1, 2, 1)
    assert [read(field, (0, 0), y + 0.5, x + 0.5) for y in (0, 1) for x in (0, 1)] == [1, 2, 3, 4]
    assert read(field, (0, 0), -0.1, 0.5) == 9
    assert read(field, (0, 0), 0.5, 2.0) == 9
