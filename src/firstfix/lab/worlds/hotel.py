"""A hotel floor whose rooms look alike from inside, drawn."""

from __future__ import annotations

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.worlds.drawing import MARGIN, RESOLUTION, Drawing

ROOMS = 4
ROOM_WIDTH = 5.0

_DEPTH, _CORRIDOR = 4.6, 2.2
_DOOR = 1.2

HOTEL_START = SE2(2.5 * ROOM_WIDTH, _CORRIDOR + 2.6, 0.0)
"""In the third room, in front of its door: a turn and two metres decide which room it is."""


def hotel() -> OccupancyGrid:
    """Draw four rooms of one plan, 5 x 4.6 m each, north of a corridor, at 5 cm.

    From deep inside no scan distinguishes the rooms. The corridor looks different in front of each,
    so a robot that drives towards the door finds out. The south-west corner of the floor is the
    origin of the map frame.
    """
    plan = Drawing(ROOMS * ROOM_WIDTH, _CORRIDOR + _DEPTH, RESOLUTION, MARGIN)
    plan.room(0.0, 0.0, ROOMS * ROOM_WIDTH, _CORRIDOR)
    for i in range(ROOMS):
        west, south = i * ROOM_WIDTH, _CORRIDOR
        plan.room(west, south, west + ROOM_WIDTH, south + _DEPTH)
        plan.door(west + ROOM_WIDTH / 2, south, _DOOR)
        plan.solid(west + 0.1, south + 2.6, west + 1.6, south + 4.5)  # bed
        plan.solid(west + 4.2, south + 0.1, west + 4.9, south + 1.0)  # wardrobe
        plan.table(west + 3.6, south + 3.2, west + 4.8, south + 4.2)
    # Where no ray from deep inside a room arrives.
    plan.solid(0.8, 0.1, 1.5, 0.6)  # linen
    plan.solid(8.9, 0.1, 9.9, 0.4)  # bench
    plan.solid(10.4, 0.1, 10.7, 0.9)  # pillar
    plan.solid(18.8, 0.1, 19.6, 1.0)  # lift
    return plan.grid()
