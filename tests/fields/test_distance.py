from collections import deque

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray
from scipy import ndimage

from firstfix.fields.clearance import MAX_CLEARANCE, chessboard_clearance
from firstfix.fields.distance import (
    MAX_LIMIT,
    SATURATED,
    euclidean_distance,
    manhattan_distance,
    truncated_squares,
)

maps = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=40))
maps_with_walls = maps.filter(lambda occupied: bool(occupied.any()))


def truncated_distance(occupied, limit):
    return np.sqrt(truncated_squares(occupied, limit).astype(np.float64)).astype(np.float32)


def queue_of_the_paper(occupied: NDArray[np.bool_]) -> NDArray[np.uint16]:
    """Fig. 10, line by line."""
    pointscore = np.full(occupied.shape, SATURATED, np.uint16)
    queue = deque[tuple[int, int]]()
    for r, c in zip(*np.nonzero(occupied), strict=True):
        pointscore[r, c] = 0
        queue.append((int(r), int(c)))
    while queue:
        r, c = queue.popleft()
        for y, x in ((r - 1, c), (r + 1, c), (r, c - 1), (r, c + 1)):
            inside = 0 <= y < occupied.shape[0] and 0 <= x < occupied.shape[1]
            if inside and pointscore[y, x] == SATURATED:
                pointscore[y, x] = pointscore[r, c] + 1
                queue.append((y, x))
    return pointscore


def draw(*rows: str) -> NDArray[np.bool_]:
    return np.array([[cell == "#" for cell in row] for row in rows])


def sparse_map(seed: int, shape: tuple[int, int], walls: int) -> NDArray[np.bool_]:
    occupied = np.zeros(shape, np.bool_)
    occupied.flat[np.random.default_rng(seed).integers(0, occupied.size, walls)] = True
    return occupied


def test_distances_of_a_drawn_map():
    occupied = draw("#...", "....", "....")
    assert manhattan_distance(occupied).tolist() == [[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]]
    assert chessboard_clearance(occupied).tolist() == [[0, 1, 2, 3], [1, 1, 2, 3], [2, 2, 2, 3]]
    assert truncated_squares(occupied, 3).tolist() == [[0, 1, 4, 9], [1, 2, 5, 9], [4, 5, 8, 9]]
    np.testing.assert_array_equal(
        euclidean_distance(occupied),
        np.sqrt([[0, 1, 4, 9], [1, 2, 5, 10], [4, 5, 8, 13]]).astype(np.float32),
    )


@settings(deadline=None)  # the first call compiles
@given(maps)
def test_manhattan_is_the_queue_of_the_paper(occupied):
    np.testing.assert_array_equal(manhattan_distance(occupied), queue_of_the_paper(occupied))


@settings(deadline=None)  # the first call compiles
@given(maps_with_walls)
def test_every_metric_is_that_of_scipy(occupied):
    np.testing.assert_array_equal(
        manhattan_distance(occupied),
        ndimage.distance_transform_cdt(~occupied, metric="taxicab"),
    )
    np.testing.assert_array_equal(
        chessboard_clearance(occupied),
        ndimage.distance_transform_cdt(~occupied, metric="chessboard"),
    )
    np.testing.assert_array_equal(
        euclidean_distance(occupied),
        ndimage.distance_transform_edt(~occupied).astype(np.float32),
    )


@pytest.mark.parametrize("shape", [(300, 700), (1, 900), (900, 1), (129, 128), (2, 2)])
@pytest.mark.parametrize("walls", [1, 5, 200])
def test_every_metric_is_that_of_scipy_on_wide_maps(shape, walls):
    occupied = sparse_map(walls, shape, walls)
    euclidean = ndimage.distance_transform_edt(~occupied).astype(np.float32)
    chessboard = ndimage.distance_transform_cdt(~occupied, metric="chessboard")
    taxicab = ndimage.distance_transform_cdt(~occupied, metric="taxicab")
    np.testing.assert_array_equal(euclidean_distance(occupied), euclidean)
    np.testing.assert_array_equal(manhattan_distance(occupied), taxicab)
    np.testing.assert_array_equal(
        chessboard_clearance(occupied), np.minimum(chessboard, MAX_CLEARANCE)
    )
    for limit in (1, 2, 17, 63, MAX_LIMIT):
        np.testing.assert_array_equal(
            truncated_distance(occupied, limit), np.minimum(euclidean, np.float32(limit))
        )


@settings(deadline=None)  # the first call compiles
@given(maps, st.integers(1, MAX_LIMIT))
def test_truncation_commutes_with_measuring(occupied, limit):
    full = np.minimum(euclidean_distance(occupied), np.float32(limit))
    np.testing.assert_array_equal(truncated_distance(occupied, limit), full)
    squares = truncated_squares(occupied, limit)
    np.testing.assert_array_equal(squares, np.rint(full.astype(np.float64) ** 2))


def test_a_map_without_walls_is_infinitely_far_from_them():
    empty = np.zeros((3, 400), np.bool_)
    assert (manhattan_distance(empty) == SATURATED).all()
    assert np.isposinf(euclidean_distance(empty)).all()
    assert (truncated_distance(empty, 7) == 7).all()
    assert (chessboard_clearance(empty) == MAX_CLEARANCE).all()


def test_distances_beyond_the_type_saturate():
    corridor = np.zeros((2, 70_000), np.bool_)
    corridor[0, 0] = True
    manhattan = manhattan_distance(corridor)
    columns = np.arange(70_000)
    np.testing.assert_array_equal(manhattan[0], np.minimum(columns, SATURATED))
    np.testing.assert_array_equal(manhattan[1], np.minimum(columns + 1, SATURATED))
    np.testing.assert_array_equal(manhattan_distance(np.ascontiguousarray(corridor.T)), manhattan.T)
    np.testing.assert_array_equal(
        chessboard_clearance(corridor)[0], np.minimum(columns, MAX_CLEARANCE)
    )


@settings(deadline=None)  # the first call compiles
@given(maps_with_walls)
def test_the_square_of_the_clearance_is_free_and_could_not_be_larger(occupied):
    clearance = chessboard_clearance(occupied)
    for r, c in np.ndindex(occupied.shape):
        n = int(clearance[r, c])
        assert not occupied[max(0, r - n + 1) : r + n, max(0, c - n + 1) : c + n].any()
        assert occupied[max(0, r - n) : r + n + 1, max(0, c - n) : c + n + 1].any()


@settings(deadline=None)  # the first call compiles
@given(maps_with_walls)
def test_turning_the_map_turns_the_field(occupied):
    for measure in (manhattan_distance, euclidean_distance, chessboard_clearance):
        turned = measure(np.rot90(occupied))  # not contiguous: measured all the same
        np.testing.assert_array_equal(turned, np.rot90(measure(occupied)))


def test_a_read_only_map_is_measured():
    occupied = draw("..#")
    occupied.flags.writeable = False
    assert manhattan_distance(occupied).tolist() == [[2, 1, 0]]
    assert euclidean_distance(occupied).tolist() == [[2, 1, 0]]
    assert truncated_distance(occupied, 1).tolist() == [[1, 1, 0]]


@pytest.mark.parametrize("limit", [0, -1, MAX_LIMIT + 1])
def test_a_limit_out_of_range_is_refused(limit):
    with pytest.raises(ValueError, match=f"1 to {MAX_LIMIT} cells, not {limit}"):
        truncated_squares(draw("#"), limit)
