"""The occupancy grid: accepted values, and the positions of its cells."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from firstfix.core import grid as grid_module
from firstfix.core.errors import InputError, MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2

CELLS = np.array([[-1, 0, 25], [26, 64, 65], [100, 0, -1]], np.int8)

origins = st.builds(SE2, st.floats(-100, 100), st.floats(-100, 100), st.floats(-4, 4))


@given(origins, st.floats(0.01, 1.0), st.floats(-500, 500), st.floats(-500, 500))
def test_cells_and_map_are_inverse_whatever_the_origin(
    T_map_grid: SE2, resolution: float, column: float, row: float
) -> None:
    grid = OccupancyGrid(CELLS, resolution, T_map_grid)
    cells = np.array([[column, row], [0.0, 0.0]])
    np.testing.assert_allclose(grid.to_cells(grid.to_map(cells)), cells, atol=1e-6)


def test_the_origin_is_the_corner_of_the_first_cell_and_its_yaw_turns_the_map() -> None:
    grid = OccupancyGrid(CELLS, 0.5, SE2(10.0, 20.0, math.pi / 2))
    np.testing.assert_allclose(grid.to_map(np.array([0.0, 0.0])), [10.0, 20.0])
    # Two columns along x of the grid are one metre along y of the map.
    np.testing.assert_allclose(grid.to_map(np.array([2.0, 0.0])), [10.0, 21.0])
    np.testing.assert_allclose(grid.to_cells(np.array([9.5, 20.0])), [0.0, 1.0], atol=1e-12)


def test_thresholds_are_those_of_map_server_and_no_cell_is_both() -> None:
    grid = OccupancyGrid(CELLS, 0.05)
    assert grid.occupied.tolist() == [[0, 0, 0], [0, 0, 1], [1, 0, 0]]
    assert grid.free.tolist() == [[0, 1, 1], [0, 0, 0], [0, 1, 0]]
    assert not (grid.free & grid.occupied).any()


def test_sizes() -> None:
    grid = OccupancyGrid(np.zeros((2, 5), np.int8), 0.5)
    assert (grid.width, grid.height) == (5, 2)
    assert grid.free_area == pytest.approx(2.5)


def test_the_grid_does_not_follow_later_changes() -> None:
    cells = CELLS.copy()
    grid = OccupancyGrid(cells, 0.05)
    cells[:] = 0
    assert (grid.cells == CELLS).all()


@pytest.mark.parametrize("name", ["cells", "occupied", "free"])
def test_arrays_are_read_only(name: str) -> None:
    array = getattr(OccupancyGrid(CELLS, 0.05), name)
    with pytest.raises(ValueError, match="read-only"):
        array[0, 0] = 0


@pytest.mark.parametrize(
    ("cells", "expected"),
    [
        (np.zeros((0, 3), np.int8), "at least one row"),
        (np.zeros((3, 0), np.int8), "at least one row"),
        (np.zeros(3, np.int8), "at least one row"),
        (np.zeros((2, 2), np.int16), "int8"),
        (np.zeros((2, 2), np.float64), "int8"),
        (np.full((2, 2), -2, np.int8), "from -2"),
        (np.full((2, 2), 101, np.int8), "to 101"),
    ],
)
def test_invalid_cells_are_refused(cells: NDArray[np.int8], expected: str) -> None:
    with pytest.raises(MapError, match=expected):
        OccupancyGrid(cells, 0.05)


@pytest.mark.parametrize("resolution", [0.0, -0.05, math.nan, math.inf])
def test_an_invalid_resolution_is_refused(resolution: float) -> None:
    with pytest.raises(MapError, match="resolution above 0"):
        OccupancyGrid(CELLS, resolution)


def test_a_map_with_too_many_cells_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grid_module, "MAX_CELLS", 8)
    with pytest.raises(MapError, match="at most 8 cells, received 3 x 3"):
        OccupancyGrid(CELLS, 0.05)


@pytest.mark.parametrize(
    ("T_map_grid", "extent"),
    [
        ((0.0, 0.0, 0.0), (0.0, 2.0, 0.0, 1.0)),
        ((-1.0, 3.0, 0.0), (-1.0, 1.0, 3.0, 4.0)),
        ((0.0, 0.0, math.pi / 2), (-1.0, 0.0, 0.0, 2.0)),
    ],
)
def test_the_extent_is_the_bounding_box_in_the_map_frame(
    T_map_grid: tuple[float, float, float], extent: tuple[float, ...]
) -> None:
    grid = OccupancyGrid(np.zeros((10, 20), np.int8), 0.1, SE2(*T_map_grid))
    assert grid.extent == pytest.approx(extent)


def test_a_layer_marks_walls_that_are_gone_and_things_that_are_new() -> None:
    grid = OccupancyGrid(np.array([[0, 100, -1, 0, 100]], np.int8), 0.5)
    layer = OccupancyGrid(np.array([[100, 0, 100, -1, -1]], np.int8), 0.5)
    marked = grid.with_changes(layer)
    assert marked.changed is not None
    assert marked.changed.tolist() == [[True, True, True, False, False]]
    assert (marked.cells == grid.cells).all()
    redrawn = OccupancyGrid(np.array([[100, 0, 100, 0, 100]], np.int8), 0.5)
    assert (grid.with_changes(redrawn).changed == marked.changed).all()


@pytest.mark.parametrize(
    "layer",
    [
        OccupancyGrid(np.zeros((3, 4), np.int8), 0.5),
        OccupancyGrid(CELLS * 0, 0.25),
        OccupancyGrid(CELLS * 0, 0.5, SE2(0.1, 0.0, 0.0)),
        OccupancyGrid(CELLS * 0, 0.5, SE2(0.0, 0.0, 0.1)),
    ],
)
def test_changes_of_another_map_are_refused(layer: OccupancyGrid) -> None:
    with pytest.raises(MapError, match="another map"):
        OccupancyGrid(CELLS, 0.5).with_changes(layer)


@pytest.mark.parametrize("layer", [None, "changes.yaml"])
def test_a_layer_is_a_map(layer: object) -> None:
    with pytest.raises(InputError, match="OccupancyGrid"):
        OccupancyGrid(CELLS, 0.05).with_changes(layer)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["unseen", "changed"])
def test_a_mask_of_another_kind_is_refused(name: str) -> None:
    with pytest.raises(MapError, match=f"expected {name} as bool of the shape"):
        OccupancyGrid(CELLS, 0.05, **{name: [1, 2]})  # type: ignore[arg-type]
