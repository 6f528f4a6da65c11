"""Ways through a building for a robot that keeps away from walls where it can."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.wavefront import walking_costs, way_back

COMFORT_M = 0.45
"""Room around the robot's middle from which on more is not better, m."""

# Doors are some 0.8 m wide; cells of this side leave two or three in them.
_CELL_M = 0.1
# A step next to a wall costs as much as a detour this many times as long.
_FEAR = 10.0
# A robot between table legs begins at the nearest suitable place within this distance.
_TO_BEGINNING_M = 1.0


class Planner:
    """Plans paths on one floor, on cells of about 0.1 m.

    Parameters
    ----------
    floor : Floor
        Walls and furniture.
    tightest_m : float
        Least room around the robot's centre, m: its radius and a margin.
    """

    def __init__(self, floor: Floor, tightest_m: float) -> None:
        self._floor = floor
        self._tightest_m = tightest_m
        self._factor = max(1, round(_CELL_M / floor.grid.resolution))
        self._from: tuple[int, int] | None = None
        self._costs: NDArray[np.float32] = np.empty((0, 0), np.float32)

    @cached_property
    def weights(self) -> NDArray[np.float32]:
        """Cost of a step into each coarse cell; inf where the robot does not fit."""
        n, room = self._factor, self._floor.room
        rows, columns = (max(1, math.ceil(side / n)) for side in room.shape)
        whole = np.zeros((rows * n, columns * n), np.float32)
        whole[: room.shape[0], : room.shape[1]] = room
        least = whole.reshape(rows, n, columns, n).min(axis=(1, 3))
        tight = np.clip((COMFORT_M - least) / (COMFORT_M - self._tightest_m), 0.0, 1.0)
        fits = least >= self._tightest_m
        weights: NDArray[np.float32] = np.where(fits, 1.0 + _FEAR * tight**2, np.inf)
        return weights.astype(np.float32)

    def path(self, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Plan a path between two places in the map frame; headings are ignored.

        Returns
        -------
        ndarray, shape (n, 2)
            Corners of the path in the map frame, m, both ends included.

        Raises
        ------
        InputError
            If there is no path, or the robot does not fit at an end.
        """
        costs = self._costs_from(start)
        row, column = self._cell_near(goal)
        if not math.isfinite(costs[row, column]):
            raise InputError(
                f"No path leads to ({goal.x:.2f}, {goal.y:.2f}) m: it is behind walls, or the way "
                "is too narrow. Pick a goal in the same part of the map."
            )
        cells = way_back(costs, self.weights, row, column)[::-1, ::-1]
        way = self._floor.grid.to_map((cells.astype(np.float64) + 0.5) * self._factor)
        way = np.concatenate([[[start.x, start.y]], way, [[goal.x, goal.y]]])
        return self._shortened(way)

    def random_goal(self, start: SE2, rng: np.random.Generator) -> SE2:
        """Draw a reachable pose in the map frame, uniformly over the places with comfortable room.

        If no place has comfortable room, any reachable place is drawn.
        """
        reached = np.isfinite(self._costs_from(start))
        comfortable = reached & (self.weights <= 1.0)
        places = np.flatnonzero(comfortable if comfortable.any() else reached)
        row, column = divmod(int(rng.choice(places)), self.weights.shape[1])
        x, y = self._floor.grid.to_map((np.array([column, row]) + 0.5) * self._factor)
        return SE2(float(x), float(y), float(rng.uniform(-math.pi, math.pi)))

    def _costs_from(self, start: SE2) -> NDArray[np.float32]:
        cell = self._cell_near(start)
        if cell != self._from:
            self._from, self._costs = cell, walking_costs(self.weights, *cell)
        return self._costs

    def _cell_near(self, place: SE2) -> tuple[int, int]:
        """Return row and column of the nearest coarse cell where the robot fits."""
        grid, weights = self._floor.grid, self.weights
        column, row = grid.to_cells(np.array([place.x, place.y])) / self._factor - 0.5
        reach = math.ceil(_TO_BEGINNING_M / (self._factor * grid.resolution))
        low_row, low_column = max(0, round(row) - reach), max(0, round(column) - reach)
        near = weights[
            low_row : max(0, round(row) + reach + 1), low_column : max(0, round(column) + reach + 1)
        ]
        rows, columns = np.nonzero(np.isfinite(near))
        if len(rows) == 0:
            raise InputError(
                f"There is no room for the robot within {_TO_BEGINNING_M:g} m of "
                f"({place.x:.2f}, {place.y:.2f}) m. Pick a place in free space."
            )
        nearest = np.argmin(np.hypot(rows + low_row - row, columns + low_column - column))
        return int(rows[nearest]) + low_row, int(columns[nearest]) + low_column

    def _shortened(self, way: NDArray[np.float64]) -> NDArray[np.float64]:
        """Leave out corners where the straight line has as much room as the path."""
        corners = way.tolist()
        room = np.array([min(self._floor.room_at(x, y), COMFORT_M) for x, y in corners])
        kept = [0]
        for i in range(2, len(way)):
            least = float(room[kept[-1] : i + 1].min())
            if not self._floor.has_room(corners[kept[-1]], corners[i], least):
                kept.append(i - 1)
        kept.append(len(way) - 1)
        return way[kept]
