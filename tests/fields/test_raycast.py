import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes
from numpy.typing import NDArray

from firstfix.core.grid import FREE, OCCUPIED, OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.clearance import chessboard_clearance
from firstfix.fields.raycast import cast_ray, cast_ray_leaping, expected_ranges

maps = array_shapes(min_dims=2, max_dims=2, max_side=30).flatmap(
    lambda shape: st.lists(st.integers(0, math.prod(shape) - 1), max_size=12).map(
        lambda walls: with_walls(shape, walls)
    )
)
coordinates = (
    st.floats(-1, 31) | st.integers(-1, 31).map(float) | st.integers(0, 60).map(lambda n: n / 2)
)
headings = st.floats(-7, 7) | st.integers(-16, 16).map(lambda k: k * math.pi / 8)


def with_walls(shape: tuple[int, ...], walls: list[int]) -> NDArray[np.bool_]:
    occupied = np.zeros(shape, np.bool_)
    occupied.flat[walls] = True
    return occupied


def leap(occupied: NDArray[np.bool_], x: float, y: float, heading: float, reach: float) -> float:
    clearance = chessboard_clearance(occupied)
    return cast_ray_leaping(clearance, x, y, math.cos(heading), math.sin(heading), reach)


def nearest_box(occupied: NDArray[np.bool_], x: float, y: float, heading: float) -> float:
    """Where the ray enters the first of all occupied cells, each by itself (slab method)."""
    rows, columns = np.nonzero(occupied)
    d = np.array([math.cos(heading), math.sin(heading)])[:, None]
    low = (np.array([columns, rows]) - np.array([[x], [y]])) / d
    high = (np.array([columns, rows]) + 1 - np.array([[x], [y]])) / d
    enter = np.minimum(low, high).max(axis=0)
    leave = np.maximum(low, high).min(axis=0)
    met = (enter < leave) & (leave > 0)
    return float(np.maximum(enter[met], 0).min(initial=math.inf))


@pytest.fixture
def room() -> NDArray[np.bool_]:
    occupied = np.zeros((10, 20), np.bool_)
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    return occupied


@pytest.mark.parametrize("cast", [cast_ray, leap])
@pytest.mark.parametrize(
    ("heading", "expected"),
    [
        (0.0, 19 - 5.25),
        (math.pi / 2, 9 - 3.5),
        (math.pi, 5.25 - 1),
        (-math.pi / 2, 3.5 - 1),
        (math.atan2(3, 4), (9 - 3.5) * 5 / 3),
        (math.atan2(-3, -4), (3.5 - 1) * 5 / 3),
    ],
)
def test_a_ray_ends_where_it_enters_the_wall(cast, room, heading, expected):
    assert cast(room, 5.25, 3.5, heading, 100.0) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("cast", [cast_ray, leap])
def test_the_ends_of_a_ray(cast, room):
    assert cast(room, 0.5, 0.5, 0.0, 100.0) == 0.0  # in a wall
    assert cast(room, 5.0, 5.0, 0.0, 13.9) == 13.9  # nothing so near
    assert cast(room, 5.0, 5.0, 0.0, 14.1) == 14.0
    assert cast(room, 5.0, 5.0, 0.0, 14.0) == 14.0
    assert cast(room, 5.0, 5.0, 0.0, 0.0) == 0.0
    assert cast(room, -1.0, 5.0, 0.0, 100.0) == 100.0  # starts outside
    assert cast(room, 5.0, 99.0, -1.5, math.inf) == math.inf
    room[5, :] = False
    assert cast(room, 5.5, 5.5, 0.0, 100.0) == 100.0  # leaves the map
    assert cast(room, 5.5, 5.5, math.pi, math.inf) == math.inf
    for nowhere in (math.nan, math.inf, -math.inf):
        assert cast(room, nowhere, 5.5, 0.0, 100.0) == 100.0
        assert cast(room, 5.5, nowhere, 1.0, 100.0) == 100.0


@pytest.mark.parametrize("share", [0.0, 0.01, 0.1, 0.5])
def test_walking_finds_the_nearest_of_all_occupied_cells(share):
    # Drawn at random, no ray passes exactly through a corner, where the answer is a convention.
    rng = np.random.default_rng(7)
    for _ in range(1000):
        occupied = rng.random(rng.integers(1, 40, 2)) < share
        x, y = rng.random(2) * occupied.shape[::-1]
        heading = rng.uniform(-7, 7)
        nearest = nearest_box(occupied, x, y, heading)
        assert cast_ray(occupied, x, y, heading, math.inf) == pytest.approx(nearest, abs=1e-9)


@settings(max_examples=2 * settings.default.max_examples, deadline=None)
@given(maps, coordinates, coordinates, headings, st.floats(0, 50) | st.just(math.inf))
def test_leaping_is_walking_to_the_last_bit(occupied, x, y, heading, reach):
    assert leap(occupied, x, y, heading, reach) == cast_ray(occupied, x, y, heading, reach)


def test_leaping_is_walking_across_large_rooms():
    rng = np.random.default_rng(3)
    occupied = rng.random((600, 800)) < 0.0005
    occupied[100:110, 200:700] = occupied[:, 400] = True
    clearance = chessboard_clearance(occupied)
    for k in range(20_000):
        x, y = rng.random(2) * (800, 600)
        x, y = (round(x), round(y)) if k % 4 == 0 else (x, y)
        heading = rng.integers(-8, 8) * math.pi / 4 if k % 3 == 0 else rng.random() * 7
        expected = cast_ray(occupied, x, y, heading, math.inf)
        dx, dy = math.cos(heading), math.sin(heading)
        assert cast_ray_leaping(clearance, x, y, dx, dy, math.inf) == expected


@settings(deadline=None)
@given(maps, st.floats(-5, 5), st.floats(-5, 5), st.floats(-4, 4))
def test_moving_map_and_sensor_together_changes_nothing(occupied, dx, dy, turn):
    cells = np.where(occupied, OCCUPIED, FREE).astype(np.int8)
    T_map_laser = SE2(0.51, 0.47, 0.3)
    bearings = np.linspace(-3, 3, 13)
    move = SE2(dx, dy, turn)
    here = expected_ranges(OccupancyGrid(cells, 0.05), T_map_laser, bearings, 2.0)
    there = expected_ranges(OccupancyGrid(cells, 0.05, move), move @ T_map_laser, bearings, 2.0)
    same = np.isclose(here, there, atol=1e-9) | (np.isinf(here) & np.isinf(there))
    assert (
        np.count_nonzero(~same) <= 1
    )  # a ray past the very corner of a cell may turn out either way


def test_ranges_are_metres_and_nothing_is_inf(room):
    cells = np.where(room, OCCUPIED, FREE).astype(np.int8)
    cells[5, -1] = -1  # unknown: transparent
    grid = OccupancyGrid(cells, 0.1, SE2(10.0, 20.0, 0.0))
    T_map_laser = SE2(10.55, 20.55, math.pi / 2)
    ranges = expected_ranges(grid, T_map_laser, np.array([0.0, math.pi / 2, -math.pi / 2]), 0.4)
    np.testing.assert_allclose(ranges, [0.35, math.inf, math.inf])
    ranges = expected_ranges(grid, T_map_laser, np.array([math.pi / 2, -math.pi / 2]), 30.0)
    np.testing.assert_allclose(ranges, [0.45, math.inf])
