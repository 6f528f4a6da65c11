"""One floor of an office, drawn."""

from __future__ import annotations

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.worlds.drawing import MARGIN, RESOLUTION, Drawing


def office() -> OccupancyGrid:
    """Draw one floor of an office, 40 x 25 m at 5 cm, no two rooms of which are alike.

    Returns
    -------
    OccupancyGrid
        The map; its frame has the floor's south-west corner at (0, 0).
    """
    plan = Drawing(40.0, 25.0, RESOLUTION, MARGIN)
    _rooms(plan)
    _doors(plan)
    _furniture(plan)
    return plan.grid()


def _rooms(plan: Drawing) -> None:
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


def _doors(plan: Drawing) -> None:
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


def _furniture(plan: Drawing) -> None:
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
