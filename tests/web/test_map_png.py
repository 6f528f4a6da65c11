"""The map as a PNG: no wall is lost in it."""

from __future__ import annotations

import io
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.web.map_png import MOST_PIXELS, MapPngCache, png_layout
from firstfix.web.snapshot import ActiveMap

WALL, DARK, LIGHT = 40, 205, 255


def shown(cells: np.ndarray, resolution: float = 0.05) -> ActiveMap:
    grid = OccupancyGrid(cells.astype(np.int8), resolution, SE2(-1.0, -2.0, 0.3))
    return ActiveMap("test", f"{id(cells)}", grid, SimpleNamespace())


def picture(of: ActiveMap, most: int = MOST_PIXELS) -> np.ndarray:
    image = Image.open(io.BytesIO(MapPngCache().png(of, most)))
    assert image.mode == "L"
    return np.asarray(image)


def test_the_top_row_is_the_last_of_the_grid():
    cells = np.array([[OCCUPIED, FREE], [UNKNOWN, FREE], [FREE, OCCUPIED]])
    assert picture(shown(cells)).tolist() == [[LIGHT, WALL], [DARK, LIGHT], [WALL, LIGHT]]


def test_a_thin_wall_stays_in_a_small_picture():
    cells = np.full((560, 600), FREE)
    cells[:, 301] = OCCUPIED
    cells[17, :] = OCCUPIED
    small = picture(shown(cells), 100)
    assert small.shape == (94, 100)
    assert (small == WALL).all(axis=0).sum() == 1
    assert (small == WALL).all(axis=1).sum() == 1


@pytest.mark.parametrize("side", [64, 100, 101, 127, 600])
def test_the_image_has_the_size_of_its_layout(side):
    of = shown(np.full((333, 600), FREE))
    width, height, resolution = png_layout(of, side)
    assert picture(of, side).shape == (height, width)
    assert max(width, height) <= side
    # From the lower-left corner on, it covers the map, and less than a pixel more.
    for pixels, cells in ((width, 600), (height, 333)):
        beyond = pixels * resolution - cells * 0.05
        assert -1e-9 <= beyond < resolution


def test_the_corner_of_the_picture_is_that_of_the_map():
    cells = np.full((333, 600), FREE)
    cells[0, 0] = OCCUPIED
    small = picture(shown(cells), 64)
    assert small[-1, 0] == WALL
    assert (small == WALL).sum() == 1


def test_a_large_map_is_scaled_to_what_a_browser_can_draw():
    cells = np.full((5600, 6000), FREE, np.int8)
    cells[2801] = OCCUPIED
    of = shown(cells)
    drawn = picture(of)
    assert drawn.shape == (2800, 3000)
    assert (drawn == WALL).all(axis=1).sum() == 1
    assert png_layout(of)[2] == 0.1


def test_a_picture_is_drawn_once():
    pictures, of = MapPngCache(), shown(np.full((100, 100), FREE))
    assert pictures.png(of) is pictures.png(of)
    for side in range(64, 90):
        pictures.png(of, side)
    assert len(pictures._cached) <= 4
