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
from firstfix.lab.worlds.towers import EXIT_M, TowerFloor
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

    def hear(self, map_id: str) -> None:
        """Be told the floor by the lift."""
        self._give(MapHint(self._now, map_id, Teller.LIFT.value))

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
    seed: int,
    cache_dir: Path,
    teller: Teller = Teller.NOBODY,
) -> Iterator[Ride]:
    """Let one robot ride a lift again and again.

    Parameters
    ----------
    floors : sequence of TowerFloor
        The building.
    folder : Path
        Its site, as `write_tower` writes it.
    rides : int
        Number of rides.
    seed : int
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
    robot = _Robot(SiteLocalizer(Site.load(folder, cache_dir), cache_dir=cache_dir), rng)
    level = int(rng.integers(len(floors)))
    lift = floors[level].T_map_lift
    robot.enter(floors[level], floors[level].open_world, lift @ SE2(EXIT_M, 0.0, 0.0))
    for _ in robot.stand(2.0):
        pass
    for _ in range(rides):
        goal = int((level + 1 + rng.integers(len(floors) - 1)) % len(floors))
        yield _ride(robot, floors[level], floors[goal], teller, rng)
        level = goal


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
        robot.hear(goal.map_id)
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


def in_words(rides: Sequence[Ride]) -> str:
    """Sum rides up in three lines."""
    found = [ride for ride in rides if ride.is_found]
    seconds = np.array([ride.found_s for ride in rides])
    metres = np.array([ride.found_m for ride in rides])
    poses = sum(ride.poses for ride in rides)
    wrong = sum(ride.wrong_map for ride in rides)
    on_wrong = sum(ride.wrong_map > 0 for ride in rides)
    cpu = float(np.mean([ride.cpu_s for ride in rides]))
    return (
        f"{len(rides)} rides, {poses} poses: {wrong} on a wrong map (in {on_wrong} rides), "
        f"{sum(ride.wrong_place for ride in rides)} more than {RIGHT_M} m off\n"
        f"{len(found) / len(rides):.1%} found within {FOUND_M:.0f} m or {FOUND_S:.0f} s of the "
        f"opening of the door; {np.isfinite(seconds).mean():.1%} before the end of the drive\n"
        f"median {np.median(seconds):.1f} s and {np.median(metres):.2f} m; "
        f"{cpu:.1f} s of CPU a ride"
    )
