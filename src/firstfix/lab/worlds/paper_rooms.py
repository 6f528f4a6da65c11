"""Rooms like those in which the paper tried its robot, drawn: nearly symmetric."""

from __future__ import annotations

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.worlds.drawing import HALF_WALL, MARGIN, RESOLUTION, Drawing


def laboratory() -> OccupancyGrid:
    """Draw a laboratory of 12 x 8 m at 5 cm that looks nearly the same when turned by 180 degrees.

    Benches and doors have a double on the other side, as in the paper, whose filter confused the
    lower right of its laboratory with the upper left (Fig. 4 to 9). One cupboard has no double. The
    south-west corner is the origin of the map frame.
    """
    width, height = 12.0, 8.0
    plan = Drawing(width, height, RESOLUTION, MARGIN)
    plan.room(0.0, 0.0, width, height)
    for west, south, east, north in (
        (0.1, 5.6, 0.9, 7.9),  # bench
        (3.0, 7.2, 6.6, 7.9),  # bench
        (3.2, 3.0, 4.0, 5.0),  # island
        (1.6, 0.1, 2.2, 0.5),  # locker
    ):
        plan.solid(west, south, east, north)
        plan.solid(width - east, height - north, width - west, height - south)
    plan.free(0.0, 1.9, HALF_WALL, 2.8)  # doors, closed, set back in the wall
    plan.free(width - HALF_WALL, height - 2.8, width, height - 1.9)
    plan.solid(9.6, 7.4, 10.4, 7.9)  # the cupboard
    return plan.grid()


def two_corridors() -> OccupancyGrid:
    """Draw two corridors of 20 x 2 m, left and right of a block, joined at their ends.

    Turned by 180 degrees one looks like the other except for one door. In the paper's last picture
    the robot is found in the right one (Fig. 16). The south-west corner is the origin of the map
    frame.
    """
    width, height, way = 12.0, 20.0, 2.0
    plan = Drawing(width, height, RESOLUTION, MARGIN)
    plan.room(0.0, 0.0, width, height)
    plan.solid(way, way, width - way, height - way)
    for y in (4.0, 7.5, 12.0, 16.5):  # doors, closed, set back in the wall
        plan.free(way, y, way + 0.2, y + 0.9)
        plan.free(width - way - 0.2, height - y - 0.9, width - way, height - y)
    plan.free(width - way - 0.2, 10.0, width - way, 10.9)  # the one more
    for x, y in ((0.1, 9.0), (width - 0.4, height - 9.8)):  # cabinets
        plan.solid(x, y, x + 0.3, y + 0.8)
    return plan.grid()
