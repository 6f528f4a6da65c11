"""A sweep counts how far every cell sees in one direction."""

from __future__ import annotations

import numpy as np
import pytest

from firstfix.fields.kernel_cache import kernel
from firstfix.fields.sweep import free_cells, in_threads, lines, next_row


@kernel
def counted(free, line, turns, step, far):
    height, width = free.shape[0] - 2, free.shape[1] - 2
    found = np.empty((height, width), np.uint16)
    after = np.full(width + 2, far, np.uint16)
    for i in range(height):
        r = i if step > 0 else height - 1 - i
        shift = 1 + line[r + 1 - step] - line[r + 1]
        beside = free[r + 1, shift:] if turns[r] == 1 else free[r + 1 - step, 1:]
        next_row(after, free[r + 1, 1:], beside, shift, turns[r], far, found[r])
    return found


def swept(occupied, direction, upright, offset=0.25):
    free = free_cells(occupied, upright)
    (line,) = (
        line for line in lines(16, len(free) - 2, upright, offset) if line.index == direction
    )
    return counted(free, line.columns, line.turns, line.step, np.uint16(99)), line


def test_rows_are_two_steps_along_an_axis():
    occupied = np.zeros((6, 3), np.bool_)
    occupied[5, 1] = True
    up, line = swept(occupied, 4, True)
    assert up[:, 1].tolist() == [10, 8, 6, 4, 2, 0]
    assert up[0, 0] == 99
    assert line.per_row == pytest.approx(1.0)
    down, _ = swept(occupied, 12, True)
    assert (down[:5, 1] == 99).all()
    right, _ = swept(occupied, 0, False)
    assert right.T[5].tolist() == [2, 0, 99]


def test_a_wall_at_the_side_is_an_odd_number_of_steps():
    occupied = np.zeros((8, 8), np.bool_)
    occupied[:, 6] = True
    found, line = swept(occupied, 3, True)  # steep, to the right: the wall is met from its side
    assert (found[:2, 5] % 2 == 1).all()
    assert line.direction == pytest.approx((np.cos(3 * np.pi / 8), np.sin(3 * np.pi / 8)))


def test_diagonals_do_not_pass_between_walls_that_touch():
    occupied = np.eye(8, dtype=np.bool_)[::-1]
    upright = 2 in {line.index for line in lines(16, 8, True)}  # by rounding
    found, _ = swept(occupied, 2, upright)
    below = np.add.outer(np.arange(8), np.arange(8)) < 7
    assert (found[below] < 99).all()


def test_each_direction_is_swept_once():
    indices = [line.index for upright in (True, False) for line in lines(16, 9, upright)]
    assert sorted(indices) == list(range(16))


def test_threads_return_results_in_order():
    assert list(in_threads(abs, range(-9, 9))) == [(i, abs(i)) for i in range(-9, 9)]
