"""A warehouse whose aisles repeat, drawn."""

from __future__ import annotations

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.worlds.drawing import MARGIN, RESOLUTION, Drawing

AISLES = 8
AISLE_PITCH = 3.2

_RACK = 1.2  # two shelves back to back, m
_SOUTH, _NORTH = 3.0, 17.0


def warehouse() -> OccupancyGrid:
    """Draw a hall of 30 x 20 m at 5 cm, with eight identical aisles between racks.

    Only the ends of the hall distinguish the aisles: an office in one corner, a gate, a pile. The
    south-west corner is the origin of the map frame.
    """
    plan = Drawing(30.0, 20.0, RESOLUTION, MARGIN)
    plan.room(0.0, 0.0, 30.0, 20.0)
    for i in range(AISLES + 1):
        x = 1.6 + i * AISLE_PITCH
        for south, north in ((_SOUTH, 9.0), (11.0, _NORTH)):  # a way across in the middle
            plan.solid(x, south, x + _RACK, north)
    plan.room(25.4, 17.6, 30.0, 20.0)
    plan.door(26.2, 17.6, width=1.0)
    plan.solid(4.0, 0.1, 8.0, 0.4)  # a gate that stands proud of the wall
    plan.solid(0.1, 18.6, 1.5, 19.9)  # pallets
    plan.solid(20.0, 0.1, 21.2, 1.0)
    return plan.grid()
