"""What can be seen from anywhere in a block of 0.4 m: the shortest and longest range by direction.

A scan from this block lies between the two, whatever its place in the block, up to noise and
changes. So a first look needs a quarter of the positions and half of the headings of the search.

The ranges are not cast ray by ray, but swept (`fields.sweep`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel
from firstfix.fields.range_table import FARTHEST, UNIT_M
from firstfix.fields.sweep import Line, free_cells, in_threads, lines, next_row

LOOK_DIRECTIONS = 64
"""Directions, and headings of the first look."""

BLOCKS = 2
"""Positions of the search to the side of a block of the look."""

# A sensor keeps this distance from walls: else a block across a thin wall sees both its sides.
_KEPT_M = 0.1

# Parts of a block that a wall separates are entries of their own, from this share of its cells.
_LEAST_SHARE = 0.12

# Samples of a block, along each side.
_SAMPLES = 4

# Sweeps between two directions: each entry covers those to both sides as well.
_BETWEEN = 2


@dataclass(frozen=True, eq=False)
class LookTable:
    """Entries of the first look, in the order of the rows of their blocks.

    Parameters
    ----------
    stride : int
        Side of a block, cells.
    rows, columns : ndarray of int32, shape (n,)
        Block coordinates.
    bounds : ndarray of uint8, shape (n, 2, LOOK_DIRECTIONS)
        Shortest and longest range, counts of `range_table.UNIT_M`, counter-clockwise from the
        grid's x axis.
    """

    stride: int
    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    bounds: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def spreads(self) -> NDArray[np.uint16]:
        """Mean of log2(1 + width / 0.4 m) of an entry over all directions, 1/64, shape (n,)."""
        logs = np.log2((np.arange(256) + 4.0) / 4.0).astype(np.float32)
        widths = self.bounds[:, 1] - self.bounds[:, 0]
        means = [logs[part].mean(axis=1) for part in np.array_split(widths, 1 + len(self) // 4096)]
        return np.rint(64.0 * np.concatenate(means)).astype(np.uint16)

    def packed(self) -> NDArray[np.uint8]:
        """Return all of it as one array; `unpacked` reads it."""
        numbers = np.concatenate([np.array([self.stride], np.int32), self.rows, self.columns])
        return np.concatenate([numbers.view(np.uint8), self.bounds.ravel()])

    @classmethod
    def unpacked(cls, packed: NDArray[np.uint8]) -> LookTable:
        """Read what `packed` wrote; the ranges stay where they are."""
        n = (len(packed) - 4) // (8 + 2 * LOOK_DIRECTIONS)
        numbers = packed[: 4 + 8 * n].view(np.int32)
        bounds = packed[4 + 8 * n :].reshape(n, 2, LOOK_DIRECTIONS)
        return cls(int(numbers[0]), numbers[1 : 1 + n], numbers[1 + n :], bounds)


def build_look_table(
    occupied: NDArray[np.bool_],
    seen_free: NDArray[np.bool_],
    clearance: NDArray[np.uint8],
    resolution: float,
    stride: int,
) -> LookTable:
    """Sweep a map in all directions.

    Parameters
    ----------
    occupied, seen_free : ndarray of bool, shape (height, width)
        Walls, and cells where a sensor may be.
    clearance : ndarray of uint8, shape (height, width)
        Of the map, from `clearance.chessboard_clearance`.
    resolution : float
        Side of a cell, m.
    stride : int
        Side of a block, cells.

    Returns
    -------
    LookTable
        An entry for each part of a block with free space.
    """
    standing = seen_free & (clearance > max(1, round(_KEPT_M / resolution)))
    rows, columns, samples = _label(standing, stride, max(1.0, _LEAST_SHARE * stride**2))
    directions = _BETWEEN * LOOK_DIRECTIONS
    low = np.full((LOOK_DIRECTIONS, len(rows)), FARTHEST, np.uint8)
    high = np.zeros((LOOK_DIRECTIONS, len(rows)), np.uint8)
    for upright in (True, False):
        free = free_cells(occupied, upright)
        starts, order, places = _bands(rows if upright else columns, samples, stride, upright)
        sweep = partial(_swept, free, starts, places, resolution, stride)
        for line, found in in_threads(sweep, lines(directions, len(free) - 2, upright)):
            # A direction of the table covers the sweeps halfway to its neighbours.
            for d in {line.index // _BETWEEN, -(-line.index // _BETWEEN) % LOOK_DIRECTIONS}:
                low[d, order] = np.minimum(low[d, order], found[0])
                high[d, order] = np.maximum(high[d, order], found[1])
        del free, places, sweep
    bounds = np.empty((len(rows), 2, LOOK_DIRECTIONS), np.uint8)
    bounds[:, 0], bounds[:, 1] = low.T, high.T
    return LookTable(stride, rows, columns, bounds)


def _bands(
    blocks: NDArray[np.int32],
    samples: NDArray[np.int32],
    stride: int,
    upright: bool,  # noqa: FBT001 - no option: the map lies or stands
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.uint32]]:
    """Sort entries by rows of blocks: the first of each row, the order, and samples (2, n, 16)."""
    order = np.argsort(blocks, kind="stable")
    starts = np.searchsorted(blocks[order], np.arange(int(blocks.max(initial=0)) + 2))
    row, column = (samples[0], samples[1]) if upright else (samples[1], samples[0])
    # Unsigned, as in the kernels.
    places = np.stack([row[order] % np.int32(stride), column[order]]).astype(np.uint32)
    return starts, order, places


@kernel
def _label(
    standing: NDArray[np.bool_], stride: int, least: float
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Find the connected parts of every block: rows, columns, and samples (2, n, 16) of each."""
    height, width = standing.shape
    down, across = (height + stride - 1) // stride, (width + stride - 1) // stride
    inside = np.empty((stride * stride, 2), np.int32)
    waiting = np.empty((stride * stride, 2), np.int32)
    rows, columns = np.empty(0, np.int32), np.empty(0, np.int32)
    samples = np.empty((2, 0, _SAMPLES * _SAMPLES), np.int32)
    for counting in (True, False):  # first how many, then which
        n = 0
        seen = np.zeros((height, width), np.bool_)
        for block in range(down * across):
            top, left = block // across * stride, block % across * stride
            bottom, right = min(height, top + stride), min(width, left + stride)
            for r in range(top, bottom):
                for c in range(left, right):
                    if seen[r, c] or not standing[r, c]:
                        continue
                    corners = (top, left, bottom, right)
                    size = _flood(standing, seen, r, c, corners, waiting, inside)
                    if size < least:
                        continue
                    if not counting:
                        rows[n], columns[n] = block // across, block % across
                        _choose_samples(inside, size, top, left, stride, samples[:, n])
                    n += 1
        if counting:
            rows, columns = np.empty(n, np.int32), np.empty(n, np.int32)
            samples = np.empty((2, n, _SAMPLES * _SAMPLES), np.int32)
    return rows, columns, samples


@kernel
def _flood(
    standing: NDArray[np.bool_],
    seen: NDArray[np.bool_],
    r: int,
    c: int,
    corners: tuple[int, int, int, int],
    waiting: NDArray[np.int32],
    inside: NDArray[np.int32],
) -> int:
    """Write the cells of a block that are connected with one of them; return their number."""
    top, left, bottom, right = corners
    size, n = 0, 1
    waiting[0, 0], waiting[0, 1] = r, c
    seen[r, c] = True
    while n > 0:
        n -= 1
        y, x = waiting[n, 0], waiting[n, 1]
        inside[size, 0], inside[size, 1] = y, x
        size += 1
        for q in range(4):
            v, u = y + (q == 0) - (q == 1), x + (q == 2) - (q == 3)
            if top <= v < bottom and left <= u < right and standing[v, u] and not seen[v, u]:
                seen[v, u] = True
                waiting[n, 0], waiting[n, 1] = v, u
                n += 1
    return size


@kernel
def _choose_samples(
    inside: NDArray[np.int32], size: int, top: int, left: int, stride: int, out: NDArray[np.int32]
) -> None:
    """Choose cells on a lattice, or any where it meets none; repeat them until all are written."""
    step = max(1, stride // _SAMPLES)
    most, n = out.shape[1], 0
    for i in range(size):
        y, x = inside[i, 0], inside[i, 1]
        if (y - top) % step == step // 2 and (x - left) % step == step // 2 and n < most:
            out[0, n], out[1, n] = y, x
            n += 1
    if n == 0:
        n = min(size, most)
        out[0, :n], out[1, :n] = inside[:n, 0], inside[:n, 1]
    for i in range(n, most):
        out[0, i], out[1, i] = out[0, i - n], out[1, i - n]


def _swept(
    free: NDArray[np.uint8],
    starts: NDArray[np.int64],
    places: NDArray[np.uint32],
    resolution: float,
    stride: int,
    line: Line,
) -> NDArray[np.uint8]:
    """Return the shortest and longest range of every entry in one direction, shape (2, n)."""
    counts_per_step = 0.5 * resolution * line.per_row / UNIT_M
    far = np.uint16(math.ceil(FARTHEST / counts_per_step) + 1)
    found = np.empty((2, places.shape[1]), np.uint8)
    _sweep(
        free,
        line.columns,
        line.turns,
        line.step,
        far,
        stride,
        starts,
        places,
        counts_per_step,
        found,
    )
    return found


@kernel
def _sweep(  # noqa: PLR0913 - a kernel takes its arrays one by one
    free: NDArray[np.uint8],
    line: NDArray[np.int64],
    turns: NDArray[np.uint16],
    step: int,
    far: np.uint16,
    stride: int,
    starts: NDArray[np.int64],
    places: NDArray[np.uint32],
    scale: float,
    found: NDArray[np.uint8],
) -> None:
    """Sweep from the far end, and write the shortest and longest ranges a band at a time."""
    height, width = free.shape[0] - 2, free.shape[1] - 2
    band = np.empty((stride, width), np.uint16)
    after = np.full(width + 2, far, np.uint16)
    for i in range(height):
        r = i if step > 0 else height - 1 - i
        shift = 1 + line[r + 1 - step] - line[r + 1]
        beside = free[r + 1, shift:] if turns[r] == 1 else free[r + 1 - step, 1:]
        next_row(after, free[r + 1, 1:], beside, shift, turns[r], far, band[r % stride])
        block = r // stride
        is_whole = i == height - 1 or (r + step) // stride != block
        if is_whole and block + 1 < starts.shape[0]:
            _find_bounds(band, places, starts[block], starts[block + 1], scale, found)


@kernel
def _find_bounds(
    band: NDArray[np.uint16],
    places: NDArray[np.uint32],
    first: int,
    end: int,
    scale: float,
    found: NDArray[np.uint8],
) -> None:
    """Write the shortest and longest range of the samples of some entries, counts."""
    farthest = np.float64(FARTHEST)
    for k in range(first, end):
        shortest, longest = np.uint16(65535), np.uint16(0)
        for j in range(places.shape[2]):
            count = band[places[0, k, j], places[1, k, j]]
            shortest, longest = min(shortest, count), max(longest, count)
        # A wall begins half a row before the middle of its cell.
        found[0, k] = np.uint8(min(farthest, max(0.0, (shortest - 1.0) * scale) + 0.5))
        found[1, k] = np.uint8(min(farthest, max(0.0, (longest - 1.0) * scale) + 0.5))
