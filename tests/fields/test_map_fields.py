"""A prepared map is the same from the cache as from the work."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from firstfix.core.grid import OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields import map_fields
from firstfix.fields.clearance import chessboard_clearance
from firstfix.fields.distance import euclidean_distance, manhattan_distance
from firstfix.fields.map_fields import NEAR_M, MapFields


@pytest.fixture(scope="module")
def grid() -> OccupancyGrid:
    cells = np.zeros((90, 140), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = OCCUPIED
    cells[20:30, 40:44] = OCCUPIED
    cells[60:80, 90:110] = UNKNOWN
    return OccupancyGrid(cells, 0.05)


def arrays_of(fields: MapFields) -> dict[str, NDArray[np.generic]]:
    names = ("squares", "distances", "clearance", "pointscore", "ranges")
    found = {name: getattr(fields, name) for name in names}
    for part in (fields.positions, fields.endpoints):
        for field in dataclasses.fields(part):
            value = getattr(part, field.name)
            if isinstance(value, np.ndarray):
                found[f"{type(part).__name__}.{field.name}"] = value
    return found


def assert_equal(a: MapFields, b: MapFields) -> None:
    left, right = arrays_of(a), arrays_of(b)
    assert left.keys() == right.keys()
    for name in left:
        np.testing.assert_array_equal(left[name], right[name], err_msg=name)
        assert left[name].dtype == right[name].dtype


def test_with_a_cache_it_is_the_same_as_without(grid, tmp_path):
    fresh = MapFields(grid)
    assert_equal(fresh, MapFields(grid, tmp_path / "cache"))  # builds
    assert_equal(fresh, MapFields(grid, tmp_path / "cache"))  # reads


def test_the_second_time_no_ray_is_cast(grid, tmp_path, monkeypatch):
    _ = MapFields(grid, tmp_path).ranges

    def never(*_: object) -> None:
        raise AssertionError("the cache was not read")

    monkeypatch.setattr(map_fields, "build_range_table", never)
    _ = MapFields(grid, tmp_path).ranges


def test_another_map_has_its_own_cache(grid, tmp_path):
    _ = MapFields(grid, tmp_path).ranges
    cells = grid.cells.copy()
    cells[50, 20] = OCCUPIED
    unseen = np.zeros(cells.shape, np.bool_)
    unseen[5:15, 5:60] = True
    for other in (
        OccupancyGrid(cells, 0.05),
        OccupancyGrid(grid.cells, 0.1),
        OccupancyGrid(grid.cells, 0.05, unseen=unseen),
    ):
        assert_equal(MapFields(other), MapFields(other, tmp_path))


def test_where_the_map_lies_does_not_matter_to_the_cache(grid, tmp_path):
    names = ("squares", "clearance", "positions", "endpoints", "ranges")
    MapFields(grid, tmp_path).compute(*names)
    files = list(tmp_path.iterdir())
    assert len(files) == len(names)
    moved = OccupancyGrid(grid.cells, grid.resolution, SE2(5.0, -3.0, 1.0))
    MapFields(moved, tmp_path).compute(*names)
    assert list(tmp_path.iterdir()) == files


def test_a_damaged_cache_is_built_again(grid, tmp_path):
    fresh = MapFields(grid)
    assert_equal(fresh, MapFields(grid, tmp_path))
    for file in tmp_path.iterdir():
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 0xFF
        file.write_bytes(content)
    assert_equal(fresh, MapFields(grid, tmp_path))


def test_the_size_counts_what_has_been_computed(grid):
    fields = MapFields(grid)
    before = fields.nbytes
    assert before >= grid.cells.nbytes
    _ = fields.ranges
    assert fields.nbytes >= before + fields.ranges.nbytes


def test_a_field_that_is_not_read_is_not_computed(grid, monkeypatch):
    built = []
    monkeypatch.setattr(map_fields, "build_range_table", lambda *_: built.append("ranges"))
    fields = MapFields(grid)
    fields.compute("pointscore", "squares", "clearance")
    assert not built


@pytest.mark.parametrize("cached", [False, True])
def test_shared_arrays_cannot_be_written(grid, tmp_path, cached):
    for _ in range(2):  # with a cache: built, then read
        fields = MapFields(grid, tmp_path if cached else None)
        for array in (fields.squares, fields.clearance, fields.endpoints.values, fields.ranges):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0


def test_distances_are_those_of_the_map(grid):
    fields = MapFields(grid)
    near = np.float32(fields.near)
    np.testing.assert_array_equal(
        fields.distances[fields.squares], np.minimum(euclidean_distance(grid.occupied), near)
    )
    np.testing.assert_array_equal(fields.clearance, chessboard_clearance(grid.occupied))
    np.testing.assert_array_equal(fields.pointscore, manhattan_distance(grid.occupied))
    assert fields.near * grid.resolution >= NEAR_M
    assert len(fields.ranges) == len(fields.positions)


@pytest.mark.parametrize("resolution", [0.001, 0.01, 0.05, 0.25, 2.0])
def test_any_size_of_cell_can_be_prepared(resolution):
    cells = np.zeros((300, 60), np.int8)
    cells[0] = OCCUPIED
    fields = MapFields(OccupancyGrid(cells, resolution))
    assert fields.squares.max() <= fields.near**2
    assert len(fields.distances) == fields.near**2 + 1
