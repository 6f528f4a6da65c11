"""A map made ready for a robot that moves on it: how far rays reach, how much room there is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.clearance import chessboard_clearance
from firstfix.fields.distance import euclidean_distance

_SAMPLE_M = 0.05  # along lines; nothing that stops a robot is much thinner


@dataclass(frozen=True, eq=False)
class Floor:
    """The simulated world: a grid with walls and furniture.

    Rays end at occupied cells. A robot keeps to free cells.
    """

    grid: OccupancyGrid

    @cached_property
    def clearance(self) -> NDArray[np.uint8]:
        """By how much rays can leap, shape (height, width), cells (`chessboard_clearance`)."""
        return chessboard_clearance(self.grid.occupied)

    @cached_property
    def room(self) -> NDArray[np.float32]:
        """Distance to what is not free, shape (height, width), m; 0 where no robot can stand."""
        # Beyond the border of the map nothing is known to be free.
        blocked = np.pad(~self.grid.seen_free, 1, constant_values=True)
        cells = euclidean_distance(blocked)[1:-1, 1:-1]
        # Centres are measured, but a wall begins half a cell before its centre.
        metres: NDArray[np.float32] = np.float32(self.grid.resolution) * (cells - np.float32(0.5))
        return np.maximum(metres, np.float32(0.0))

    @cached_property
    def T_grid_map(self) -> SE2:
        """Pose of the map frame against the grid's lower-left corner."""
        return self.grid.T_map_grid.inverse()

    def room_at(self, x: float, y: float) -> float:
        """Return the room around a point of the map frame (m), m; 0 outside the map."""
        T = self.T_grid_map
        c, s = math.cos(T.yaw), math.sin(T.yaw)
        column = math.floor((T.x + c * x - s * y) / self.grid.resolution)
        row = math.floor((T.y + s * x + c * y) / self.grid.resolution)
        if 0 <= column < self.grid.width and 0 <= row < self.grid.height:
            return float(self.room[row, column])
        return 0.0

    def has_room(self, a: tuple[float, float], b: tuple[float, float], least_m: float) -> bool:
        """Tell whether there is so much room (m) all along a straight line of the map frame."""
        count = max(2, math.ceil(math.hypot(b[0] - a[0], b[1] - a[1]) / _SAMPLE_M))
        points = np.linspace(a, b, count)
        columns, rows = np.floor(self.grid.to_cells(points)).astype(np.intp).T
        height, width = self.room.shape
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        return bool(inside.all() and (self.room[rows, columns] >= least_m).all())
