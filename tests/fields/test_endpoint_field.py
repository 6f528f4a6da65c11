"""What an end point costs is its distance to the nearest wall, up to a limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from firstfix.fields.distance import MAX_LIMIT, euclidean_distance, truncated_squares
from firstfix.fields.endpoint_field import LIMIT, LIMIT_M, UNIT_M, build_endpoint_field
from firstfix.fields.phased_field import PhasedField

maps = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=40))
strides = st.sampled_from([1, 2, 4, 6])
resolutions = st.sampled_from([0.02, 0.05, 0.25])


def build(
    occupied: NDArray[np.bool_], resolution: float, stride: int, reach_m: float = 3.0
) -> PhasedField:
    return build_endpoint_field(squares(occupied, resolution), resolution, stride, reach_m)


def squares(occupied: NDArray[np.bool_], resolution: float) -> NDArray[np.uint16]:
    return truncated_squares(occupied, min(MAX_LIMIT, int(LIMIT_M / resolution) + 2))


def read_at(field: PhasedField, stride: int, y: float, x: float, block: tuple[int, int]) -> int:
    """Value at (y, x) cells of the map, seen from a block."""
    base = field.base(np.array(block[0], np.int32), np.array(block[1], np.int32))
    return int(
        field.values[
            base + field.offsets(np.array(y - block[0] * stride), np.array(x - block[1] * stride))
        ]
    )


@settings(deadline=None, max_examples=50)
@given(maps, strides, resolutions)
def test_every_cell_is_the_mean_distance_of_what_it_covers(occupied, stride, resolution):
    field = build(occupied, resolution, stride)
    counts = np.minimum(euclidean_distance(occupied) * resolution / UNIT_M, LIMIT)
    side = max(1, stride // 2)
    for y in range(0, occupied.shape[0], side):
        for x in range(0, occupied.shape[1], side):
            mean = counts[y : y + side, x : x + side].mean()
            assert abs(read_at(field, stride, y + 0.5, x + 0.5, (0, 0)) - mean) <= 0.501


@settings(deadline=None, max_examples=50)
@given(maps, strides, resolutions, st.floats(-np.pi, np.pi), st.floats(0.0, 3.0), st.data())
def test_beams_up_to_the_reach_stay_in_the_field(
    occupied, stride, resolution, angle, range_m, data
):
    """From any block in any direction; outside the map they cost the limit."""
    field = build(occupied, resolution, stride)
    block = tuple(data.draw(st.integers(0, (n - 1) // stride)) for n in occupied.shape)
    start = [n * stride + stride // 2 + 0.5 for n in block]
    y = start[0] + range_m / resolution * np.sin(angle)
    x = start[1] + range_m / resolution * np.cos(angle)
    value = read_at(field, stride, y, x, block)
    side = max(1, stride // 2)
    rows, columns = (-(-n // side) * side for n in occupied.shape)
    if 0 <= y < rows and 0 <= x < columns:
        # The same cell, seen from another block.
        assert value == read_at(field, stride, y, x, (0, 0))
    else:
        assert value == LIMIT


@pytest.mark.parametrize("stride", [1, 2, 4, 6])
@pytest.mark.parametrize("reach_m", [0.01, 1.0, 2.4, 3.0, 3.07])
def test_the_margin_holds_the_longest_beam(stride, reach_m):
    """Beyond it a beam would read another row, or another phase."""
    field = build(np.ones((7, 9), np.bool_), 0.05, stride, reach_m)
    for sign in (-1.0, 1.0):
        end = stride // 2 + 0.5 + sign * reach_m / 0.05
        assert -field.margin <= end // stride <= field.margin
    assert field.rows >= 2 * field.margin + -(-7 // stride)
    assert field.columns >= 2 * field.margin + -(-9 // stride)


def test_a_wall_costs_nothing_and_what_is_far_from_it_the_limit():
    occupied = np.zeros((60, 60), np.bool_)
    occupied[:, 30] = True
    field = build(occupied, 0.05, 1)
    row = [read_at(field, 1, 20.5, x + 0.5, (0, 0)) for x in range(60)]
    expected = [min(abs(x - 30) * 0.05 / UNIT_M, LIMIT) for x in range(60)]
    assert row == [round(count) for count in expected]


def test_only_bytes_up_to_the_limit():
    occupied = np.random.default_rng(4).random((50, 70)) < 0.01
    field = build(occupied, 0.05, 4)
    assert field.values.dtype == np.uint8
    assert field.values.max() == LIMIT


@pytest.mark.parametrize("stride", [1, 2, 4])
def test_a_map_without_walls_costs_the_limit_everywhere(stride):
    field = build(np.zeros((9, 13), np.bool_), 0.05, stride)
    assert {read_at(field, stride, y, x, (0, 0)) for y in range(9) for x in range(13)} == {LIMIT}
