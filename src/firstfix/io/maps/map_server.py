"""Maps as map_server reads and writes them: a small YAML beside an image.

The meaning of a pixel follows Nav2 since Jazzy. Where its predecessors differ, `check_map` of
`map_check` tells whether that matters for a given map:

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
from firstfix.io.atomic_files import write_whole
from firstfix.io.maps.files import show, unreadable
from firstfix.io.maps.image import open_image
from firstfix.io.maps.pixels import DEFAULT_MAX_CELLS, MapImage, Strip
from firstfix.io.maps.yaml_file import MapMode, MapYaml, check_resolution, read_yaml

# What every map_saver writes; p of 205 is 0.19608, just above the threshold.
GREY_OCCUPIED, GREY_UNKNOWN, GREY_FREE = 0, 205, 254
SAVED_OCCUPIED_THRESH, SAVED_FREE_THRESH = 0.65, 0.196


def load_map(path: str | os.PathLike[str], max_cells: int = DEFAULT_MAX_CELLS) -> OccupancyGrid:
    """Load a map of map_server.

    Parameters
    ----------
    path : path-like
        The YAML, or a folder with one in it.
    max_cells : int
        Refuse larger images before they are decoded.

    Returns
    -------
    OccupancyGrid
        Row 0 is the bottom row of the image; the pose of its corner has the yaw of ``origin``.
        Grey 205 that the thresholds call free stays free, and is marked unseen.

    Raises
    ------
    MapError
        If the YAML or the image is missing, broken, too large or not what a server could use.
    """
    header = read_yaml(path)
    image = open_image(header.image, max_cells)
    table = cell_table(header, image)
    cells = np.empty((image.height, image.width), np.int8)
    meant_unknown = (table == FREE) & (image.levels * 255 == GREY_UNKNOWN * image.white)
    unseen = np.zeros(cells.shape, np.bool_) if meant_unknown.any() else None
    for strip in image.strips():
        rows = slice(image.height - strip.bottom, image.height - strip.top)
        cells[rows] = to_cells(strip, table, header.mode)[::-1]
        if unseen is not None:
            unseen[rows] = meant_unknown[strip.codes][::-1]
    if unseen is not None and unseen[cells == FREE].all():
        unseen = None  # the whole floor is of this grey: someone drew it so
    cells.flags.writeable = False  # or the grid would copy them
    return OccupancyGrid(cells, header.resolution, header.T_map_grid, unseen)


def save_map(grid: OccupancyGrid, yaml_path: str | os.PathLike[str]) -> Path:
    """Write a map that `load_map` gives back cell by cell.

    The image is a PGM beside the YAML. Maps of only free, occupied and unknown cells are written in
    mode trinary, which everything reads; others in mode raw, whose greys are the cells themselves.
    Both files appear whole or not at all, the image first.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    yaml_path : path-like
        Where its YAML goes, with suffix .yaml or .yml; existing files are replaced.

    Returns
    -------
    Path
        The YAML.

    Raises
    ------
    MapError
        If the name has another suffix, or the files cannot be written.
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


def cell_table(header: MapYaml, image: MapImage) -> NDArray[np.int8]:
    """Give every pixel code of an image its cell.

    Parameters
    ----------
    header : MapYaml
        Mode, thresholds and negation.
    image : MapImage
        How bright each code is.

    Returns
    -------
    ndarray of int8, shape (n_codes,)
        -1 unknown, 0 free ... 100 occupied.
    """
    cells = np.full(len(image.levels), UNKNOWN, np.int8)
    if header.mode is MapMode.RAW:
        # Brightness in 8 bits, rounded half up in integers; negate plays no part, as in Nav2.
        raw = (2 * 255 * image.levels + image.white) // (2 * image.white)
        return np.where(raw <= OCCUPIED, raw, UNKNOWN).astype(np.int8)
    p = occupancy(header, image)
    free, occupied = header.free_thresh, header.occupied_thresh
    cells[p >= occupied] = OCCUPIED
    cells[p <= free] = FREE
    if header.mode is MapMode.SCALE:
        between = (p > free) & (p < occupied)
        cells[between] = np.floor((p[between] - free) / (occupied - free) * 100.0 + 0.5)
    return cells


def occupancy(header: MapYaml, image: MapImage) -> NDArray[np.float64]:
    """Return the occupancy of every pixel code, 0 to 1, before any threshold."""
    occupied = image.levels if header.negate else image.white - image.levels
    # One division of integers: the nearest float, so that a threshold of 0.2 meets grey 204.
    p: NDArray[np.float64] = occupied / image.white
    return p


def to_cells(strip: Strip, table: NDArray[np.int8], mode: MapMode) -> NDArray[np.int8]:
    """Turn some rows of pixels into cells, in the order of the image."""
    cells: NDArray[np.int8] = table[strip.codes]
    if strip.transparent is not None and mode is not MapMode.RAW:
        cells[strip.transparent] = UNKNOWN
    return cells


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
