"""Rides in a lift: poses on a wrong floor, and how soon the right floor is found."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.pilot import Pilot
from firstfix.lab.simulation.planner import Planner
from firstfix.lab.simulation.robot import Kobuki, Robot
from firstfix.lab.simulation.wheels import WheelErrors
from firstfix.lab.worlds.towers import EXIT_M, Likeness, TowerFloor
from firstfix.localizer.inputs import Input, MapHint
from firstfix.localizer.outputs import InitialPose, MapSwitched, TrackedPose
from firstfix.site.floors import SiteLocalizer
from firstfix.site.site import Site

FOUND_M, FOUND_S = 2.0, 5.0
"""A floor counts as found in time within this of the opening of the door, whichever is later."""

RIGHT_M = 0.5
"""A pose farther from the truth than this is wrong."""


class Teller(Enum):
    """Who tells the robot its floor when the door opens."""

    NOBODY = "nobody"
    LIFT = "the lift"


# Who tells a robot its floor that was not found on a ride, and how long it stands then, s.
_PERSON, _TOLD_S = "a person", 2.0

_PERIOD_S = 0.2
_TICKS = 5  # of odometry in a period

# How long the door is shut on either floor, and open before the robot leaves, s.
_SHUT_S, _OPEN_S = 1.0, 1.0
_LONGEST_S = 60.0

_LIDAR = Lidar(beams=360, range_max=12.0, sigma_m=0.015)
_WORN = WheelErrors(sigma_scale=0.02, sigma_uneven=0.006, sigma_step=0.006)
_LEFT_M = 4.0  # how far from the door a ride ends


@dataclass(frozen=True, slots=True)
class Ride:
    """What happened on one ride.

    Parameters
    ----------
    start, goal : int
        Levels.
    likeness : Likeness
        Of the goal.
    poses, wrong_map, wrong_place : int
        Poses that were published; those in another map than that of the floor; those in the right
        map, too far from the truth.
    found_s, found_m : float
        Time and way from the opening of the door to the first right pose; infinite if there was
        none before the robot had left.
    cpu_s : float
        CPU time of the localizer.
    """

    start: int
    goal: int
    likeness: Likeness
    poses: int
    wrong_map: int
    wrong_place: int
    found_s: float
    found_m: float
    cpu_s: float

    @property
    def is_found(self) -> bool:
        """True if the first right pose came in time."""
        return self.found_s <= FOUND_S or self.found_m <= FOUND_M


class _Robot:
    """A simulated robot in a tower, and what its localizer publishes."""

    def __init__(self, localizer: SiteLocalizer, rng: np.random.Generator) -> None:
        self._localizer = localizer
        self._rng = rng
        self._now = 0.0
        self._map_id: str | None = None
        self._kobuki = Kobuki(wheels=_WORN)
        self._planners: dict[int, Planner] = {}
        self._floors: dict[int, Floor] = {}
        self._robot: Robot
        self._here: TowerFloor
        self.T_map_base = SE2.identity()
        self._T_odom_base = SE2.identity()
        self.cpu_s = 0.0
        self.poses = self.wrong_map = self.wrong_place = 0
        self.is_right = False

    def enter(self, floor: TowerFloor, grid: OccupancyGrid, T_map_base: SE2) -> None:
        """Put the robot on a floor, or open or close the door; odometry goes on."""
        self._here = floor
        world = self._floors.setdefault(id(grid), Floor(grid))
        self._world = world
        self._robot = Robot(self._kobuki, world, T_map_base, self._rng)
        self._robot.T_odom_base = self._T_odom_base
        self.T_map_base = T_map_base

    @property
    def planner(self) -> Planner:
        """Plans on the floor where the robot is."""
        return self._planners.setdefault(id(self._world), Planner(self._world, 0.22))

    def hear(self, map_id: str, teller: str) -> None:
        """Be told the floor."""
        self._give(MapHint(self._now, map_id, teller))

    def stand(self, seconds: float) -> Iterator[float]:
        """Stand; yield the way of each period, 0 m."""
        for _ in range(round(seconds / _PERIOD_S)):
            yield self._step(lambda _: (0.0, 0.0))

    def drive(self, x: float, y: float) -> Iterator[float]:
        """Drive to a point; yield the way of each period, m."""
        pilot = Pilot(self.planner.path(self.T_map_base, SE2(x, y, 0.0)))
        for _ in range(round(_LONGEST_S / _PERIOD_S)):
            if pilot.arrived:
                return
            yield self._step(pilot.command)

    def _step(self, command: Callable[[SE2], tuple[float, float]]) -> float:
        before = self.T_map_base
        self._give(Odometry(self._now, self._T_odom_base))
        self._give(replace(_LIDAR.scan(self._world.grid, before, self._rng), stamp=self._now))
        for _ in range(_TICKS):
            self._robot.drive(*command(self._robot.T_map_base), _PERIOD_S / _TICKS)
        self.T_map_base, self._T_odom_base = self._robot.T_map_base, self._robot.T_odom_base
        self._now += _PERIOD_S
        return before.distance_to(self.T_map_base)

    def _give(self, given: Input) -> None:
        started = time.process_time()
        outputs = self._localizer.handle(given)
        self.cpu_s += time.process_time() - started
        for output in outputs:
            if isinstance(output, MapSwitched):
                self._map_id = output.map_id
            elif isinstance(output, (InitialPose, TrackedPose)):
                self.poses += 1
                is_map = self._map_id == self._here.map_id
                is_near = output.T_map_base.distance_to(self.T_map_base) <= RIGHT_M
                self.wrong_map += not is_map
                self.wrong_place += is_map and not is_near
                self.is_right = is_map and is_near


def ride_lifts(
    floors: Sequence[TowerFloor],
    folder: Path,
    rides: int,
    seed: int | Sequence[int],
    cache_dir: Path,
    teller: Teller = Teller.NOBODY,
) -> Iterator[Ride]:
    """Let one robot ride a lift again and again.

    It begins on a floor that is like no other. A robot that was not found by the end of a ride is
    told its floor by a person, so that the next ride begins with a robot that knows its place.

    Parameters
    ----------
    floors : sequence of TowerFloor
        The building.
    folder : Path
        Its site, as `write_tower` writes it.
    rides : int
        Number of rides.
    seed : int or sequence of int
        Of the robot, and of the floors that it rides to.
    cache_dir : Path
        Folder of prepared maps.
    teller : Teller
        Who tells the robot its floor.

    Yields
    ------
    Ride
        One after the other.
    """
    rng = np.random.default_rng(seed)
    distinct = [i for i, one in enumerate(floors) if one.likeness is Likeness.DISTINCT]
    level = int(rng.choice(distinct or range(len(floors))))
    robot = _Robot(SiteLocalizer(Site.load(folder, cache_dir), cache_dir=cache_dir), rng)
    lift = floors[level].T_map_lift
    robot.enter(floors[level], floors[level].open_world, lift @ SE2(EXIT_M, 0.0, 0.0))
    for _ in robot.stand(2.0):
        pass
    for _ in range(rides):
        goal = int((level + 1 + rng.integers(len(floors) - 1)) % len(floors))
        yield _ride(robot, floors[level], floors[goal], teller, rng)
        level = goal
        if not robot.is_right:
            robot.hear(floors[level].map_id, _PERSON)
            for _ in robot.stand(_TOLD_S):
                pass


def _ride(
    robot: _Robot, start: TowerFloor, goal: TowerFloor, teller: Teller, rng: np.random.Generator
) -> Ride:
    robot.poses = robot.wrong_map = robot.wrong_place = 0
    robot.cpu_s = 0.0
    for _ in robot.drive(start.T_map_lift.x, start.T_map_lift.y):
        pass
    T_lift_base = start.T_map_lift.inverse() @ robot.T_map_base
    robot.enter(start, start.closed_world, robot.T_map_base)
    for _ in robot.stand(_SHUT_S):
        pass
    robot.enter(goal, goal.closed_world, goal.T_map_lift @ T_lift_base)
    for _ in robot.stand(_SHUT_S):
        pass
    robot.enter(goal, goal.open_world, robot.T_map_base)
    if teller is Teller.LIFT:
        robot.hear(goal.map_id, teller.value)
    robot.is_right = False
    found_s = found_m = math.inf
    seconds = way = 0.0
    for step in _leave(robot, goal, rng):
        seconds, way = seconds + _PERIOD_S, way + step
        if robot.is_right and found_s == math.inf:
            found_s, found_m = seconds, way
    return Ride(
        start.level,
        goal.level,
        goal.likeness,
        robot.poses,
        robot.wrong_map,
        robot.wrong_place,
        found_s,
        found_m,
        robot.cpu_s,
    )


def _leave(robot: _Robot, goal: TowerFloor, rng: np.random.Generator) -> Iterator[float]:
    yield from robot.stand(_OPEN_S)
    out = goal.T_map_lift @ SE2(EXIT_M, 0.0, 0.0)
    yield from robot.drive(out.x, out.y)
    yield from robot.drive(*_near(robot, out, rng))


def _near(robot: _Robot, out: SE2, rng: np.random.Generator) -> tuple[float, float]:
    """Draw a reachable place a few metres from the lift."""
    planner = robot.planner
    for _ in range(200):
        place = planner.random_goal(robot.T_map_base, rng)
        if 1.0 <= place.distance_to(out) <= _LEFT_M:
            return place.x, place.y
    return out.x, out.y
