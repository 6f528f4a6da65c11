"""Random floors of buildings: rooms along corridors, with doors, as rectangles of whole cells.

A floor is cut by corridors into blocks, and each block into rooms. Every decision is random, so no
two floors are alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from firstfix.lab.worlds.drawing import RESOLUTION

HALF_WALL = 2
"""Half the thickness of a wall, cells."""

_WIDEST_DOOR = 40  # cells
_SIDES = ("west", "south", "east", "north")


class Use(Enum):
    """What a space is for: decides its furniture."""

    CORRIDOR = "corridor"
    ROOM = "room"
    HALL = "hall"
    STORE = "store"
    STAIRS = "stairs"
    COURT = "court"


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Cells ``west <= column < east``, ``south <= row < north``."""

    west: int
    south: int
    east: int
    north: int

    @property
    def width(self) -> int:
        """Columns."""
        return self.east - self.west

    @property
    def height(self) -> int:
        """Rows."""
        return self.north - self.south

    @property
    def area_m2(self) -> float:
        """Area, m²."""
        return self.width * self.height * RESOLUTION**2

    def grown(self, cells: int) -> Rectangle:
        """Return the rectangle with every side moved outwards."""
        return Rectangle(
            self.west - cells, self.south - cells, self.east + cells, self.north + cells
        )


@dataclass(frozen=True, slots=True)
class Space:
    """A corridor or a room.

    Parameters
    ----------
    outline : Rectangle
        To the middle of its walls.
    use : Use
        What it is for.
    open_sides : frozenset of str
        Sides along which a corridor runs.
    """

    outline: Rectangle
    use: Use
    open_sides: frozenset[str] = frozenset()

    @property
    def inside(self) -> Rectangle:
        """The cells between the walls."""
        return self.outline.grown(-HALF_WALL)


@dataclass(frozen=True, slots=True)
class Door:
    """An opening in a wall.

    Parameters
    ----------
    x, y : int
        Its middle, on the middle of the wall, cells.
    along_x : bool
        True if the wall runs along x.
    width : int
        Cells.
    is_open : bool
        False draws the door in its frame.
    """

    x: int
    y: int
    along_x: bool
    width: int
    is_open: bool

    def opening(self, depth: int) -> Rectangle:
        """Return the rectangle of the opening, ``depth`` cells to both sides of the wall."""
        half = self.width // 2
        if self.along_x:
            return Rectangle(self.x - half, self.y - depth, self.x + half, self.y + depth)
        return Rectangle(self.x - depth, self.y - half, self.x + depth, self.y + half)


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """All spaces and doors of a floor, in cells.

    Parameters
    ----------
    outline : Rectangle
        The outer walls.
    spaces : tuple of Space
        Corridors and rooms.
    doors : tuple of Door
        Between them.
    """

    outline: Rectangle
    spaces: tuple[Space, ...]
    doors: tuple[Door, ...]


@dataclass(frozen=True, slots=True)
class _Style:
    """The habits of one architect; lengths in m, areas in m²."""

    block: float  # longest side of a block between corridors
    room: float  # area of a usual room
    corridor: tuple[float, float]  # least and largest width
    hall: float  # share of blocks that are one hall
    store: float  # share of those with racks
    court: float  # share of blocks without floor
    doors_open: float


def draw_plan(area_m2: float, rng: np.random.Generator) -> FloorPlan:
    """Draw the plan of one floor.

    Parameters
    ----------
    area_m2 : float
        Area within the outer walls, m², at least 100.
    rng : numpy.random.Generator
        Source of all decisions.

    Returns
    -------
    FloorPlan
        The plan; its south-west corner is at (0, 0).
    """
    style = _random_style(rng)
    aspect = math.exp(rng.uniform(0.0, math.log(2.8)))
    long, short = math.sqrt(area_m2 * aspect), math.sqrt(area_m2 / aspect)
    if rng.random() < 0.5:
        long, short = short, long
    outline = Rectangle(0, 0, round(long / RESOLUTION), round(short / RESOLUTION))
    spaces, doors = _divided(outline, frozenset(), 0, style, rng)
    for space in spaces:
        doors += _doors_to_corridors(space, style, rng)
    return FloorPlan(outline, tuple(spaces), tuple(doors))


def _random_style(rng: np.random.Generator) -> _Style:
    narrow = rng.uniform(1.5, 2.6)
    return _Style(
        block=math.exp(rng.uniform(math.log(12.0), math.log(45.0))),
        room=math.exp(rng.uniform(math.log(12.0), math.log(70.0))),
        corridor=(narrow, narrow + rng.uniform(0.2, 1.6)),
        hall=rng.uniform(0.02, 0.35),
        store=rng.uniform(0.0, 1.0),
        court=rng.uniform(0.0, 0.12),
        doors_open=rng.uniform(0.4, 0.9),
    )


def _divided(
    block: Rectangle, corridors: frozenset[str], depth: int, style: _Style, rng: np.random.Generator
) -> tuple[list[Space], list[Door]]:
    """Cut a block by a corridor and go on with both parts, or fill it with rooms."""
    longest = style.block * rng.uniform(0.7, 1.4) / RESOLUTION
    width = round(rng.uniform(*style.corridor) * (1.3 if depth == 0 else 1.0) / RESOLUTION)
    # The main corridor runs along the building, the others across what is left.
    along_x = block.width > block.height
    if depth > 0 or rng.random() < 0.2:
        along_x = not along_x
    across = block.height if along_x else block.width
    if max(block.width, block.height) <= longest or across < width + 2 * round(3.0 / RESOLUTION):
        return _filled(block, corridors, style, rng)
    low, high = round(3.0 / RESOLUTION), across - width - round(3.0 / RESOLUTION)
    at = round(min(high, max(low, rng.normal(0.5, 0.12) * (across - width))))
    if along_x:
        middle = replace(block, south=block.south + at, north=block.south + at + width)
        parts = (replace(block, north=middle.south), replace(block, south=middle.north))
        facing, ends = ("north", "south"), ("west", "east")
    else:
        middle = replace(block, west=block.west + at, east=block.west + at + width)
        parts = (replace(block, east=middle.west), replace(block, west=middle.east))
        facing, ends = ("east", "west"), ("south", "north")
    spaces = [Space(middle, Use.CORRIDOR)]
    doors = [_mouth(middle, end, style, rng) for end in ends if end in corridors]
    for part, side in zip(parts, facing, strict=True):
        more_spaces, more_doors = _divided(part, corridors | {side}, depth + 1, style, rng)
        spaces += more_spaces
        doors += more_doors
    return spaces, doors


def _mouth(corridor: Rectangle, end: str, style: _Style, rng: np.random.Generator) -> Door:
    """Open a corridor towards the one that it meets, wide or by a door in a narrower frame."""
    across_x = end in ("south", "north")
    width = (corridor.width if across_x else corridor.height) - 2 * HALF_WALL
    is_open = True
    if rng.random() < 0.35:  # a fire door
        width = max(16, 2 * (width // 3))
        is_open = bool(rng.random() < style.doors_open)
    x, y = _middle_of_side(corridor, end)
    return Door(x, y, across_x, width - width % 2, is_open)


def _middle_of_side(outline: Rectangle, side: str) -> tuple[int, int]:
    x, y = (outline.west + outline.east) // 2, (outline.south + outline.north) // 2
    return {
        "west": (outline.west, y),
        "south": (x, outline.south),
        "east": (outline.east, y),
        "north": (x, outline.north),
    }[side]


def _filled(
    block: Rectangle, corridors: frozenset[str], style: _Style, rng: np.random.Generator
) -> tuple[list[Space], list[Door]]:
    chance = rng.random()
    # A block without a corridor is the whole floor: a court would leave nothing of it.
    if chance < style.court and 0 < len(corridors) < 4:
        return [Space(block, Use.COURT)], []
    if chance < style.court + style.hall or block.area_m2 < 1.2 * style.room:
        use = Use.ROOM
        if block.area_m2 > 90.0:
            use = Use.STORE if rng.random() < style.store else Use.HALL
        return [Space(block, use, corridors)], []
    return _rooms(block, corridors, style, rng)


def _rooms(
    block: Rectangle, corridors: frozenset[str], style: _Style, rng: np.random.Generator
) -> tuple[list[Space], list[Door]]:
    """Cut a block by walls until each part is a room; a door connects the parts of each cut."""
    least = round(2.2 / RESOLUTION)
    along_x = block.width < block.height * rng.uniform(0.8, 1.25)
    across = block.height if along_x else block.width
    wanted = style.room * math.exp(rng.normal(0.0, 0.5))
    if block.area_m2 <= 1.4 * wanted or across < 2 * least + 2:
        stairs = block.area_m2 < 40.0 and rng.random() < 0.06
        return [Space(block, Use.STAIRS if stairs else Use.ROOM, corridors)], []
    at = round(min(across - least, max(least, across * rng.uniform(0.25, 0.75))))
    if along_x:
        cut = block.south + at
        parts = (replace(block, north=cut), replace(block, south=cut))
        lost = ("north", "south")
    else:
        cut = block.west + at
        parts = (replace(block, east=cut), replace(block, west=cut))
        lost = ("east", "west")
    first, doors = _rooms(parts[0], corridors - {lost[0]}, style, rng)
    second, more = _rooms(parts[1], corridors - {lost[1]}, style, rng)
    door = _door_between(first, second, cut, along_x=along_x, style=style, rng=rng)
    # Rooms that both have a corridor seldom have a door between them.
    needed = any(not corridors - {side} for side in lost)
    if door is not None and (needed or rng.random() < 0.35):
        doors = [*doors, door]
    return first + second, doors + more


def _door_between(
    first: list[Space],
    second: list[Space],
    cut: int,
    *,
    along_x: bool,
    style: _Style,
    rng: np.random.Generator,
) -> Door | None:
    """Place a door in the wall between two groups of rooms, where one room of each faces it."""
    width = round(rng.uniform(0.8, 1.1) / RESOLUTION)
    width -= width % 2
    room = width // 2 + HALF_WALL + 2
    places = []
    for one in first:
        for other in second:
            a, b = one.outline, other.outline
            if along_x and a.north == cut == b.south:
                low, high = max(a.west, b.west) + room, min(a.east, b.east) - room
            elif not along_x and a.east == cut == b.west:
                low, high = max(a.south, b.south) + room, min(a.north, b.north) - room
            else:
                continue
            if low <= high:
                places.append((low, high))
    if not places:
        return None
    low, high = places[int(rng.integers(len(places)))]
    at = int(rng.integers(low, high + 1))
    x, y = (at, cut) if along_x else (cut, at)
    return Door(x, y, along_x, width, bool(rng.random() < style.doors_open))


def _doors_to_corridors(space: Space, style: _Style, rng: np.random.Generator) -> list[Door]:
    doors = []
    for side in (side for side in _SIDES if side in space.open_sides):
        along_x = side in ("south", "north")
        length = space.outline.width if along_x else space.outline.height
        pitch = rng.uniform(6.0, 14.0) / RESOLUTION
        for _ in range(max(1, round(length / pitch))):
            double = rng.random() < (0.6 if space.outline.area_m2 > 60.0 else 0.08)
            width = round(rng.uniform(1.5, 1.9) / RESOLUTION if double else 18)
            width = min(width - width % 2, _WIDEST_DOOR)
            room = width // 2 + HALF_WALL + 2
            if length < 2 * room + 1:
                continue
            x, y = _middle_of_side(space.outline, side)
            if along_x:
                x = int(rng.integers(space.outline.west + room, space.outline.east - room + 1))
            else:
                y = int(rng.integers(space.outline.south + room, space.outline.north - room + 1))
            doors.append(Door(x, y, along_x, width, bool(rng.random() < style.doors_open)))
    return doors
