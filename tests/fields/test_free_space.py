import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from firstfix.fields.free_space import free_positions

maps = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=25))


def draw(*rows: str):
    return np.array([[cell == "." for cell in row] for row in rows])


def positions(free, stride):
    return list(zip(*(a.tolist() for a in free_positions(free, stride)), strict=True))


def test_middle_of_the_block_or_the_free_cell_nearest_to_it():
    assert positions(draw("...", "...", "..."), 3) == [(1.5, 1.5)]
    assert positions(draw("...", ".#.", "..."), 3) == [(1.5, 0.5)]
    assert positions(draw("##.", "###", "#.."), 3) == [(1.5, 2.5)]
    assert positions(draw("####", "####", "##..", "##.."), 4) == [(2.0, 2.0)]
    assert positions(draw("...#", "...#", "..##", "####"), 4) == [(1.5, 1.5)]
    assert positions(draw("##", "##"), 2) == []


def test_blocks_are_cut_by_the_edge():
    assert positions(draw(".....", "....."), 4) == [(1.5, 1.5), (4.5, 1.5)]


def test_stride_one_is_every_free_cell():
    free = draw(".#.", "#..")
    assert positions(free, 1) == [(0.5, 0.5), (2.5, 0.5), (1.5, 1.5), (2.5, 1.5)]


@settings(deadline=None)  # the first call compiles
@given(maps, st.integers(1, 9))
def test_every_block_with_a_free_cell_has_one_position_and_that_is_free(free, stride):
    columns, rows = free_positions(free, stride)
    assert free[np.floor(rows).astype(int), np.floor(columns).astype(int)].all()
    blocks = list(zip((rows // stride).tolist(), (columns // stride).tolist(), strict=True))
    expected = sorted({(r // stride, c // stride) for r, c in np.argwhere(free).tolist()})
    assert blocks == expected
    r, c = np.nonzero(free)
    for column, row in zip(columns, rows, strict=True):
        own = (r // stride == row // stride) & (c // stride == column // stride)
        middle = (row // stride + 0.5) * stride, (column // stride + 0.5) * stride
        nearest = np.hypot(r[own] + 0.5 - middle[0], c[own] + 0.5 - middle[1]).min()
        assert np.hypot(row - middle[0], column - middle[1]) <= nearest + 1e-12


def test_a_stride_below_one_is_refused():
    with pytest.raises(ValueError, match="at least 1 cell, not 0"):
        free_positions(draw("."), 0)
