"""A building with one lift: floors by seed, of which some are alike, as a site."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import FREE, OCCUPIED, OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.distance import euclidean_distance
from firstfix.io.maps.map_server import save_map
from firstfix.lab.worlds.floors import RandomFloor

LIFT = "lift"
"""Name of the lift."""

# The cabin, inside, and its door, m.
_CABIN_M = 1.8
_DOOR_M = 1.0
_WALL_CELLS = 3

# Least free space around the cabin's middle, and how far the robot drives out of it, m.
_ROOM_M = 2.6
EXIT_M = 1.8

# Pieces that tell a floor from its twin: number, and sides in cells; and those that were moved.
_PIECES = (8, 20)
_PIECE_CELLS = (8, 24)
_MOVED = 0.2


class Likeness(Enum):
    """How a floor is like another one of its building."""

    DISTINCT = "distinct"
    ALIKE = "alike"
    TWIN = "twin"


@dataclass(frozen=True)
class TowerFloor:
    """One floor of a tower.

    Parameters
    ----------
    plan : RandomFloor
        What it is drawn from.
    level : int
        Number of the floor. Floors with one plan differ in some furniture.
    likeness : Likeness
        An alike floor has the walls of another one and furniture of its own, as floors of real
        buildings; a twin has that furniture, too, except for some pieces.
    """

    plan: RandomFloor
    level: int
    likeness: Likeness = Likeness.DISTINCT

    @property
    def map_id(self) -> str:
        """The name of its map."""
        return f"level_{self.level:02d}"

    @cached_property
    def map(self) -> OccupancyGrid:
        """The floor as it was mapped, with the door of the lift open."""
        return self._with_lift(self._plan_map, shown_from=0.0, is_open=True)

    @cached_property
    def open_world(self) -> OccupancyGrid:
        """The floor as it is, with the lift there."""
        return self._with_lift(self.plan.world(), shown_from=_MOVED, is_open=True)

    @cached_property
    def closed_world(self) -> OccupancyGrid:
        """The floor as it is, with the door of the lift closed."""
        return self._with_lift(self.plan.world(), shown_from=_MOVED, is_open=False)

    @cached_property
    def T_map_lift(self) -> SE2:
        """Pose of a robot in the middle of the cabin that looks out of the door."""
        grid = self._plan_map
        row, column, yaw = self._place
        x, y = grid.to_map(np.array([column + 0.5, row + 0.5]))
        return SE2(float(x), float(y), yaw)

    @property
    def _size(self) -> int:
        return round(_CABIN_M / self._plan_map.resolution / 2)

    @cached_property
    def _plan_map(self) -> OccupancyGrid:
        return self.plan.map()

    @cached_property
    def _place(self) -> tuple[int, int, float]:
        """Return row and column of the cabin, and where its door leads: +x or -x.

        Raises
        ------
        InputError
            If no room of the floor is large enough.
        """
        # The lift stands at one place on all floors with these walls.
        first = replace(self.plan, furnished=0)
        grid, world = first.map(), first.world()
        free = (grid.cells == FREE) & (world.cells == FREE)
        room = euclidean_distance(np.pad(~free, 1, constant_values=True))[1:-1, 1:-1]
        fits = np.argwhere(room * grid.resolution >= _ROOM_M)
        if len(fits) == 0:
            raise InputError(
                f"There is no room for a lift on floor {self.plan.seed}. Take another."
            )
        rng = np.random.default_rng([self.plan.seed, 10])
        row, column = fits[int(rng.integers(len(fits)))].tolist()
        return row, column, 0.0 if rng.random() < 0.5 else math.pi

    def _with_lift(self, grid: OccupancyGrid, *, shown_from: float, is_open: bool) -> OccupancyGrid:
        cells = grid.cells.copy()
        self._furnish(cells, shown_from)
        row, column, yaw = self._place
        half, wall = self._size, _WALL_CELLS
        # No furniture before the lift.
        lobby = round(_ROOM_M / grid.resolution)
        y, x = np.ogrid[-lobby : lobby + 1, -lobby : lobby + 1]
        around = cells[row - lobby : row + lobby + 1, column - lobby : column + lobby + 1]
        around[y**2 + x**2 < lobby**2] = FREE
        outer = (
            slice(row - half - wall, row + half + wall),
            slice(column - half - wall, column + half + wall),
        )
        cells[outer] = OCCUPIED
        cells[row - half : row + half, column - half : column + half] = FREE
        if is_open:
            door = round(_DOOR_M / grid.resolution / 2)
            first = column + half if yaw == 0.0 else column - half - wall
            cells[row - door : row + door, first : first + wall] = FREE
        return OccupancyGrid(cells, grid.resolution, grid.T_map_grid)

    def _furnish(self, cells: NDArray[np.int8], shown_from: float) -> None:
        """Add the pieces of this level in free space, apart from the lift."""
        rng = np.random.default_rng([self.plan.seed, 20 + self.level])
        free = np.argwhere(self._plan_map.cells == FREE)
        row, column, _ = self._place
        for _ in range(int(rng.integers(*_PIECES))):
            y, x = free[int(rng.integers(len(free)))].tolist()
            height, width = rng.integers(*_PIECE_CELLS, size=2).tolist()
            away = max(abs(y + height // 2 - row), abs(x + width // 2 - column))
            if rng.random() >= shown_from and away > 4 * self._size:
                cells[y : y + height, x : x + width] = OCCUPIED


def tower(seed: int, levels: int, area_m2: float) -> list[TowerFloor]:
    """Draw a building: floors 0 and 1 are twins, 2 and 3 are alike, all others differ.

    Parameters
    ----------
    seed : int
        Of the building.
    levels : int
        Number of floors.
    area_m2 : float
        Of each.
    """
    plans: list[RandomFloor] = []
    candidate = 1000 * seed
    while len(plans) < levels:
        plan = RandomFloor(candidate, area_m2)
        candidate += 1
        try:
            _ = TowerFloor(plan, 0).T_map_lift
        except InputError:
            continue
        plans.append(plan)
    return [_floor_at(level, plans[level // 2 if level < 4 else level]) for level in range(levels)]


def _floor_at(level: int, plan: RandomFloor) -> TowerFloor:
    if level in (2, 3):
        return TowerFloor(replace(plan, furnished=level), level, Likeness.ALIKE)
    return TowerFloor(plan, level, Likeness.TWIN if level < 2 else Likeness.DISTINCT)


def write_tower(folder: Path, floors: list[TowerFloor]) -> Path:
    """Write the maps of a building and its ``site.yaml``; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["maps:"]
    ends = []
    for floor in floors:
        save_map(floor.map, folder / f"{floor.map_id}.yaml")
        lines.append(f"  {floor.map_id}: {{map: {floor.map_id}.yaml, floor: {floor.level}}}")
        x, y, yaw = floor.T_map_lift
        ends.append(f"{{map: {floor.map_id}, pose: [{x:.3f}, {y:.3f}, {yaw:.4f}]}}")
    lines += ["transitions:", f"  {LIFT}: {{kind: lift, ends: [{', '.join(ends)}]}}"]
    (folder / "site.yaml").write_text("\n".join(lines) + "\n")
    return folder
