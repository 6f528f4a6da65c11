"""Buildings by name, and maps by file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.core.grid import OccupancyGrid


def world_or_map(name: str) -> OccupancyGrid:
    """Draw a built-in world, or load a map.

    Parameters
    ----------
    name : str
        The name of a world, or the path of a map's YAML.

    Returns
    -------
    OccupancyGrid
        The building.

    Raises
    ------
    InputError
        If it is neither, or the map cannot be used.
    """
    from firstfix.formats.map_server import load_map
    from firstfix.sim.world import WORLDS

    if name in WORLDS:
        return WORLDS[name]()
    if not Path(name).exists():
        raise InputError(
            expected=f"a world ({', '.join(WORLDS)}) or a map's YAML",
            received=f"{name}, which is neither",
            remedy="choose another one",
        )
    return load_map(Path(name))
