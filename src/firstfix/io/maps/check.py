"""What a person should know about a map before a robot relies on it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from firstfix.core.se2 import SE2
from firstfix.io.maps.image import open_image
from firstfix.io.maps.pixels import DEFAULT_MAX_CELLS
from firstfix.io.maps.traps import count_pixels, find_traps
from firstfix.io.maps.yaml_file import MapMode, read_yaml


@dataclass(frozen=True, slots=True)
class MapCheck:
    """What a map contains, and what about it may surprise.

    Parameters
    ----------
    yaml, image : Path
        The two files.
    pixels : str
        Format of the image and layout of a pixel, in words.
    mode : MapMode
        How pixels become cells.
    width, height : int
        Size in cells.
    width_m, height_m : float
        Size, m.
    resolution : float
        Side of a cell, m.
    T_map_grid : SE2
        Pose of the lower-left corner in the map frame (``origin``).
    free, occupied, unknown : float
        Shares of all cells, 0 to 1; what is missing to 1 is in between (modes scale and raw).
    free_area : float
        Area of the free cells, m².
    warnings : tuple of str
        One sentence each: what is the matter, and what to do; empty for a map without traps.
    """

    yaml: Path
    image: Path
    pixels: str
    mode: MapMode
    width: int
    height: int
    width_m: float
    height_m: float
    resolution: float
    T_map_grid: SE2
    free: float
    occupied: float
    unknown: float
    free_area: float
    warnings: tuple[str, ...]


def check_map(path: str | os.PathLike[str], max_cells: int = DEFAULT_MAX_CELLS) -> MapCheck:
    """Look a map over for what servers accept without a word.

    Parameters
    ----------
    path : path-like
        The YAML, or a folder with one in it.
    max_cells : int
        Refuse larger images before they are decoded.

    Returns
    -------
    MapCheck
        The map in figures, and warnings in words.

    Raises
    ------
    MapError
        Wherever `load_map` does.
    """
    header = read_yaml(path)
    image = open_image(header.image, max_cells)
    facts = count_pixels(header, image)
    return MapCheck(
        yaml=header.path,
        image=header.image,
        pixels=image.kind,
        mode=header.mode,
        width=image.width,
        height=image.height,
        width_m=image.width * header.resolution,
        height_m=image.height * header.resolution,
        resolution=header.resolution,
        T_map_grid=header.T_map_grid,
        free=facts.free,
        occupied=facts.occupied,
        unknown=facts.unknown,
        free_area=facts.free_area,
        warnings=tuple(find_traps(facts)),
    )
