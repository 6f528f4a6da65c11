"""The fast marks are those of the obvious walk, beam by beam; areas are those of a flood fill."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label

from firstfix.changes.kernels import HIT, NEAR, PASSED, add_view, label_areas, mark_beams
from firstfix.core.grid import OccupancyGrid
from firstfix.fields.map_fields import MapFields


def walk(occupied: NDArray[np.bool_], x: float, y: float, heading: float, most: float) -> float:
    """Return where a beam meets a wall, by small steps; ``most`` where it meets none."""
    lengths = np.arange(0.0, most, 1e-3)
    columns = np.floor(x + lengths * math.cos(heading)).astype(int)
    rows = np.floor(y + lengths * math.sin(heading)).astype(int)
    inside = (
        (rows >= 0) & (rows < occupied.shape[0]) & (columns >= 0) & (columns < occupied.shape[1])
    )
    blocked = np.zeros(len(lengths), bool)
    blocked[inside] = occupied[rows[inside], columns[inside]]
    return float(lengths[blocked.argmax()]) if blocked.any() else most


def marks_slowly(
    occupied: NDArray[np.bool_], x: float, y: float, beams: NDArray[np.float64], longest: float
) -> NDArray[np.uint8]:
    to_wall = distance_transform_edt(~occupied)
    marks = np.zeros(occupied.shape, np.uint8)
    cells = [(r, c) for r in range(occupied.shape[0]) for c in range(occupied.shape[1])]
    for heading, reach, tolerance in beams.tolist():
        until = reach - tolerance
        wall = walk(occupied, x, y, heading, reach)
        if wall < until:
            off = math.atan2(tolerance, wall)
            sides = [walk(occupied, x, y, heading + s * off, until) for s in (-1, 1)]
            until = until if max(sides) < until - 2e-3 else wall - tolerance
        ends = (y + reach * math.sin(heading), x + reach * math.cos(heading))
        end = tuple(math.floor(value) for value in ends)
        for k in range(int(min(until, longest) * 2)):
            r, c = (
                math.floor(y + k / 2 * math.sin(heading)),
                math.floor(x + k / 2 * math.cos(heading)),
            )
            if (r, c) in cells:
                marks[r, c] = max(marks[r, c], PASSED)
        if reach > longest or end not in cells:
            continue
        near_wall = to_wall[end] <= tolerance
        for r, c in cells:
            apart = max(abs(r - end[0]), abs(c - end[1]))
            if near_wall and occupied[r, c] and apart <= int(tolerance):
                marks[r, c] = HIT
            if not near_wall and apart <= 1:
                marks[r, c] = max(marks[r, c], HIT if apart == 0 else NEAR)
    return marks


@pytest.mark.parametrize("seed", range(4))
def test_marks_are_those_of_the_obvious_walk(seed: int) -> None:
    rng = np.random.default_rng(seed)
    occupied = rng.random((24, 30)) < 0.04
    occupied[9:14, 12:20] = False
    fields = MapFields(OccupancyGrid(np.where(occupied, 100, 0).astype(np.int8), 0.05))
    x, y = 15.3, 11.6
    beams = np.column_stack(
        [rng.uniform(-math.pi, math.pi, 40), rng.uniform(2.0, 18.0, 40), rng.uniform(1.5, 4.0, 40)]
    )
    marks = np.zeros(occupied.shape, np.uint8)
    explained = mark_beams(fields.clearance, fields.squares, marks, x, y, beams, 14.0)
    np.testing.assert_array_equal(marks, marks_slowly(occupied, x, y, beams, 14.0))
    assert 0 < explained < len(beams)


def test_a_view_counts_once_and_is_cleared() -> None:
    marks = np.array([[0, PASSED], [NEAR, HIT], [HIT, HIT]], np.uint8)
    hits, near, passes = (np.zeros((3, 2), np.uint16) for _ in range(3))
    hits[1, 1] = near[1, 1] = 65535
    add_view(marks, hits, near, passes, (0, 2, 0, 2))
    assert hits.tolist() == [[0, 0], [0, 65535], [0, 0]]
    assert near.tolist() == [[0, 0], [1, 65535], [0, 0]]
    assert passes.tolist() == [[0, 1], [0, 0], [0, 0]]
    assert marks.tolist() == [[0, 0], [0, 0], [HIT, HIT]]


@pytest.mark.parametrize("seed", range(3))
def test_areas_are_those_of_scipy(seed: int) -> None:
    kinds = np.random.default_rng(seed).integers(0, 3, (40, 50)).astype(np.uint8)
    kinds[np.random.default_rng(seed + 9).random(kinds.shape) < 0.6] = 0
    labels = np.zeros(kinds.shape, np.int32)
    count = label_areas(kinds, 1, labels, np.empty(kinds.size, np.int64))
    expected = sum(label(kinds == kind, np.ones((3, 3)))[1] for kind in (1, 2))
    assert count == expected == labels.max()
    assert ((labels > 0) == (kinds > 0)).all()
    for area in range(1, count + 1):
        assert len(np.unique(kinds[labels == area])) == 1


def test_cells_within_the_gap_are_one_area() -> None:
    kinds = np.array([[1, 0, 1, 0, 0, 1]], np.uint8)
    labels = np.zeros(kinds.shape, np.int32)
    assert label_areas(kinds, 2, labels, np.empty(kinds.size, np.int64)) == 2
    assert labels.tolist() == [[1, 0, 1, 0, 0, 2]]
