"""Buildings by name, and maps by file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Collection

    from firstfix.core.grid import OccupancyGrid


def worlds_of(text: str, known: Collection[str]) -> list[str]:
    """Read names of worlds with commas between.

    Parameters
    ----------
    text : str
        What was given as ``--worlds``.
    known : collection of str
        What there is to choose from.

    Returns
    -------
    list of str
        The names, each once.

    Raises
    ------
    InputError
        If one of them is not known.
    """
    names = list(dict.fromkeys(name.strip() for name in text.split(",")))
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError(
            expected=f"--worlds of {', '.join(known)}",
            received=", ".join(repr(name) for name in unknown),
            remedy="put commas between their names, as in --worlds laboratory,house",
        )
    return names


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
    from firstfix.io.maps.map_server import load_map
    from firstfix.lab.worlds.catalog import WORLDS

    if name in WORLDS:
        return WORLDS[name]()
    if not Path(name).exists():
        raise InputError(
            expected=f"a world ({', '.join(WORLDS)}) or a map's YAML",
            received=f"no such file: {name}",
            remedy="check the path or the name",
        )
    return load_map(Path(name))
