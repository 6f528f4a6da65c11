"""One view of a robot at a known pose, cell by cell; and connected areas of cells.

Positions are continuous cell coordinates, as in `firstfix.fields.raycast`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel
from firstfix.fields.raycast import cast_ray_leaping

PASSED, NEAR, HIT = 1, 2, 3
"""Marks of a cell in one view: beams pass it, end in a neighbour, end in it; the highest counts."""

# Half a cell: no cell of which more than a corner is crossed is left out.
_STEP = 0.5

_MOST = 65535


@kernel
def mark_beams(
    clearance: NDArray[np.uint8],
    squares: NDArray[np.uint16],
    marks: NDArray[np.uint8],
    x: float,
    y: float,
    beams: NDArray[np.float64],
    longest: float,
) -> int:
    """Mark the cells that the beams of one sensor pass and hit.

    Parameters
    ----------
    clearance : ndarray of uint8, shape (height, width)
        Chessboard distance to the nearest wall, cells; 0 in walls.
    squares : ndarray of uint16, shape (height, width)
        Squared distance to the nearest wall, cells².
    marks : ndarray of uint8, shape (height, width)
        Written: `PASSED`, `NEAR` and `HIT`.
    x, y : float
        The sensor, cells.
    beams : ndarray, shape (n, 3)
        Heading (rad), range and tolerance (cells) of each beam that hit.
    longest : float
        Cells farther away are not marked, cells.

    Returns
    -------
    int
        Number of beams that end at a wall of the map, within their tolerance.
    """
    height, width = clearance.shape
    explained = 0
    for i in range(beams.shape[0]):
        heading, reach, tolerance = beams[i, 0], beams[i, 1], beams[i, 2]
        dx, dy = math.cos(heading), math.sin(heading)
        seen_free = min(longest, free_length(clearance, x, y, heading, reach, tolerance))
        for k in range(int(seen_free / _STEP)):
            column, row = math.floor(x + dx * _STEP * k), math.floor(y + dy * _STEP * k)
            if 0 <= column < width and 0 <= row < height and marks[row, column] == 0:
                marks[row, column] = PASSED
        column, row = math.floor(x + dx * reach), math.floor(y + dy * reach)
        if reach <= longest and 0 <= column < width and 0 <= row < height:
            if squares[row, column] <= tolerance * tolerance:
                explained += 1
                mark_walls(clearance, marks, row, column, int(tolerance))
            else:
                mark_end(marks, row, column)
    return explained


@kernel
def free_length(
    clearance: NDArray[np.uint8],
    x: float,
    y: float,
    heading: float,
    reach: float,
    tolerance: float,
) -> float:
    """Return how far a beam proves that cells are free, whatever the map says, cells.

    A wall is contradicted only if it would stop the beam on both sides of it, too: a beam that
    passes an edge, or along a wall, is explained by a small error of the pose.
    """
    until = reach - tolerance
    wall = cast_ray_leaping(clearance, x, y, math.cos(heading), math.sin(heading), reach)
    if wall >= until:
        return until
    off = math.atan2(tolerance, wall)
    for side in (heading - off, heading + off):
        if cast_ray_leaping(clearance, x, y, math.cos(side), math.sin(side), until) >= until:
            return wall - tolerance
    return until


@kernel
def mark_walls(
    clearance: NDArray[np.uint8], marks: NDArray[np.uint8], row: int, column: int, side: int
) -> None:
    """Mark the walls of the map in a square around the end of a beam as hit."""
    height, width = clearance.shape
    for r in range(max(0, row - side), min(height, row + side + 1)):
        for c in range(max(0, column - side), min(width, column + side + 1)):
            if clearance[r, c] == 0:
                marks[r, c] = HIT


@kernel
def mark_end(marks: NDArray[np.uint8], row: int, column: int) -> None:
    """Mark the end of a beam as hit, and its neighbours as near."""
    height, width = marks.shape
    for r in range(max(0, row - 1), min(height, row + 2)):
        for c in range(max(0, column - 1), min(width, column + 2)):
            if marks[r, c] < NEAR:
                marks[r, c] = NEAR
    marks[row, column] = HIT


@kernel
def add_view(
    marks: NDArray[np.uint8],
    hits: NDArray[np.uint16],
    near: NDArray[np.uint16],
    passes: NDArray[np.uint16],
    box: tuple[int, int, int, int],
) -> None:
    """Count the marks of one view in a box (first and end row, first and end column); clear them.

    ``near`` counts hits, too.
    """
    for r in range(box[0], box[1]):
        for c in range(box[2], box[3]):
            mark = marks[r, c]
            if mark == HIT and hits[r, c] < _MOST:
                hits[r, c] += np.uint16(1)
            if mark >= NEAR and near[r, c] < _MOST:
                near[r, c] += np.uint16(1)
            if mark == PASSED and passes[r, c] < _MOST:
                passes[r, c] += np.uint16(1)
            marks[r, c] = 0


@kernel
def label_areas(
    kinds: NDArray[np.uint8], gap: int, labels: NDArray[np.int32], stack: NDArray[np.int64]
) -> int:
    """Label the connected areas of cells of one kind.

    Parameters
    ----------
    kinds : ndarray of uint8, shape (height, width)
        0 for cells that belong to none.
    gap : int
        Cells of one kind are connected if rows and columns differ by at most this.
    labels : ndarray of int32, shape (height, width)
        Zeros; written: the number of the area, from 1.
    stack : ndarray of int64, shape (n,)
        Working memory for as many cells as are not 0.

    Returns
    -------
    int
        Number of areas.
    """
    height, width = kinds.shape
    areas = 0
    for start in range(height * width):
        kind = kinds[start // width, start % width]
        if kind == 0 or labels[start // width, start % width] != 0:
            continue
        areas += 1
        labels[start // width, start % width] = areas
        stack[0] = start
        n = 1
        while n > 0:
            n -= 1
            row, column = stack[n] // width, stack[n] % width
            for r in range(max(0, row - gap), min(height, row + gap + 1)):
                for c in range(max(0, column - gap), min(width, column + gap + 1)):
                    if kinds[r, c] == kind and labels[r, c] == 0:
                        labels[r, c] = areas
                        stack[n] = r * width + c
                        n += 1
    return areas
