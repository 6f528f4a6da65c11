"""Poses of one bin are near each other, and the table finds every bin again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstfix.amcl.bins import (
    BIN_M,
    BIN_RAD,
    EMPTY,
    HEADINGS,
    bin_of,
    key_of,
    new_table,
    slot_of,
    with_room,
)
from firstfix.core.angles import FULL_TURN, angle_error

places = st.floats(-1e4, 1e4)
yaws = st.floats(-math.pi, math.pi)
columns = st.integers(-(2**24), 2**24 - 1)
bins = st.tuples(columns, columns, st.integers(0, HEADINGS - 1))


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ((0.0, 0.0, 0.0), (0, 0, 0)),
        ((0.49, 0.5, math.radians(9.9)), (0, 1, 0)),
        ((-0.01, -0.51, math.radians(10.1)), (-1, -2, 1)),
        ((3.2, -7.0, math.radians(-0.1)), (6, -14, 35)),
        ((0.0, 0.0, math.pi), (0, 0, 18)),
        ((0.0, 0.0, math.radians(-179.9)), (0, 0, 18)),
        ((0.0, 0.0, math.radians(179.9)), (0, 0, 17)),
    ],
)
def test_poses_and_their_bins(pose, expected):
    assert bin_of(*pose) == expected


def test_the_bins_are_those_of_amcl():
    assert BIN_M == 0.5
    assert pytest.approx(FULL_TURN) == BIN_RAD * HEADINGS


@settings(deadline=None)
@given(places, places, yaws)
def test_a_pose_lies_in_its_bin(x, y, yaw):
    column, row, turn = bin_of(x, y, yaw)
    assert column * BIN_M <= x < (column + 1) * BIN_M
    assert row * BIN_M <= y < (row + 1) * BIN_M
    assert 0 <= turn < HEADINGS
    assert angle_error((turn + 0.5) * BIN_RAD, yaw) <= BIN_RAD / 2 + 1e-9


@settings(deadline=None)
@given(bins, bins)
def test_two_bins_never_share_a_key(a, b):
    assert (key_of(*a) == key_of(*b)) == (a == b)
    assert key_of(*a) >= 0  # so that it is never the mark of an empty row


@settings(deadline=None)
@given(st.lists(bins, max_size=200))
def test_the_table_is_a_dictionary(keys):
    table, twin = new_table(len(keys)), {}
    for k in (key_of(*b) for b in keys):
        slot = slot_of(table, k)
        if table[slot, 0] == EMPTY:
            assert k not in twin
            table[slot] = k, len(twin)
            twin[k] = len(twin)
        assert table[slot].tolist() == [k, twin[k]]
    assert {k: v for k, v in table.tolist() if k != EMPTY} == twin


@settings(deadline=None)
@given(st.lists(bins, max_size=200, unique=True))
def test_a_table_that_grows_keeps_its_entries(found):
    table = new_table(1)
    for count, key in enumerate(key_of(*b) for b in found):
        table = with_room(table, count)
        table[slot_of(table, key)] = key, count
        assert 2 * (count + 1) <= len(table)
    entries = {k: v for k, v in table.tolist() if k != EMPTY}
    assert entries == {key_of(*b): i for i, b in enumerate(found)}


@pytest.mark.parametrize("entries", [0, 1, 8, 9, 500, 2000])
def test_a_table_is_never_more_than_half_full(entries):
    """So that the search for a row always meets an empty one, and soon."""
    table = new_table(entries)
    size = len(table)
    assert size >= max(1, 2 * entries)
    assert size & (size - 1) == 0
    assert (table == EMPTY).all()


@pytest.mark.parametrize(
    "shape", [(1000, 1, 1), (1, 1000, 1), (32, 31, 1), (10, 10, 10), (5, 5, 36)]
)
def test_neighbouring_bins_get_rows_far_apart(shape):
    """A table in which they pile up is searched from end to end, a thousand times slower."""
    keys = [key_of(*b) for b in np.ndindex(shape)]
    table = new_table(len(keys))
    # By chance alone, as many keys as half of the rows would fall on 79 % of their number.
    assert len({int(slot_of(table, key)) for key in keys}) > 0.7 * len(keys)


def test_the_table_is_full_of_ints():
    assert new_table(3).dtype == np.int64
