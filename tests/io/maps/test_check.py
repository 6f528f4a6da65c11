"""Figures of a map."""

import numpy as np
import pytest

from firstfix.core.errors import MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.maps.check import check_map
from firstfix.io.maps.map_server import load_map, save_map
from firstfix.io.maps.yaml_file import MapMode


def test_figures_of_a_drawn_map(tmp_path):
    cells = np.array([[100, 100, 100, 100], [0, 0, 0, 0], [0, 0, -1, -1]], np.int8)
    path = save_map(OccupancyGrid(cells, 0.5, SE2(1.0, 2.0, 0.0)), tmp_path / "m.yaml")
    check = check_map(path)
    assert (check.yaml, check.image) == (path, tmp_path / "m.pgm")
    assert (check.pixels, check.mode) == ("PGM grey, maxval 255", MapMode.TRINARY)
    assert (check.width, check.height) == (4, 3)
    assert (check.width_m, check.height_m) == (2.0, 1.5)
    assert (check.resolution, check.T_map_grid) == (0.5, SE2(1.0, 2.0, 0.0))
    assert (check.free, check.occupied, check.unknown) == (6 / 12, 4 / 12, 2 / 12)
    assert check.free_area == 6 * 0.25
    assert check.warnings == ()


def test_figures_agree_with_the_grid_in_every_mode(tmp_path):
    cells = np.random.default_rng(3).integers(-1, 101, (200, 100), np.int8)
    path = save_map(OccupancyGrid(cells, 0.05), tmp_path / "m.yaml")
    for mode in MapMode:
        path.write_text(path.read_text().replace("mode: raw", f"mode: {mode.value}"))
        grid, check = load_map(path), check_map(path)
        assert check.mode is mode
        assert check.free == pytest.approx(grid.free.mean(), abs=1e-12)
        assert check.occupied == pytest.approx(grid.occupied.mean(), abs=1e-12)
        assert check.unknown == pytest.approx((grid.cells == -1).mean(), abs=1e-12)
        assert check.free_area == pytest.approx(grid.free_area)
        path.write_text(path.read_text().replace(f"mode: {mode.value}", "mode: raw"))


def test_what_cannot_be_loaded_cannot_be_checked(tmp_path):
    with pytest.raises(MapError):
        check_map(tmp_path / "no.yaml")
    save_map(OccupancyGrid(np.zeros((2, 2), np.int8), 0.05), tmp_path / "m.yaml")
    with pytest.raises(MapError, match="max_cells"):
        check_map(tmp_path / "m.yaml", max_cells=3)
