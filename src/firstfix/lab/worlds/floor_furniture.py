"""Furniture, pillars and stairs of a random floor, when it was mapped and later."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from firstfix.lab.worlds.drawing import RESOLUTION
from firstfix.lab.worlds.floor_plan import FloorPlan, Rectangle, Space, Use

# Chance that a piece was there when the map was made and is gone now, and the reverse.
_REMOVED, _ADDED = 0.2, 0.25

_LEG = 2  # cells


@dataclass(frozen=True, slots=True)
class Piece:
    """A solid box.

    Parameters
    ----------
    cells : Rectangle
        Where it stands.
    in_map, in_world : bool
        Whether the map has it, and whether it is there when scans are taken.
    """

    cells: Rectangle
    in_map: bool
    in_world: bool


def furnish(plan: FloorPlan, rng: np.random.Generator) -> list[Piece]:
    """Furnish a floor.

    Parameters
    ----------
    plan : FloorPlan
        The floor.
    rng : numpy.random.Generator
        Source of all decisions.

    Returns
    -------
    list of Piece
        In the order of the spaces.
    """
    pieces = []
    for space in plan.spaces:
        fixed = _fixed(space, rng)
        pieces += [Piece(cells, in_map=True, in_world=True) for cells in fixed]
        for group in _movable(space, rng):
            chance = rng.random()
            in_map, in_world = chance >= _ADDED, not _ADDED <= chance < _ADDED + _REMOVED
            pieces += [Piece(cells, in_map, in_world) for cells in group]
    return pieces


def _fixed(space: Space, rng: np.random.Generator) -> Iterator[Rectangle]:
    """Yield pillars, racks and stairs."""
    room = space.inside
    if space.use is Use.STAIRS:
        west = round(room.width * 0.42)
        yield Rectangle(room.west + west, room.south + 24, room.east - west, room.north)
        yield Rectangle(room.west, room.south + room.height // 2, room.west + west, room.north)
    elif space.use is Use.STORE:
        yield from _racks(room, rng)
    elif space.use is Use.HALL and rng.random() < 0.8:
        pitch = [_cells(rng.uniform(4.5, 9.0)) for _ in range(2)]
        side = _cells(rng.uniform(0.3, 0.7))
        for x in range(room.west + pitch[0] // 2, room.east - side, pitch[0]):
            for y in range(room.south + pitch[1] // 2, room.north - side, pitch[1]):
                yield Rectangle(x, y, x + side, y + side)
    elif space.use is Use.CORRIDOR:  # pipes and cupboards in the wall
        for _ in range(int(rng.poisson(max(room.width, room.height) * RESOLUTION / 12.0))):
            length, depth = _cells(rng.uniform(0.3, 1.8)), _cells(rng.uniform(0.1, 0.35))
            yield from _against_wall(room, length, depth, rng)


def _racks(room: Rectangle, rng: np.random.Generator) -> Iterator[Rectangle]:
    aisle, depth = _cells(rng.uniform(2.2, 3.6)), _cells(rng.uniform(0.8, 1.3))
    bay, gap = _cells(rng.uniform(4.0, 12.0)), _cells(rng.uniform(1.5, 3.0))
    along_x = room.width > room.height
    ends = (room.width, room.height) if along_x else (room.height, room.width)
    for a in range(aisle, ends[1] - depth - aisle // 2, aisle + depth):
        for b in range(gap, ends[0] - gap, bay + gap):
            if rng.random() < 0.08:
                continue
            length = min(b + bay, ends[0] - gap) - b
            if along_x:
                x, y, w, h = room.west + b, room.south + a, length, depth
            else:
                x, y, w, h = room.west + a, room.south + b, depth, length
            yield Rectangle(x, y, x + w, y + h)


def _movable(space: Space, rng: np.random.Generator) -> Iterator[list[Rectangle]]:
    """Yield shelves along walls, desks and boxes; each group moves together."""
    if space.use in (Use.COURT, Use.STAIRS):
        return
    room = space.inside
    if min(room.width, room.height) < _cells(1.8):
        return
    area, round_m = room.width * room.height * RESOLUTION**2, 2 * (room.width + room.height)
    busy = 0.2 if space.use is Use.CORRIDOR else rng.uniform(0.3, 1.2)
    for _ in range(int(rng.poisson(busy * round_m * RESOLUTION / 9.0))):
        length, depth = _cells(rng.uniform(0.6, 2.8)), _cells(rng.uniform(0.3, 0.7))
        yield list(_against_wall(room, length, depth, rng))
    if space.use is Use.CORRIDOR:
        return
    for _ in range(int(rng.poisson(busy * min(area, 400.0) / 14.0))):
        w, h = (_cells(rng.uniform(0.7, 1.9)) for _ in range(2))
        if w + 16 >= room.width or h + 16 >= room.height:
            continue
        x = int(rng.integers(room.west + 8, room.east - w - 8))
        y = int(rng.integers(room.south + 8, room.north - h - 8))
        if rng.random() < 0.3:
            yield [Rectangle(x, y, x + w, y + min(h, 14))]
        else:  # a LIDAR sees the legs of a table only
            yield [
                Rectangle(a, b, a + _LEG, b + _LEG)
                for a in (x, x + w - _LEG)
                for b in (y, y + h - _LEG)
            ]


def _against_wall(
    room: Rectangle, length: int, depth: int, rng: np.random.Generator
) -> Iterator[Rectangle]:
    wall = int(rng.integers(4))
    side = room.width if wall < 2 else room.height
    if length >= side or 3 * depth > min(room.width, room.height):
        return
    at = int(rng.integers(side - length))
    x, y = room.west + at, room.south + at
    yield (
        Rectangle(x, room.south, x + length, room.south + depth),
        Rectangle(x, room.north - depth, x + length, room.north),
        Rectangle(room.west, y, room.west + depth, y + length),
        Rectangle(room.east - depth, y, room.east, y + length),
    )[wall]


def _cells(metres: float) -> int:
    return round(metres / RESOLUTION)
