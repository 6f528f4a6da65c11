"""Random floors by seed: the map of each, and the true world, which differs a little."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.lab.worlds.drawing import RESOLUTION
from firstfix.lab.worlds.floor_furniture import Piece, furnish
from firstfix.lab.worlds.floor_plan import Door, FloorPlan, Rectangle, Space, Use, draw_plan

AREA_M2 = (500.0, 20_000.0)
"""Smallest and largest floor, m²; areas between are equally likely."""

_MARGIN = 20  # unknown cells behind the outer walls

# Share of floors whose walls do not run along the axes of their map.
_TURNED = 0.35

# Share of rooms that were locked when the map was made, and of doors that are as they were then.
_UNMAPPED, _DOOR_AS_MAPPED = 0.05, 0.8

# Chance that a side of a space is drawn one cell off, to either side.
_SHIFTED = 0.15

# Streams of random numbers of one seed.
_PLAN, _FURNITURE, _CHANGES, _FRAME = range(4)


@dataclass(frozen=True, slots=True)
class RandomFloor:
    """A floor that its seed determines.

    Parameters
    ----------
    seed : int
        At least 0. Different seeds give different floors.
    area_m2 : float or None
        Area within the outer walls, m²; None draws it from `AREA_M2`.
    furnished : int
        Floors of one seed have the same walls. Each number gives other furniture, rooms that were
        locked, and changes since.

    Raises
    ------
    InputError
        If the seed is negative or the area is below 100 m².
    """

    seed: int
    area_m2: float | None = None
    furnished: int = 0

    def __post_init__(self) -> None:
        if self.seed < 0 or (self.area_m2 is not None and not self.area_m2 >= 100.0):
            raise InputError(
                expected="a seed of at least 0 and an area of at least 100 m²",
                received=f"seed {self.seed}, area {self.area_m2}",
                remedy="choose another seed or area",
            )

    def plan(self) -> FloorPlan:
        """Draw its walls and doors."""
        rng = self._rng(_PLAN)
        drawn = float(rng.uniform(*AREA_M2))
        return draw_plan(drawn if self.area_m2 is None else self.area_m2, rng)

    def map(self) -> OccupancyGrid:
        """Draw its map: walls, doors and furniture as they were when it was made.

        Rooms that were locked then are unknown.
        """
        plan = self.plan()
        unmapped = self._rng(_CHANGES).random(len(plan.spaces)) < _UNMAPPED
        cells = _drawn(plan, furnish(plan, self._rng(_FURNITURE)), lambda piece: piece.in_map)
        for space, locked in zip(plan.spaces, unmapped, strict=True):
            if locked and space.use is Use.ROOM:
                _paint(cells, space.inside, OCCUPIED)  # its doors are shut
                _paint(cells, space.inside.grown(-1), UNKNOWN)
        return self._turned(cells)

    def world(self) -> OccupancyGrid:
        """Draw the floor as it is: some walls 5 cm off, other doors open, furniture moved.

        The frame is that of the map.
        """
        plan = self.plan()
        rng = self._rng(_CHANGES)
        rng.random(len(plan.spaces))  # which rooms are not in the map
        changed = replace(
            plan,
            spaces=tuple(_shifted(space, rng) for space in plan.spaces),
            doors=tuple(_changed(door, rng) for door in plan.doors),
        )
        pieces = furnish(plan, self._rng(_FURNITURE))
        return self._turned(_drawn(changed, pieces, lambda piece: piece.in_world))

    def _rng(self, stream: int) -> np.random.Generator:
        if self.furnished and stream in (_FURNITURE, _CHANGES):
            return np.random.default_rng([self.seed, stream, self.furnished])
        return np.random.default_rng([self.seed, stream])

    def _turned(self, cells: NDArray[np.int8]) -> OccupancyGrid:
        rng = self._rng(_FRAME)
        turned, yaw = rng.random() < _TURNED, float(rng.uniform(-math.pi / 4, math.pi / 4))
        x, y = rng.uniform(-50.0, 0.0, 2).round(1).tolist()
        return OccupancyGrid(_rotated(cells, yaw) if turned else cells, RESOLUTION, SE2(x, y, 0.0))


def write_site(folder: Path, floors: Sequence[RandomFloor], on_done: Callable[[int], None]) -> Path:
    """Write the maps of floors as a site: one folder of map_server maps.

    Parameters
    ----------
    folder : Path
        Where to write; created if missing. Maps that are there already are kept.
    floors : sequence of RandomFloor
        The floors, of different seeds. Floor ``n`` is ``floor_000n.yaml``.
    on_done : callable
        Takes the number of maps written so far.

    Returns
    -------
    Path
        The folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for i, floor in enumerate(floors):
        path = folder / f"{floor_id(floor)}.yaml"
        if not path.exists():
            save_map(floor.map(), path)
        on_done(i + 1)
    return folder


def floor_id(floor: RandomFloor) -> str:
    """Return the name of a floor's map."""
    return f"floor_{floor.seed:05d}"


def _drawn(
    plan: FloorPlan, pieces: Sequence[Piece], shown: Callable[[Piece], bool]
) -> NDArray[np.int8]:
    height, width = plan.outline.height + 2 * _MARGIN, plan.outline.width + 2 * _MARGIN
    cells = np.full((height, width), UNKNOWN, np.int8)
    _paint(cells, plan.outline.grown(4), OCCUPIED)
    for space in plan.spaces:
        _paint(cells, space.inside, UNKNOWN if space.use is Use.COURT else FREE)
    for piece in pieces:
        if shown(piece):
            _paint(cells, piece.cells, OCCUPIED)
    for door in plan.doors:
        _paint(cells, door.opening(14), FREE)
        if not door.is_open:
            _paint(cells, door.opening(1), OCCUPIED)
    return cells


def _paint(cells: NDArray[np.int8], where: Rectangle, value: int) -> None:
    m = _MARGIN
    cells[where.south + m : where.north + m, where.west + m : where.east + m] = value


def _shifted(space: Space, rng: np.random.Generator) -> Space:
    """Move the sides of a space: all one cell inwards, or two of them one cell outwards."""
    # Two neighbours cannot both move outwards into the wall between them.
    west, south = (int(rng.choice(3, p=[_SHIFTED, 1 - 2 * _SHIFTED, _SHIFTED])) - 1 for _ in "xy")
    east, north = (int(rng.random() < _SHIFTED) for _ in "xy")
    o = space.outline
    return replace(
        space, outline=Rectangle(o.west + west, o.south + south, o.east - east, o.north - north)
    )


def _changed(door: Door, rng: np.random.Generator) -> Door:
    as_mapped = bool(rng.random() < _DOOR_AS_MAPPED)
    return replace(door, is_open=door.is_open if as_mapped else not door.is_open)


def _rotated(cells: NDArray[np.int8], yaw: float) -> NDArray[np.int8]:
    """Turn cells about their middle, to the nearest cell; unknown beyond them."""
    height, width = cells.shape
    cos, sin = math.cos(yaw), math.sin(yaw)
    rows = math.ceil(abs(width * sin) + abs(height * cos))
    columns = math.ceil(abs(width * cos) + abs(height * sin))
    turned = np.full((rows, columns), UNKNOWN, np.int8)
    x = np.arange(columns) + 0.5 - columns / 2
    for row in range(rows):
        y = row + 0.5 - rows / 2
        from_x = np.floor(cos * x + sin * y + width / 2).astype(np.int64)
        from_y = np.floor(-sin * x + cos * y + height / 2).astype(np.int64)
        inside = (from_x >= 0) & (from_x < width) & (from_y >= 0) & (from_y < height)
        turned[row, inside] = cells[from_y[inside], from_x[inside]]
    return turned
