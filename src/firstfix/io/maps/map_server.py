"""Maps as map_server reads and writes them: a small YAML beside an image.

The meaning of a pixel follows Nav2 since Jazzy. Where older versions differ, `check_map` reports
whether that matters for a given map:

- A pixel exactly on a threshold is wall (``p >= occupied_thresh``) or free
  (``p <= free_thresh``); ROS 1 Noetic and Nav2 Humble compare strictly and say unknown.
- A pixel with alpha below 255 is unknown in the modes trinary and scale; Noetic and Humble average
  alpha into the brightness of trinary maps.
- Colour is the average of the channels, as in Noetic and Humble; newer Nav2 weighs them.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from firstfix.core.errors import MapError
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.io.atomic_files import show, write_whole
from firstfix.io.maps.image import read_image, unreadable
from firstfix.io.maps.map_yaml import MapMode, MapYaml, check_resolution, read_yaml

# What every map_saver writes; p of 205 is 0.19608, just above the threshold.
GREY_OCCUPIED, GREY_UNKNOWN, GREY_FREE = 0, 205, 254
SAVED_OCCUPIED_THRESH, SAVED_FREE_THRESH = 0.65, 0.196


def load_map(path: str | os.PathLike[str]) -> OccupancyGrid:
    """Load a map of map_server.

    Parameters
    ----------
    path : path-like
        The YAML, or a folder that contains it.

    Returns
    -------
    OccupancyGrid
        Row 0 is the bottom row of the image; the pose of its corner has the yaw of ``origin``.
        Grey 205 that the thresholds call free stays free, and is marked unseen.

    Raises
    ------
    MapError
        If the YAML or the image is missing, damaged, too large or not usable for a map server.

    Examples
    --------
    >>> path = ff.save_map(grid, "map.yaml")
    >>> np.array_equal(ff.load_map("map.yaml").cells, grid.cells)
    True
    """
    header = read_yaml(path)
    image = read_image(header.image)
    table = cell_table(header, image.white)
    is_grey_unknown = (table == FREE) & (
        np.arange(image.white + 1) * 255 == GREY_UNKNOWN * image.white
    )
    cells = np.empty(image.levels.shape, np.int8)
    unseen = np.zeros(cells.shape, np.bool_) if is_grey_unknown.any() else None
    # Row by row: looking up a whole image would make indices of 8 bytes for every pixel.
    for row, levels in enumerate(image.levels[::-1]):
        cells[row] = table[levels]
        if unseen is not None:
            unseen[row] = is_grey_unknown[levels]
    if image.transparent is not None and header.mode is not MapMode.RAW:
        cells[image.transparent[::-1]] = UNKNOWN
    if unseen is not None and unseen[cells == FREE].all():
        unseen = None  # the whole floor is of this grey: drawn on purpose
    cells.flags.writeable = False  # otherwise the grid copies them
    return OccupancyGrid(cells, header.resolution, header.T_map_grid, unseen)


def save_map(grid: OccupancyGrid, yaml_path: str | os.PathLike[str]) -> Path:
    """Write a map; `load_map` returns the same cells.

    The image is a PGM beside the YAML. Maps of only free, occupied and unknown cells are written in
    mode trinary, which every server reads; others in mode raw, whose greys are the cells.
    Each file is written completely or not at all, the image first.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    yaml_path : path-like
        Its YAML, with suffix .yaml or .yml; existing files are replaced.

    Returns
    -------
    Path
        The YAML.

    Raises
    ------
    MapError
        If the name has another suffix, or the files cannot be written.

    Examples
    --------
    >>> ff.save_map(grid, "map.yaml").name
    'map.yaml'
    """
    path = Path(yaml_path)
    if path.suffix not in (".yaml", ".yml"):
        raise MapError(
            expected="a file name that ends in .yaml",
            received=show(str(path)),
            remedy="name the YAML; the image goes beside it",
        )
    check_resolution(grid.resolution, path)
    mode = MapMode.TRINARY if _is_trinary(grid) else MapMode.RAW
    image = path.with_suffix(".pgm")
    try:
        header = _yaml_text(grid, image.name, mode).encode()
        start = f"P5\n{grid.width} {grid.height}\n255\n".encode()
        write_whole(image, (start, _greys(grid, mode).data))
        write_whole(path, (header,))
    except OSError as error:
        raise unreadable(path, error) from error
    except ValueError as error:  # NUL, or what UTF-8 cannot hold
        raise MapError(
            expected="a file name that can exist",
            received=show(str(path)),
            remedy="choose another name",
        ) from error
    return path


def cell_table(header: MapYaml, white: int) -> NDArray[np.int8]:
    """Return the cell for every brightness.

    Parameters
    ----------
    header : MapYaml
        Mode, thresholds and negation.
    white : int
        Brightness of white.

    Returns
    -------
    ndarray of int8, shape (white + 1,)
        -1 unknown, 0 free ... 100 occupied.
    """
    levels = np.arange(white + 1)
    if header.mode is MapMode.RAW:
        # Brightness in 8 bits, rounded half up in integers; negate plays no part, as in Nav2.
        raw = (2 * 255 * levels + white) // (2 * white)
        return np.where(raw <= OCCUPIED, raw, UNKNOWN).astype(np.int8)
    cells = np.full(len(levels), UNKNOWN, np.int8)
    p = occupancy(header, white)
    free, occupied = header.free_thresh, header.occupied_thresh
    cells[p >= occupied] = OCCUPIED
    cells[p <= free] = FREE
    if header.mode is MapMode.SCALE:
        between = (p > free) & (p < occupied)
        cells[between] = np.floor((p[between] - free) / (occupied - free) * 100.0 + 0.5)
    return cells


def occupancy(header: MapYaml, white: int) -> NDArray[np.float64]:
    """Return the occupancy for every brightness, 0 to 1, before any threshold."""
    levels = np.arange(white + 1)
    # One division of integers gives the nearest float: a threshold of 0.2 equals grey 204.
    p: NDArray[np.float64] = (levels if header.negate else levels[::-1]) / white
    return p


def _is_trinary(grid: OccupancyGrid) -> bool:
    between = (grid.cells > FREE) & (grid.cells < OCCUPIED)
    return not between.any()


def _greys(grid: OccupancyGrid, mode: MapMode) -> NDArray[np.uint8]:
    """Return the pixels of a saved map, top row first."""
    if mode is MapMode.RAW:
        # -1 becomes 255, which is unknown to every server.
        return np.ascontiguousarray(grid.cells.view(np.uint8)[::-1])
    greys = np.full(256, GREY_UNKNOWN, np.uint8)
    greys[[FREE, OCCUPIED]] = GREY_FREE, GREY_OCCUPIED
    return greys[grid.cells.view(np.uint8)[::-1]]


def _yaml_text(grid: OccupancyGrid, image: str, mode: MapMode) -> str:
    pose = grid.T_map_grid
    entries = {
        "image": image,
        "mode": mode.value,
        "resolution": grid.resolution,
        "origin": [pose.x, pose.y, pose.yaw],
        "negate": 0,
        "occupied_thresh": SAVED_OCCUPIED_THRESH,
        "free_thresh": SAVED_FREE_THRESH,
    }
    return yaml.safe_dump(
        entries, sort_keys=False, default_flow_style=None, allow_unicode=True, width=4096
    )
