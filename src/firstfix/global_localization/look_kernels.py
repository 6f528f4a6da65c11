"""The loops of the first look (`global_localization.look`) over blocks, positions and rays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel, part
from firstfix.fields.look_table import BLOCKS, LOOK_DIRECTIONS
from firstfix.fields.range_table import DIRECTIONS
from firstfix.fields.raycast import cast_ray_leaping
from firstfix.global_localization.search import SECTORS

LEVELS = 1024
"""Scores of the bounds are below this."""

NOWHERE = 1 << 40
"""Cost of a block in which no sensor can be."""

# Beams, of at most 10 each, after which it is seen whether an entry can still be good.
_TOGETHER = 16

_HEADINGS = DIRECTIONS // SECTORS  # of a sector
_LOOK_HEADINGS = LOOK_DIRECTIONS // SECTORS


@part
def _outside(
    count: np.uint8, nearest: np.uint8, farthest: np.uint8, through: np.uint8, short: np.uint8
) -> np.uint8:
    """Return how far a range lies outside two others, with limits to both sides."""
    return np.uint8(
        min(np.uint8(max(count, farthest) - farthest), through)
        + min(np.uint8(max(count, nearest) - count), short)
    )


@kernel
def compare_bounds(  # noqa: PLR0913 - a kernel takes its arrays one by one
    bounds: NDArray[np.uint8],
    directions: NDArray[np.int64],
    counts: NDArray[np.uint8],
    through: NDArray[np.uint8],
    short: NDArray[np.uint8],
    penalties: NDArray[np.uint16],
    limit: int,
    scores: NDArray[np.uint16],
    histogram: NDArray[np.int64],
) -> None:
    """Compare all headings of every entry: sums of bytes, as `search._add_ranges`.

    An entry that is above the limit at every heading after some of the beams is dropped.
    """
    # Written twice, so that every heading is one slice.
    low, high = np.empty(2 * LOOK_DIRECTIONS, np.uint8), np.empty(2 * LOOK_DIRECTIONS, np.uint8)
    narrow, wide = np.empty(LOOK_DIRECTIONS, np.uint8), np.empty(LOOK_DIRECTIONS, np.uint16)
    lowest = np.empty(LOOK_DIRECTIONS // 2, np.uint8)
    headings = np.uint64(LOOK_DIRECTIONS)  # unsigned, so that LLVM can vectorise the loops
    n = directions.shape[0]
    for k in range(bounds.shape[0]):
        nearest, farthest = bounds[k, 0], bounds[k, 1]
        for h in range(headings):
            low[h] = nearest[h]
            low[h + headings] = nearest[h]
            high[h] = farthest[h]
            high[h + headings] = farthest[h]
            wide[h] = 0
        j = 0
        while j < n:
            for h in range(headings):
                narrow[h] = 0
            end = min(n, j + _TOGETHER)
            while j < end:
                a, b = np.uint64(directions[j]), np.uint64(directions[j + 1])
                c, d = np.uint64(directions[j + 2]), np.uint64(directions[j + 3])
                za, zb, zc, zd = counts[j], counts[j + 1], counts[j + 2], counts[j + 3]
                ta, tb, tc, td = through[j], through[j + 1], through[j + 2], through[j + 3]
                sa, sb, sc, sd = short[j], short[j + 1], short[j + 2], short[j + 3]
                for h in range(headings):
                    p = _outside(za, low[a + h], high[a + h], ta, sa)
                    q = _outside(zb, low[b + h], high[b + h], tb, sb)
                    r = _outside(zc, low[c + h], high[c + h], tc, sc)
                    s = _outside(zd, low[d + h], high[d + h], td, sd)
                    narrow[h] += np.uint8(np.uint8(p + q) + np.uint8(r + s))
                j += 4
            for h in range(headings):
                wide[h] += np.uint16(narrow[h])
            if j <= _TOGETHER and _least(narrow, lowest) + np.int64(penalties[k]) > limit:
                for sector in range(SECTORS):
                    scores[k, sector] = LEVELS - 1
                histogram[LEVELS - 1] += SECTORS
                break
        else:
            _write_best(wide, penalties[k], scores[k], histogram)


@part
def _least(values: NDArray[np.uint8], scratch: NDArray[np.uint8]) -> np.int64:
    """Return the smallest value, by halves: LLVM does not vectorise a minimum over all."""
    half, quarter = np.uint64(LOOK_DIRECTIONS // 2), np.uint64(LOOK_DIRECTIONS // 4)
    for h in range(half):
        scratch[h] = min(values[h], values[h + half])
    for h in range(quarter):
        scratch[h] = min(scratch[h], scratch[h + quarter])
    least = scratch[0]
    for h in range(1, LOOK_DIRECTIONS // 4):
        least = min(least, scratch[h])
    return np.int64(least)


@part
def _write_best(
    sums: NDArray[np.uint16],
    penalty: np.uint16,
    scores: NDArray[np.uint16],
    histogram: NDArray[np.int64],
) -> None:
    """Write the score of the best heading in each sector, and count it."""
    for sector in range(SECTORS):
        best = np.uint16(65535)
        for h in range(_LOOK_HEADINGS):
            best = min(best, sums[sector * _LOOK_HEADINGS + h])
        best = min(np.uint16(LEVELS - 1), np.uint16(best + penalty))
        scores[sector] = best
        histogram[best] += 1


@kernel
def compare_end_points(
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    sectors: NDArray[np.int64],
    field: tuple[NDArray[np.uint8], int, int, NDArray[np.int64]],
    space: tuple[NDArray[np.uint8], int],
    costs: NDArray[np.int64],
    poses: NDArray[np.int64],
) -> None:
    """Find the lowest sum of distances in each block and sector; poses are column, row, heading."""
    values, pitch, margin, offsets = field
    clearance, stride = space
    n = offsets.shape[1]
    for k in range(rows.shape[0]):
        costs[k] = NOWHERE
        for place in range(BLOCKS * BLOCKS):
            row, column = rows[k] + place // BLOCKS, columns[k] + place % BLOCKS
            y, x = row * stride + stride // 2, column * stride + stride // 2
            if y >= clearance.shape[0] or x >= clearance.shape[1] or clearance[y, x] == 0:
                continue
            base = (row + margin) * pitch + column + margin
            for i in range(_HEADINGS + 1):
                # A heading of the look covers those of the search to both its sides.
                h = (sectors[k] * _HEADINGS + i - 1) % DIRECTIONS
                total = 0
                for j in range(n):
                    total += values[base + offsets[h, j]]
                if total < costs[k]:
                    costs[k] = total
                    poses[k, 0], poses[k, 1], poses[k, 2] = column, row, h


@kernel
def mean_gaps(
    clearance: NDArray[np.uint8],
    poses: NDArray[np.float64],
    bearings: NDArray[np.float64],
    ranges: NDArray[np.float64],
    through: NDArray[np.float64],
    short: NDArray[np.float64],
    gaps: NDArray[np.float64],
) -> None:
    """Mean difference to the range that the map predicts, with limits to both sides, cells."""
    for k in range(poses.shape[0]):
        total = 0.0
        for i in range(ranges.shape[0]):
            angle = poses[k, 2] + bearings[i]
            dx, dy = np.cos(angle), np.sin(angle)
            reach = ranges[i] + short[i]
            seen = cast_ray_leaping(clearance, poses[k, 0], poses[k, 1], dx, dy, reach)
            gap = ranges[i] - seen
            total += min(gap, through[i]) if gap > 0.0 else min(-gap, short[i])
        gaps[k] = total / ranges.shape[0]
