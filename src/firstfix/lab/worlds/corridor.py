"""A long corridor with the same door again and again, drawn."""

from __future__ import annotations

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.worlds.drawing import MARGIN, RESOLUTION, Drawing

DOOR_PITCH = 4.0

_LENGTH, _WIDTH = 60.0, 2.4
_NICHE = 0.15  # depth of a closed door in its wall, m
_DOOR = 0.9


def corridor() -> OccupancyGrid:
    """Draw a corridor of 60 x 2.4 m at 5 cm with a closed door on both sides every 4 m.

    From its middle no scan distinguishes the doors. A cupboard and a pillar mark its ends. The
    south-west corner of the floor is the origin of the map frame.
    """
    plan = Drawing(_LENGTH, _WIDTH, RESOLUTION, MARGIN)
    wall = 0.4  # thick enough for niches
    plan.solid(-wall, -wall, _LENGTH + wall, _WIDTH + wall)
    plan.free(0.0, 0.0, _LENGTH, _WIDTH)
    for i in range(int(_LENGTH / DOOR_PITCH)):
        x = DOOR_PITCH * (i + 0.5) - _DOOR / 2
        plan.free(x, -_NICHE, x + _DOOR, 0.0)
        plan.free(x, _WIDTH, x + _DOOR, _WIDTH + _NICHE)
    plan.solid(0.0, 0.0, 0.5, 0.9)  # cupboard
    plan.solid(_LENGTH - 0.6, _WIDTH - 0.3, _LENGTH - 0.3, _WIDTH)  # pillar
    return plan.grid()
