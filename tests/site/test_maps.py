"""Prepared maps: files, memory, and maps that cannot be used."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from site_lab import ROOMS, draw, save_rooms

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.io.maps.map_server import load_map, save_map
from firstfix.io.maps.site_yaml import SiteMap
from firstfix.site.maps import PreparedMaps, prepared

FIELDS = ("squares", "clearance", "endpoints", "ranges")


@pytest.mark.parametrize("cached", [False, True])
def test_a_prepared_map_is_the_loaded_one(folder: Path, tmp_path: Path, cached) -> None:
    path = folder / "first" / "map.yaml"
    grid = load_map(path)
    fresh = MapFields(grid)
    for _ in range(2):  # with a folder: built, then mapped
        found = prepared(SiteMap("first", path), tmp_path if cached else None).fields
        np.testing.assert_array_equal(found.grid.cells, grid.cells)
        assert (found.grid.resolution, found.grid.T_map_grid) == (grid.resolution, grid.T_map_grid)
        for name in ("squares", "clearance", "ranges"):
            np.testing.assert_array_equal(getattr(found, name), getattr(fresh, name))
        np.testing.assert_array_equal(found.endpoints.values, fresh.endpoints.values)


def test_unseen_cells_are_kept(tmp_path: Path) -> None:
    grid = draw(ROOMS["ground"])
    path = save_map(grid, tmp_path / "map.yaml")
    # Thresholds that turn grey 205, which is unknown, into free.
    path.write_text(path.read_text().replace("free_thresh: 0.196", "free_thresh: 0.25"))
    for _ in range(2):
        fields = prepared(SiteMap("map", path), tmp_path / "cache").fields
        found, read = fields.grid, load_map(path)
        assert found.unseen is not None
        np.testing.assert_array_equal(found.seen_free, read.seen_free)
        np.testing.assert_array_equal(fields.unknown, read.unknown)
    # It was mapped from its file: a site would else hold a copy of every map.
    assert "unknown" not in vars(found)


def test_memory_stays_within_the_limit_whatever_is_asked(folder: Path, tmp_path: Path) -> None:
    entries = {f"{room}{i}": SiteMap(room, folder / room) for room in ROOMS for i in range(20)}
    one = prepared(entries["first0"], tmp_path)
    one.fields.compute(*FIELDS)
    limit = 5 * one.fields.nbytes
    maps = PreparedMaps(entries, tmp_path, limit)
    for name in (*entries, *entries):
        maps.get(name).fields.compute(*FIELDS)
        maps.get(name)
        assert maps.held_bytes <= limit
    newest = maps.get("second19")
    assert maps.get("second19") is newest


def test_the_origin_tells_copies_apart_that_lie_elsewhere(tmp_path: Path) -> None:
    grid = draw(ROOMS["ground"])
    moved = OccupancyGrid(grid.cells, grid.resolution, SE2(5.0, 0.0, 0.0))
    paths = [
        save_map(one, tmp_path / f"{name}.yaml")
        for name, one in (("a", grid), ("b", grid), ("c", moved))
    ]
    a, b, c = (prepared(SiteMap(path.stem, path), tmp_path / "cache").content for path in paths)
    assert a == b != c


def without_walls(folder: Path) -> None:
    grid = draw([])
    empty = OccupancyGrid(np.zeros_like(grid.cells), grid.resolution)
    save_map(empty, folder / "map.yaml")


def without_image(folder: Path) -> None:
    (folder / "map.pgm").unlink()


def empty_image(folder: Path) -> None:
    (folder / "map.pgm").write_bytes(b"")


def huge_image(folder: Path) -> None:
    (folder / "map.pgm").write_bytes(b"P5\n999999 999999\n255\n")


def no_yaml(folder: Path) -> None:
    (folder / "map.yaml").write_bytes(b"image: map.pgm\nresolution: \xff\n")


@pytest.mark.parametrize("damage", [without_walls, without_image, empty_image, huge_image, no_yaml])
def test_a_map_that_cannot_be_used_is_one_sentence_and_leaves_no_file(
    tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    save_rooms(tmp_path)
    damage(tmp_path / "ground")
    cache = tmp_path / "cache"
    with pytest.raises(InputError) as caught:
        prepared(SiteMap("ground", tmp_path / "ground"), cache)
    assert "\n" not in str(caught.value)
    assert not cache.exists()


def test_an_unknown_map_is_refused(folder: Path) -> None:
    with pytest.raises(InputError, match="no map 'attic'"):
        PreparedMaps({"first": SiteMap("first", folder / "first")}, None, 1).get("attic")
