"""Drawn buildings: a robot's world without a file."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from firstfix.core.errors import InputError, MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.clearance import chessboard_clearance
from firstfix.sim.drawing import Drawing

RESOLUTION = 0.05
MARGIN = 1.0  # nobody has looked behind the outer walls
ROOM_PITCH = 8.0


def office() -> OccupancyGrid:
    """Draw one floor of an office, 40 x 25 m at 5 cm, no two rooms of which are alike.

    Returns
    -------
    OccupancyGrid
        The map; its frame has the floor's south-west corner at (0, 0).
    """
    plan = Drawing(40.0, 25.0, RESOLUTION, MARGIN)
    _office_rooms(plan)
    _office_doors(plan)
    _office_furniture(plan)
    return plan.grid()


def identical_rooms(count: int) -> OccupancyGrid:
    """Draw rooms that no scan from inside can tell apart: one plan, doors closed.

    Parameters
    ----------
    count : int
        Number of rooms, at least 1; they stand in a row, `ROOM_PITCH` metres apart.

    Returns
    -------
    OccupancyGrid
        The map; room i begins at x = i · `ROOM_PITCH`.

    Raises
    ------
    InputError
        If there is no room to draw.
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
    """Draw poses where a robot can stand, evenly over the map's free cells and all headings.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    rng : numpy.random.Generator
        Source of chance.
    count : int
        Number of poses.
    clearance_m : float
        Half the side of the square around a pose that must be free, m, up to 254 cells.

    Returns
    -------
    list of SE2
        ``T_map_base`` of each.

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


def _office_rooms(plan: Drawing) -> None:
    plan.room(0.0, 11.0, 40.0, 13.2)  # corridor, west to east
    for west, east in ((0.0, 6.2), (6.2, 10.4), (10.4, 19.6), (19.6, 24.8), (24.8, 28.0)):
        plan.room(west, 0.0, east, 11.0)
    plan.room(28.0, 3.4, 40.0, 11.0)  # the south-east corner is cut off
    for west, east, north in ((0.0, 8.4, 25.0), (8.4, 13.0, 21.0), (13.0, 25.8, 25.0)):
        plan.room(west, 13.2, east, north)
    plan.room(25.8, 13.2, 27.6, 25.0)  # corridor to the north
    plan.room(27.6, 13.2, 40.0, 18.0)
    plan.room(27.6, 18.0, 34.6, 25.0)
    plan.room(34.6, 18.0, 40.0, 23.4)


def _office_doors(plan: Drawing) -> None:
    for x in (1.5, 9.4, 12.0, 18.2, 23.6, 26.0, 30.2, 38.6):  # to the south
        plan.door(x, 11.0)
    for x in (6.8, 10.2, 14.4):  # to the north
        plan.door(x, 13.2)
    plan.door(26.7, 13.2, width=1.6)
    plan.door(27.6, 15.4)
    plan.door(27.6, 21.8)
    plan.door(34.6, 19.2)
    plan.door(19.6, 2.4)
    plan.door(25.8, 23.6)


def _office_furniture(plan: Drawing) -> None:
    plan.solid(0.1, 0.1, 0.5, 6.0)  # shelves
    plan.solid(3.0, 10.5, 6.1, 10.9)
    plan.solid(6.3, 0.1, 10.3, 0.7)
    plan.solid(24.9, 4.0, 25.3, 9.0)
    plan.solid(2.0, 24.4, 7.4, 24.9)
    plan.solid(8.5, 16.0, 9.1, 19.4)
    plan.solid(38.4, 13.3, 39.9, 14.1)
    plan.solid(34.7, 22.7, 37.2, 23.3)
    for x, y in ((13.4, 5.4), (16.6, 5.4), (33.0, 7.0), (36.6, 7.0), (17.2, 19.0), (21.4, 19.0)):
        plan.solid(x, y, x + 0.4, y + 0.4)  # pillars
    for x, y in ((2.2, 2.0), (2.2, 5.2), (11.2, 1.2), (14.8, 1.2), (11.2, 8.0), (30.0, 4.4)):
        plan.table(x, y, x + 1.6, y + 0.8)
    plan.table(20.8, 5.0, 22.0, 8.6)
    plan.table(15.0, 15.2, 21.0, 16.6)
    plan.table(29.0, 20.0, 31.4, 23.0)
    plan.table(2.6, 16.4, 4.2, 21.6)
    plan.solid(30.6, 15.0, 33.8, 15.8)  # counter
    plan.solid(31.2, 11.1, 32.6, 11.5)  # copier in the corridor
    plan.solid(4.2, 12.6, 4.9, 13.1)
    plan.solid(20.6, 12.8, 22.2, 13.1)


WORLDS: dict[str, Callable[[], OccupancyGrid]] = {
    "office": office,
    "rooms": partial(identical_rooms, 4),
}
