"""Named zones of a map: polygons in a YAML beside it."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

from firstfix.core.errors import MapError
from firstfix.io.atomic_files import read_bytes
from firstfix.io.maps.map_yaml import find_yaml
from firstfix.io.safe_yaml import entries, load_mapping

Polygon = tuple[tuple[float, float], ...]

_EXAMPLE = "zones: {hall: [[0, 0], [5, 0], [5, 4], [0, 4]]}"
_MAX_BYTES = 65_536


def load_zones(map_path: str | os.PathLike[str]) -> dict[str, Polygon]:
    """Load the zones of a map: of ``hall.zones.yaml`` beside ``hall.yaml``.

    Parameters
    ----------
    map_path : path-like
        The YAML of the map, or its folder.

    Returns
    -------
    dict of str to tuple of (x, y)
        Corners in the map frame, m, by the names of the zones.

    Raises
    ------
    MapError
        If there is no such file, or a zone is not a list of three or more corners.
    """
    path = find_yaml(Path(map_path)).with_suffix(".zones.yaml")
    data = read_bytes(path, what="the zones of a map", limit=_MAX_BYTES)
    return zones_of(entries(load_mapping(data, path, example=_EXAMPLE), path).get("zones"), path)


def zones_of(zones: Any, path: Path) -> dict[str, Polygon]:
    """Return the zones of a YAML mapping: corners by name.

    Raises
    ------
    MapError
        If it is no mapping, or a zone is not a list of three or more corners.
    """
    if not isinstance(zones, dict):
        raise MapError(f"{path} has no zones. Write a line like '{_EXAMPLE}'.")
    return {name: _polygon(name, corners, path) for name, corners in entries(zones, path).items()}


def _polygon(name: str, corners: Any, path: Path) -> Polygon:
    if isinstance(corners, list) and len(corners) >= 3 and all(map(_is_corner, corners)):
        return tuple((float(x), float(y)) for x, y in corners)
    raise MapError(
        f"The zone {name} in {path} is no list of three or more corners. Write a line like "
        f"'{_EXAMPLE}'."
    )


def _is_corner(corner: Any) -> bool:
    return (
        isinstance(corner, list)
        and len(corner) == 2
        and all(isinstance(c, (int, float)) and math.isfinite(c) for c in corner)
    )
