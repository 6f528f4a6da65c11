"""The loops of the first look (`global_localization.look`) over blocks, positions and rays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel
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

    An entry that is above the limit at every heading is dropped.
    """
    # Written twice, so that every heading is one slice.
    low, high = np.empty(2 * LOOK_DIRECTIONS, np.uint8), np.empty(2 * LOOK_DIRECTIONS, np.uint8)
    narrow, wide = np.empty(LOOK_DIRECTIONS, np.uint8), np.empty(LOOK_DIRECTIONS, np.uint16)
    n = directions.shape[0]
    for k in range(bounds.shape[0]):
        least = penalties[k]
        nearest, farthest = bounds[k, 0], bounds[k, 1]
        for h in range(LOOK_DIRECTIONS):
            low[h] = nearest[h]
            low[h + LOOK_DIRECTIONS] = nearest[h]
            high[h] = farthest[h]
            high[h + LOOK_DIRECTIONS] = farthest[h]
            wide[h] = 0
        j = 0
        while j < n and least <= limit:
            for h in range(LOOK_DIRECTIONS):
                narrow[h] = 0
            end = min(n, j + _TOGETHER)
            while j < end:
                a, b = low[directions[j] :], low[directions[j + 1] :]
                c, d = low[directions[j + 2] :], low[directions[j + 3] :]
                e, f = high[directions[j] :], high[directions[j + 1] :]
                g, i = high[directions[j + 2] :], high[directions[j + 3] :]
                za, zb, zc, zd = counts[j], counts[j + 1], counts[j + 2], counts[j + 3]
                ta, tb, tc, td = through[j], through[j + 1], through[j + 2], through[j + 3]
                sa, sb, sc, sd = short[j], short[j + 1], short[j + 2], short[j + 3]
                for h in range(LOOK_DIRECTIONS):
                    p = np.uint8(
                        min(np.uint8(max(za, e[h]) - e[h]), ta)
                        + min(np.uint8(max(za, a[h]) - za), sa)
                    )
                    q = np.uint8(
                        min(np.uint8(max(zb, f[h]) - f[h]), tb)
                        + min(np.uint8(max(zb, b[h]) - zb), sb)
                    )
                    r = np.uint8(
                        min(np.uint8(max(zc, g[h]) - g[h]), tc)
                        + min(np.uint8(max(zc, c[h]) - zc), sc)
                    )
                    s = np.uint8(
                        min(np.uint8(max(zd, i[h]) - i[h]), td)
                        + min(np.uint8(max(zd, d[h]) - zd), sd)
                    )
                    narrow[h] += np.uint8(np.uint8(p + q) + np.uint8(r + s))
                j += 4
            for h in range(LOOK_DIRECTIONS):
                wide[h] += np.uint16(narrow[h])
            lowest = np.uint16(65535)
            for h in range(LOOK_DIRECTIONS):
                lowest = min(lowest, wide[h])
            least = np.uint16(lowest + penalties[k])
        if least > limit:
            scores[k] = LEVELS - 1
            histogram[LEVELS - 1] += SECTORS
            continue
        for sector in range(SECTORS):
            best = np.uint16(65535)
            for h in range(_LOOK_HEADINGS):
                best = min(best, wide[sector * _LOOK_HEADINGS + h])
            best = np.uint16(min(LEVELS - 1, best + penalties[k]))
            scores[k, sector] = best
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
