"""People around the robot: they walk about, or surround it and move with it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor

RADIUS_M = (0.2, 0.25)
"""From slim to stout at the height of the sensor, m."""

_AROUND_M = (0.6, 1.3)  # distance of people who surround the robot
_ABOUT_M = 5.0  # people who walk stay within this distance
_PACE_MPS = (0.6, 1.2)
_GAP_M = 0.35  # between the centre of the robot and a person
_SHOULDER_M = 0.25  # from the centre of a person to a wall
_TRIES = 20


class Manner(Enum):
    """What people do."""

    WALK = "walk"
    SURROUND = "surround"


@dataclass(slots=True)
class _Person:
    x: float
    y: float
    radius: float
    pace: float
    wish: tuple[float, float]  # a point of the map, or a place relative to the robot; m


class People:
    """All people on a floor; their goals are random."""

    def __init__(self, floor: Floor, rng: np.random.Generator) -> None:
        self._floor = floor
        self._rng = rng
        self._manner = Manner.WALK
        self._all: list[_Person] = []

    def __len__(self) -> int:
        return len(self._all)

    @property
    def circles(self) -> NDArray[np.float64]:
        """Where they are, shape (n, 3): x, y in the map frame, radius; m."""
        return np.array([(p.x, p.y, p.radius) for p in self._all]).reshape(-1, 3)

    def come(self, count: int, manner: Manner, T_map_base: SE2) -> None:
        """Replace all people by new ones.

        Fewer than ``count`` come if there is no room for all in sight of the robot.
        """
        self._manner = manner
        self._all = []
        first = self._rng.uniform(-math.pi, math.pi)
        for i in range(count):
            person = self._comer(first + i * 2.0 * math.pi / count, T_map_base)
            if person is not None:
                self._all.append(person)

    def walk(self, T_map_base: SE2, seconds: float) -> None:
        """Move all people for a short time (s) while the robot is at ``T_map_base``."""
        for person in self._all:
            if self._manner is Manner.SURROUND:
                x, y = T_map_base.x + person.wish[0], T_map_base.y + person.wish[1]
            else:
                x, y = person.wish
            before = math.hypot(x - person.x, y - person.y)
            self._step(person, x, y, person.pace * seconds)
            _make_way(person, T_map_base)
            nearer = before - math.hypot(x - person.x, y - person.y)
            # A person who has arrived or is blocked gets a new goal.
            if self._manner is Manner.WALK and nearer < person.pace * seconds / 4.0:
                person.wish = self._next_goal(person, T_map_base)

    def _comer(self, bearing: float, T_map_base: SE2) -> _Person | None:
        """Find a place in sight of the robot, in about this direction (rad) of the map."""
        rng = self._rng
        nearest, farthest = _AROUND_M
        if self._manner is Manner.WALK:
            nearest, farthest = 1.0, _ABOUT_M
        for widening in np.linspace(0.2, math.pi, _TRIES).tolist():
            direction = bearing + rng.uniform(-widening, widening)
            away = rng.uniform(nearest, farthest)
            beside = (away * math.cos(direction), away * math.sin(direction))
            x, y = T_map_base.x + beside[0], T_map_base.y + beside[1]
            if self._floor.has_room((T_map_base.x, T_map_base.y), (x, y), 0.1):
                wish = beside if self._manner is Manner.SURROUND else (x, y)
                return _Person(x, y, rng.uniform(*RADIUS_M), rng.uniform(*_PACE_MPS), wish)
        return None

    def _next_goal(self, person: _Person, T_map_base: SE2) -> tuple[float, float]:
        """Choose a point to which one can walk straight, near the robot or at least not far."""
        here = (person.x, person.y)
        for i in range(_TRIES):
            middle = (T_map_base.x, T_map_base.y) if i < _TRIES // 2 else here
            dx, dy = self._rng.uniform(-_ABOUT_M, _ABOUT_M, 2).tolist()
            goal = (middle[0] + dx, middle[1] + dy)
            if self._floor.has_room(here, goal, min(_SHOULDER_M, self._floor.room_at(*here))):
                return goal
        return here

    def _step(self, person: _Person, x: float, y: float, longest_m: float) -> None:
        """Go towards a point, along walls if need be."""
        dx, dy = x - person.x, y - person.y
        shorter = min(1.0, longest_m / max(math.hypot(dx, dy), 1e-9))
        dx, dy = shorter * dx, shorter * dy
        room = min(_SHOULDER_M / 2.0, self._floor.room_at(person.x, person.y))
        for to_x, to_y in ((dx, dy), (dx, 0.0), (0.0, dy)):
            if self._floor.room_at(person.x + to_x, person.y + to_y) >= room:
                person.x += to_x
                person.y += to_y
                return


def _make_way(person: _Person, T_map_base: SE2) -> None:
    """Step aside, so that a driving robot hits nobody."""
    dx, dy = person.x - T_map_base.x, person.y - T_map_base.y
    away, least = math.hypot(dx, dy), _GAP_M + person.radius
    if away < least:
        direction = math.atan2(dy, dx)
        person.x = T_map_base.x + least * math.cos(direction)
        person.y = T_map_base.y + least * math.sin(direction)
