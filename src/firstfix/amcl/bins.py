"""Bins of poses, and a hash table of bins."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel

# As in AMCL: 0.5 m x 0.5 m x 10 degrees.
BIN_M = 0.5
BIN_RAD = math.radians(10.0)
HEADINGS = 36

EMPTY = -1

# A tracking belief fills some tens of bins: tables start small and stay in the L1 cache.
FIRST_ENTRIES = 128


@kernel
def bin_of(x: float, y: float, yaw: float) -> tuple[int, int, int]:
    """Return the bin of a pose; the heading is counted from 0 to 35."""
    turn = math.floor(yaw / BIN_RAD) % HEADINGS
    return math.floor(x / BIN_M), math.floor(y / BIN_M), turn


@kernel
def new_table(entries: int) -> NDArray[np.int64]:
    """Make an empty hash table for this many bins: a column of keys, a column of values."""
    size = 16
    while size < 2 * entries:
        size *= 2
    return np.full((size, 2), EMPTY, np.int64)


@kernel
def with_room(table: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return a table with the same entries and room for one more than ``count``; it may be new."""
    if 2 * (count + 1) <= table.shape[0]:
        return table
    wider = new_table(table.shape[0])
    for row in range(table.shape[0]):
        if table[row, 0] != EMPTY:
            slot = slot_of(wider, table[row, 0])
            wider[slot, 0], wider[slot, 1] = table[row, 0], table[row, 1]
    return wider


@kernel
def key_of(x: int, y: int, turn: int) -> int:
    """Pack a bin into one number, never negative; bins 8000 km apart share one."""
    return ((x & 0x1FFFFFF) << 31) | ((y & 0x1FFFFFF) << 6) | turn


@kernel
def slot_of(table: NDArray[np.int64], key: int) -> int:
    """Return the row of the table that holds a key, or the empty one where it belongs."""
    last = table.shape[0] - 1
    # Fibonacci hashing: neighbouring bins differ in a few bits, and get rows far apart. The bits
    # from 32 on depend on all of the key, column included; lower ones only on what is below them.
    slot: int = ((key * 0x9E3779B97F4A7C1) >> 32) & last
    while table[slot, 0] != EMPTY and table[slot, 0] != key:
        slot = (slot + 1) & last
    return slot
