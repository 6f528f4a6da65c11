"""The built-in buildings, and random poses in them."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path

import numpy as np

from firstfix.core.errors import InputError, MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.clearance import chessboard_clearance
from firstfix.io.maps.map_server import load_map
from firstfix.lab.worlds.corridor import corridor
from firstfix.lab.worlds.drawing import MARGIN, RESOLUTION, Drawing
from firstfix.lab.worlds.floors import RandomFloor
from firstfix.lab.worlds.hotel import HOTEL_START, hotel
from firstfix.lab.worlds.house import house
from firstfix.lab.worlds.office import office
from firstfix.lab.worlds.warehouse import warehouse

ROOM_PITCH = 8.0

_RANDOM_FLOOR = "floor:"


def identical_rooms(count: int) -> OccupancyGrid:
    """Draw closed rooms of one plan that no scan from inside can distinguish.

    Room i begins at x = i · `ROOM_PITCH`.

    Raises
    ------
    InputError
        If ``count`` is less than 1.
    """
    if count < 1:
        raise InputError(
            expected="at least 1 room", received=f"{count}", remedy="ask for one room or more"
        )
    plan = Drawing(count * ROOM_PITCH, 5.0, RESOLUTION, MARGIN)
    for i in range(count):
        x = i * ROOM_PITCH
        plan.room(x, 0.0, x + 6.4, 4.6)
        # Without these a turn of the room by 180° would look the same.
        plan.solid(x + 0.1, 3.2, x + 1.3, 4.5)
        plan.solid(x + 5.0, 0.1, x + 6.3, 0.6)
        plan.table(x + 2.6, 1.8, x + 4.2, 2.6)
    return plan.grid()


def random_free_pose(
    grid: OccupancyGrid, rng: np.random.Generator, clearance_m: float = 0.3
) -> SE2:
    """Draw one pose where a robot can stand, as `random_free_poses` does."""
    return random_free_poses(grid, rng, 1, clearance_m)[0]


def random_free_poses(
    grid: OccupancyGrid, rng: np.random.Generator, count: int, clearance_m: float = 0.3
) -> list[SE2]:
    """Draw ``T_map_base`` of a standing robot, uniformly over free cells and all headings.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    rng : numpy.random.Generator
        Source of randomness.
    count : int
        Number of poses.
    clearance_m : float
        Half the side of the square around a pose that must be free, m, up to 254 cells.

    Raises
    ------
    MapError
        If no place of the map is that free.
    """
    # Beyond the border of the map nothing is known to be free.
    blocked = np.pad(~grid.seen_free, 1, constant_values=True)
    clearance_cells = chessboard_clearance(blocked)[1:-1, 1:-1]
    places = np.flatnonzero(clearance_cells > clearance_m / grid.resolution)
    if len(places) == 0:
        raise MapError(
            expected=f"a free place with {clearance_m} m around it",
            received=f"a map of {grid.free_area:.1f} m² free area without one",
            remedy="use another map or less clearance",
        )
    return [_pose_in_cell(grid, rng, int(rng.choice(places))) for _ in range(count)]


def _pose_in_cell(grid: OccupancyGrid, rng: np.random.Generator, index: int) -> SE2:
    row, column = divmod(index, grid.width)
    x, y = grid.to_map(np.array([column, row]) + rng.uniform(0.0, 1.0, 2))
    return SE2(float(x), float(y), float(rng.uniform(-math.pi, math.pi)))


WORLDS: dict[str, Callable[[], OccupancyGrid]] = {
    "office": office,
    "rooms": partial(identical_rooms, 4),
    "warehouse": warehouse,
    "house": house,
    "corridor": corridor,
    "hotel": hotel,
}

STARTS: dict[str, SE2] = {"hotel": HOTEL_START}
"""Where the robot of the live page starts, in worlds drawn to show one thing; else at random."""


def parse_worlds(text: str, known: Collection[str]) -> list[str]:
    """Read names of worlds, separated by commas; each is returned once.

    Raises
    ------
    InputError
        If one of them is not in ``known``.
    """
    names = list(dict.fromkeys(name.strip() for name in text.split(",")))
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError(
            expected=f"--worlds of {', '.join(known)}",
            received=", ".join(repr(name) for name in unknown),
            remedy="separate names by commas, as in --worlds office,house",
        )
    return names


def world_or_map(name: str) -> OccupancyGrid:
    """Draw a built-in world or a random floor (``floor:SEED``), or load a map by its YAML's path.

    Raises
    ------
    InputError
        If it is neither, or the map cannot be used.
    """
    if name in WORLDS:
        return WORLDS[name]()
    if (seed := name.removeprefix(_RANDOM_FLOOR)) != name and seed.isdecimal():
        return RandomFloor(int(seed)).map()
    if not Path(name).exists():
        raise InputError(
            expected=f"the YAML of a map, or a built-in world ({', '.join(WORLDS)}, floor:SEED)",
            received=f"no such file: {name}",
            remedy="check the path or the name",
        )
    return load_map(Path(name))
