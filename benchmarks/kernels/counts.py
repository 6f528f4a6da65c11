"""How much work data-dependent kernels had: their loops again, counting."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from compiled import compiled
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.fields.raycast import _is_inside_cell, _towards
from firstfix.lab.simulation.wavefront import _improve


@compiled
def steps(
    occupied: NDArray[np.bool_], x: float, y: float, headings: NDArray[np.float64], reach: float
) -> int:
    """Count the cells that `cast_rays` looks at."""
    height, width = occupied.shape
    total = 0
    for heading in headings:
        dx, dy = math.cos(heading), math.sin(heading)
        step_x, line_x, per_x = _towards(dx)
        step_y, line_y, per_y = _towards(dy)
        column, row = math.floor(x), math.floor(y)
        length = 0.0
        while length < reach and 0 <= column < width and 0 <= row < height:
            total += 1
            if occupied[row, column]:
                break
            length_x = (column + line_x - x) * per_x
            length_y = (row + line_y - y) * per_y
            if length_x < length_y:
                length, column = length_x, column + step_x
            else:
                length, row = length_y, row + step_y
    return total


@compiled
def leaps(
    clearance: NDArray[np.uint8],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    dx: NDArray[np.float64],
    dy: NDArray[np.float64],
    reach: NDArray[np.float64],
) -> int:
    """Count the cells that leaping rays look at, each from its own start."""
    height, width = clearance.shape
    total = 0
    for i in range(dx.size):
        step_x, line_x, per_x = _towards(dx[i])
        step_y, line_y, per_y = _towards(dy[i])
        column, row = math.floor(x[i]), math.floor(y[i])
        length = 0.0
        while length < reach[i] and 0 <= column < width and 0 <= row < height:
            total += 1
            n = int(clearance[row, column])
            if n == 0:
                break
            length_x = (column + step_x * (n - 1) + line_x - x[i]) * per_x
            length_y = (row + step_y * (n - 1) + line_y - y[i]) * per_y
            if length_x < length_y:
                along = y[i] + dy[i] * length_x
                if n > 1 and _is_inside_cell(along):
                    length, column, row = length_x, column + step_x * n, math.floor(along)
                    continue
            else:
                along = x[i] + dx[i] * length_y
                if n > 1 and _is_inside_cell(along):
                    length, column, row = length_y, math.floor(along), row + step_y * n
                    continue
            length_x = (column + line_x - x[i]) * per_x
            length_y = (row + line_y - y[i]) * per_y
            if length_x < length_y:
                length, column = length_x, column + step_x
            else:
                length, row = length_y, row + step_y
    return total


def at_poses(
    clearance: NDArray[np.uint8],
    poses: NDArray[np.float64],
    bearings: NDArray[np.float64],
    reach: NDArray[np.float64],
) -> float:
    """Count the leaps of all beams at all poses (cells, rad); ``reach`` is that of each beam."""
    n, angles = len(bearings), poses[:, 2:] + bearings
    x, y = np.repeat(poses[:, 0], n), np.repeat(poses[:, 1], n)
    dx, dy = np.cos(angles).ravel(), np.sin(angles).ravel()
    return float(leaps(clearance, x, y, dx, dy, np.tile(reach, len(poses))))


@compiled
def rounds_outward(near: NDArray[np.uint16], limit: int, chunk: int) -> float:
    """Count the columns that `_look_outward` compares to each side, over all cells of one row."""
    width = near.size
    squares = near.astype(np.int64) ** 2
    total = 0
    for begin in range(0, width, chunk):
        end = min(width, begin + chunk)
        best = squares[begin:end].copy()
        lowest = limit * limit
        for c in range(max(0, begin - limit), min(width, end + limit)):
            lowest = min(lowest, squares[c])
        for k in range(1, limit):
            if k % 4 == 1 and best.max() <= k * k + lowest:
                break
            total += end - begin
            for c in range(begin, end):
                for other in (c - k, c + k):
                    if 0 <= other < width:
                        best[c - begin] = min(best[c - begin], squares[other] + k * k)
    return total


@compiled
def pairs(
    poses: NDArray[np.float64],
    order: NDArray[np.int64],
    near_cells: float,
    near_rad: float,
    most: int,
) -> tuple[int, int]:
    """Count the poses that `_suppress` looks at, and the pairs that it compares."""
    kept = np.empty(most, np.int64)
    n, poses_seen, total = 0, 0, 0
    for i in order:
        if n == most:
            break
        poses_seen += 1
        taken = False
        for j in kept[:n]:
            total += 1
            turn = abs(poses[i, 2] - poses[j, 2]) % FULL_TURN
            dx, dy = poses[i, 0] - poses[j, 0], poses[i, 1] - poses[j, 1]
            if min(turn, FULL_TURN - turn) <= near_rad and dx * dx + dy * dy <= near_cells**2:
                taken = True
                break
        if not taken:
            kept[n] = i
            n += 1
    return poses_seen, total


def passes(weights: NDArray[np.float32], start: tuple[int, int]) -> int:
    """Count how often `_sweep_until_still` goes over the map, to and fro being two."""
    costs = np.full(weights.shape, np.inf, np.float32)
    costs[start] = 0.0
    return _passes(_improve, weights, costs)


@compiled
def _passes(
    improve: Callable[..., bool], weights: NDArray[np.float32], costs: NDArray[np.float32]
) -> int:
    height, width = weights.shape
    count, changed = 0, True
    while changed:
        changed = False
        for r in range(1, height - 1):
            for c in range(1, width - 1):
                if improve(weights, costs, r, c, -1):
                    changed = True
        for r in range(height - 2, 0, -1):
            for c in range(width - 2, 0, -1):
                if improve(weights, costs, r, c, 1):
                    changed = True
        count += 2
    return count
