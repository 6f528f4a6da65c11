"""A simulated robot that viewers of the live page control."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.phases import CarryTo, DriveTo, Manner, Pause, Spin, Stand
from firstfix.lab.scenarios.scenario import Scenario, check_room, start_simulation
from firstfix.lab.simulation.rigs import RIGS, Rig
from firstfix.lab.simulation.simulation import Moment
from firstfix.lab.worlds.catalog import STARTS, WORLDS, random_free_pose
from firstfix.web.snapshot import AmclStart, SimulationStatus

MOST_PEOPLE = 30

SENSORS: dict[str, Rig] = {
    "360° x 12 m": RIGS["lidar"],
    "180° x 8 m": RIGS["half-lidar"],
    "two of 270° x 8 m": RIGS["two-lasers"],
    "60° x 5 m": RIGS["depth-camera"],
}
"""The sensors of the menu, by the name in it; the first is the default."""

_CARRY_S = 4.0
# After it was set down or kidnapped it stands, so that viewers see what the localizer does.
_REST_S = 3.0
# At a goal of a person it stays this long, at one of its own this long.
_GOAL_REST_S = 15.0
_WANDER_REST_S = 2.0
# Its sensors need this long to start, and it stands as long afterwards. In a world drawn to show
# one thing it stands until viewers have seen it.
_START_S = 2.0
_SHOWN_S = 120.0
_KIDNAP_CLEARANCE_M = 0.4


class SimulatedRobot:
    """A robot in a drawn building that executes commands, and wanders between them.

    It has no clock and no thread: `step` advances to the next scan. The same commands at the same
    steps and the same seed give the same result. Commands may come from any thread.

    Parameters
    ----------
    grid : OccupancyGrid
        The building, and the map of it.
    seed : int
        Seed of the simulation.
    world : str
        Name of the building.
    worlds : mapping of str to callable
        Buildings that can be entered besides; by default the built-in worlds.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        seed: int,
        world: str = "map",
        worlds: Mapping[str, Callable[[], OccupancyGrid]] = WORLDS,
    ) -> None:
        self._seed = seed
        self._rng = np.random.default_rng(seed)
        self._lock = threading.Lock()
        self._given = world, grid
        self._worlds = worlds
        self._sensor = next(iter(SENSORS))
        self._is_paused = self._is_covered = False
        self._amcl = AmclStart.OFF
        self._path: tuple[tuple[float, float], ...] = ()
        self._starts = 0
        self._plan: Iterator[Moment]
        self._enter(world, grid)

    @property
    def T_map_base(self) -> SE2:
        """The true pose."""
        return self._simulation.robot.T_map_base

    @property
    def grid(self) -> OccupancyGrid:
        """The map of the present world."""
        return self._grid

    @property
    def starts(self) -> int:
        """How often the simulation was started, also in the same world."""
        return self._starts

    @property
    def status(self) -> SimulationStatus:
        """World, sensor, whether the clock is stopped or the sensor covered, and plain AMCL."""
        return SimulationStatus(
            *(self._world, self._sensor, self._is_paused, self._is_covered, self._amcl),
            self._path,
        )

    @property
    def worlds(self) -> tuple[str, ...]:
        """Names of the worlds that `select_world` takes."""
        return tuple(dict.fromkeys([self._given[0], *self._worlds]))

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensors that `select_sensor` takes."""
        return tuple(SENSORS)

    def step(self) -> Moment | None:
        """Advance to the next scan; None while the clock is stopped."""
        with self._lock:
            if self._is_paused:
                return None
            while True:
                for moment in self._plan:
                    return _with_covered_sensor(moment) if self._is_covered else moment
                self._plan = self._drive(None, _WANDER_REST_S)

    def pause(self) -> None:
        """Stop the clock."""
        self._is_paused = True

    def resume(self) -> None:
        """Resume the clock."""
        self._is_paused = False

    def drive_to(self, x: float, y: float) -> None:
        """Drive to a point (m, map frame).

        Raises
        ------
        InputError
            If the robot does not fit there, no path leads there, or it is being carried.
        """
        goal = SE2(x, y, 0.0)
        with self._lock:
            self._check(goal)
            path = self._simulation.planner.path(self.T_map_base, goal)
            self._plan = self._drive_along(path, goal)

    def move(self, turn: float, ahead: float) -> None:
        """Turn (rad) on the spot, then drive straight ahead (m), then wait.

        Raises
        ------
        InputError
            If there is no room, or the robot is being carried.
        """
        offset = SE2(ahead * math.cos(turn), ahead * math.sin(turn), 0.0)
        with self._lock:
            goal = self.T_map_base @ offset
            self._check(goal)
            self._path = ()
            self._plan = self._turn_and_drive(turn, goal if ahead > 0.0 else None)

    def carry_to(self, T_map_base: SE2) -> None:
        """Get picked up and set down elsewhere; the wheels drop meanwhile.

        Raises
        ------
        InputError
            If the robot does not fit there, or is already being carried.
        """
        with self._lock:
            self._check(T_map_base)
            self._path = ()
            self._plan = self._be_carried(T_map_base)

    def kidnap(self) -> SE2:
        """Teleport to a random free pose, with no signal of any sensor; return the pose.

        Raises
        ------
        InputError
            If the robot is being carried.
        """
        with self._lock:
            self._check_on_floor()
            pose = random_free_pose(self._grid, self._rng, _KIDNAP_CLEARANCE_M)
            self._path = ()
            self._simulation.robot.place(pose)
            self._plan = Stand(_REST_S).run(self._simulation)
            return pose

    def set_people(self, count: int) -> None:
        """Let this many people walk around the robot, instead of those who are there.

        Raises
        ------
        InputError
            If these are too many.
        """
        if not 0 <= count <= MOST_PEOPLE:
            raise InputError(f"There can be 0 to {MOST_PEOPLE} people, not {count}.")
        with self._lock:
            self._simulation.people.come(count, Manner.WALK, self.T_map_base)

    def cover_sensor(self, *, covered: bool) -> None:
        """Cover or uncover the sensor: covered, all ranges are shorter than `range_min`."""
        self._is_covered = covered

    def run_amcl(self, start: AmclStart) -> None:
        """Let a plain AMCL run beside the localizer, or end it."""
        self._amcl = start

    def select_sensor(self, name: str) -> None:
        """Exchange the sensor.

        Raises
        ------
        InputError
            If there is none of this name.
        """
        if name not in SENSORS:
            raise InputError(
                f"There is no sensor {name!r:.40}. Choose one of {', '.join(SENSORS)}."
            )
        with self._lock:
            self._sensor = name
            self._simulation.rig = SENSORS[name]

    def select_world(self, name: str) -> None:
        """Restart the simulation in a world, which may be the present one.

        Raises
        ------
        InputError
            If there is none of this name.
        """
        if name not in self.worlds:
            raise InputError(
                f"There is no world {name!r:.40}. Choose one of {', '.join(self.worlds)}."
            )
        given, grid = self._given
        grid = grid if name == given else self._worlds[name]()
        with self._lock:
            self._enter(name, grid)

    def _enter(self, world: str, grid: OccupancyGrid) -> None:
        scenario = Scenario((), STARTS.get(world), rig=SENSORS[self._sensor])
        self._simulation = start_simulation(scenario, grid, self._seed)
        self._radius_m = scenario.kobuki.radius_m
        self._plan = self._start(_SHOWN_S if world in STARTS else _START_S)
        self._world, self._grid = world, grid
        self._path = ()
        self._starts += 1

    def _check(self, place: SE2) -> None:
        self._check_on_floor()
        check_room(self._simulation.floor, place, self._radius_m)

    def _check_on_floor(self) -> None:
        if self._simulation.robot.lifted:
            raise InputError(f"The robot is being carried. Try again in {_CARRY_S:g} s.")

    def _start(self, stand_s: float) -> Iterator[Moment]:
        yield from Pause(_START_S).run(self._simulation)
        yield from Stand(stand_s).run(self._simulation)

    def _drive(self, goal: SE2 | None, rest_s: float) -> Iterator[Moment]:
        with suppress(InputError):  # where no path leads out, it stays
            yield from DriveTo(goal).run(self._simulation)
        yield from Stand(rest_s).run(self._simulation)

    def _drive_along(self, path: NDArray[np.float64], goal: SE2) -> Iterator[Moment]:
        """Drive to a goal of a person, and show the way there until it arrives."""
        self._path = tuple((round(x, 3), round(y, 3)) for x, y in path.tolist())
        return chain(self._drive_and_arrive(goal), Stand(_GOAL_REST_S).run(self._simulation))

    def _drive_and_arrive(self, goal: SE2) -> Iterator[Moment]:
        yield from self._drive(goal, 0.0)
        self._path = ()

    def _turn_and_drive(self, turn: float, goal: SE2 | None) -> Iterator[Moment]:
        yield from Spin(turn).run(self._simulation)
        if goal is not None:
            yield from self._drive(goal, _GOAL_REST_S)
        else:
            yield from Stand(_GOAL_REST_S).run(self._simulation)

    def _be_carried(self, T_map_base: SE2) -> Iterator[Moment]:
        yield from CarryTo(T_map_base, _CARRY_S).run(self._simulation)
        yield from Stand(_REST_S).run(self._simulation)


def _with_covered_sensor(moment: Moment) -> Moment:
    """Return the moment as a covered sensor reports it: every range is too short to be valid."""
    events = tuple(
        replace(event, ranges=np.full_like(event.ranges, event.range_min / 2.0))
        if isinstance(event, LaserScan)
        else event
        for event in moment.events
    )
    return replace(moment, events=events)
