"""A small flat with its furniture, drawn."""

from __future__ import annotations

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.worlds.drawing import MARGIN, RESOLUTION, Drawing


def house() -> OccupancyGrid:
    """Draw a flat of 11 x 8.4 m at 5 cm: hall, living room, kitchen, bath and two bedrooms.

    Returns
    -------
    OccupancyGrid
        The map; its frame has the flat's south-west corner at (0, 0).
    """
    plan = Drawing(11.0, 8.4, RESOLUTION, MARGIN)
    _rooms(plan)
    _living_room_and_kitchen(plan)
    _bedrooms_and_bath(plan)
    return plan.grid()


def _rooms(plan: Drawing) -> None:
    plan.room(0.0, 0.0, 5.4, 4.6)  # living room
    plan.room(5.4, 0.0, 8.4, 3.4)  # kitchen
    plan.room(8.4, 0.0, 11.0, 3.4)  # bath
    plan.room(5.4, 3.4, 11.0, 4.9)  # hall
    plan.room(0.0, 4.6, 4.4, 8.4)  # bedroom
    plan.room(5.4, 4.9, 11.0, 8.4)  # study
    plan.room(4.4, 4.6, 5.4, 8.4)  # store room, walled up
    plan.solid(4.5, 4.7, 5.3, 8.3)
    for x, y in ((5.4, 4.1), (6.3, 3.4), (9.6, 3.4), (8.0, 4.9), (1.2, 4.6)):
        plan.door(x, y, width=0.85)


def _living_room_and_kitchen(plan: Drawing) -> None:
    plan.solid(0.1, 0.6, 1.0, 2.8)  # sofa
    plan.solid(1.7, 1.3, 2.3, 2.1)  # low table
    plan.solid(3.9, 0.1, 5.3, 0.5)  # television
    plan.table(3.0, 2.2, 4.4, 3.0)
    for x in (3.2, 3.9):  # chairs
        plan.table(x, 1.7, x + 0.35, 2.05)
    plan.solid(2.6, 4.2, 4.3, 4.5)  # books
    plan.solid(5.5, 0.1, 8.3, 0.7)  # worktop
    plan.solid(7.7, 0.7, 8.3, 2.2)


def _bedrooms_and_bath(plan: Drawing) -> None:
    plan.solid(10.2, 0.1, 10.9, 1.8)  # tub
    plan.solid(8.5, 0.3, 9.1, 0.7)  # toilet
    plan.solid(8.5, 1.6, 8.9, 2.2)
    plan.solid(0.1, 5.6, 2.1, 7.2)  # bed
    plan.solid(2.4, 7.8, 4.3, 8.3)  # wardrobe
    plan.solid(0.1, 7.7, 0.5, 8.1)
    plan.table(9.2, 7.2, 10.8, 8.0)
    plan.solid(5.5, 6.0, 5.9, 8.3)  # books
    plan.solid(7.2, 7.9, 8.4, 8.3)
    plan.solid(10.5, 5.0, 10.9, 6.0)
