"""Floor plans, drawn in metres, rectangle over rectangle."""

from __future__ import annotations

import numpy as np

from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.se2 import SE2

RESOLUTION = 0.05  # of the built-in buildings, m
MARGIN = 1.0  # unknown space behind the outer walls
HALF_WALL = 0.1
LEG = 0.1  # a LIDAR sees the legs of a table only


class Drawing:
    """A plan to draw on; every cell is unknown at first.

    Parameters
    ----------
    width, height : float
        Size of the plan along x and y, m.
    resolution : float
        Side of a cell, m.
    margin : float
        Unknown space on every side, m.
    """

    def __init__(self, width: float, height: float, resolution: float, margin: float) -> None:
        rows, columns = (round((side + 2 * margin) / resolution) for side in (height, width))
        self._cells = np.full((rows, columns), UNKNOWN, np.int8)
        self._resolution = resolution
        self._margin = margin

    def free(self, west: float, south: float, east: float, north: float) -> None:
        """Paint a rectangle free; sides in m."""
        self._paint(west, south, east, north, FREE)

    def solid(self, west: float, south: float, east: float, north: float) -> None:
        """Paint a rectangle occupied; sides in m."""
        self._paint(west, south, east, north, OCCUPIED)

    def room(self, west: float, south: float, east: float, north: float) -> None:
        """Draw an empty room with walls round it; sides are the middles of the walls, m.

        Rooms drawn side by side share the wall between them.
        """
        wall = HALF_WALL
        self.solid(west - wall, south - wall, east + wall, north + wall)
        self.free(west + wall, south + wall, east - wall, north - wall)

    def door(self, x: float, y: float, width: float = 0.9) -> None:
        """Open the wall at (x, y), whichever way it runs; m."""
        half = width / 2
        self.free(x - half, y - HALF_WALL, x + half, y + HALF_WALL)
        self.free(x - HALF_WALL, y - half, x + HALF_WALL, y + half)

    def table(self, west: float, south: float, east: float, north: float) -> None:
        """Draw a table as a LIDAR meets it: four legs; sides in m."""
        for x in (west, east - LEG):
            for y in (south, north - LEG):
                self.solid(x, y, x + LEG, y + LEG)

    def grid(self) -> OccupancyGrid:
        """Return the map drawn so far; (0, 0) of the plan is (0, 0) of the map frame."""
        corner = SE2(-self._margin, -self._margin, 0.0)
        return OccupancyGrid(self._cells, self._resolution, corner)

    def _paint(self, west: float, south: float, east: float, north: float, value: int) -> None:
        left, bottom, right, top = (
            round((side + self._margin) / self._resolution) for side in (west, south, east, north)
        )
        self._cells[bottom:top, left:right] = value
