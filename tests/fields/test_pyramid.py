import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from firstfix.fields.pyramid import min_pyramid

fields = arrays(np.uint8, array_shapes(min_dims=2, max_dims=2, max_side=20))


def test_level_zero_is_the_field():
    field = np.array([[3, 1], [2, 9]], np.uint8)
    (level,) = min_pyramid(field, 1, 63)
    assert level is field


def test_a_drawn_field():
    field = np.array([[5, 4, 9], [9, 9, 9], [7, 9, 9]], np.uint8)
    assert [level.tolist() for level in min_pyramid(field, 3, 8)] == [
        [[5, 4, 9], [9, 9, 9], [7, 9, 9]],
        [[4, 4, 8], [7, 9, 8], [7, 8, 8]],
        [[4, 4, 8], [7, 8, 8], [7, 8, 8]],
    ]


@given(fields, st.integers(1, 7), st.integers(0, 255))
def test_each_level_is_the_minimum_of_its_windows(field, levels, outside):
    pyramid = min_pyramid(field, levels, outside)
    assert len(pyramid) == levels
    for k, level in enumerate(pyramid):
        side = 2**k
        padded = np.pad(field, (0, side - 1), constant_values=outside)
        windows = np.lib.stride_tricks.sliding_window_view(padded, (side, side))
        np.testing.assert_array_equal(level, windows.min(axis=(2, 3)))


@given(fields, st.integers(2, 5), st.data())
def test_no_shift_within_the_block_finds_less(field, levels, data):
    k = data.draw(st.integers(0, levels - 1))
    up, right = data.draw(st.integers(0, 2**k - 1)), data.draw(st.integers(0, 2**k - 1))
    bound = min_pyramid(field, levels, 255)[k]
    shifted = field[up:, right:]
    assert (bound[: shifted.shape[0], : shifted.shape[1]] <= shifted).all()


@given(fields, st.integers(0, 255))
def test_bounds_only_loosen_from_level_to_level(field, outside):
    pyramid = min_pyramid(field, 6, outside)
    for finer, coarser in itertools.pairwise(pyramid):
        assert (coarser <= finer).all()


def test_the_field_is_not_changed():
    field = np.arange(16, dtype=np.uint8).reshape(4, 4)
    field.flags.writeable = False
    min_pyramid(field, 4, 0)
    assert field.tolist() == np.arange(16).reshape(4, 4).tolist()


def test_no_level_is_refused():
    with pytest.raises(ValueError, match="at least 1, not 0"):
        min_pyramid(np.zeros((1, 1), np.uint8), 0, 0)
