"""A simulated robot that people steer."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import suppress

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.phases import CarryTo, DriveTo, Manner, Pause, Stand
from firstfix.lab.scenarios.scenario import Scenario, check_room, start_simulation
from firstfix.lab.simulation.simulation import Moment

MOST_PEOPLE = 30

# In somebody's hands; then it is left alone so long that everybody sees what it makes of it.
_CARRY_S = 4.0
_REST_S = 3.0
# Where it was sent it stays so long; then it wanders again.
_PATIENCE_S = 15.0
# Between two goals of its own, and before the first; so long, too, do its sensors take to start.
_BREAK_S = 2.0


class SimRobot:
    """A robot in a drawn building that does as it is told, and wanders when nobody tells it.

    No clock, no thread: `step` goes on by one scan. The same orders at the same steps and the same
    seed lead to the same story. Orders may come from any thread.

    Parameters
    ----------
    grid : OccupancyGrid
        The building, and the map of it.
    seed : int
        Where chance begins.
    """

    def __init__(self, grid: OccupancyGrid, seed: int) -> None:
        self._scenario = Scenario(())
        self._simulation = start_simulation(self._scenario, grid, seed)
        self._lock = threading.Lock()
        self._plot: Iterator[Moment] = self._wake()
        self.is_paused = False

    @property
    def T_map_base(self) -> SE2:
        """Where it truly is."""
        return self._simulation.robot.T_map_base

    def step(self) -> Moment | None:
        """Go on to the next scan; None while it is paused."""
        with self._lock:
            if self.is_paused:
                return None
            while True:
                for moment in self._plot:
                    return moment
                self._plot = self._drive(None, _BREAK_S)

    def pause(self) -> None:
        """Stop its clock."""
        self.is_paused = True

    def go_on(self) -> None:
        """Let its clock go on."""
        self.is_paused = False

    def drive_to(self, x: float, y: float) -> None:
        """Send it to a place (m, map frame).

        Raises
        ------
        InputError
            If it does not fit there, or no way leads there, or somebody holds it.
        """
        goal = SE2(x, y, 0.0)
        with self._lock:
            self._check(goal)
            self._simulation.planner.path(self.T_map_base, goal)
            self._plot = self._drive(goal, _PATIENCE_S)

    def carry_to(self, T_map_base: SE2) -> None:
        """Pick it up and put it down elsewhere.

        Raises
        ------
        InputError
            If it does not fit there, or somebody holds it already.
        """
        with self._lock:
            self._check(T_map_base)
            self._plot = self._be_carried(T_map_base)

    def meet(self, people: int) -> None:
        """Let so many people walk around it, instead of those who are there.

        Raises
        ------
        InputError
            If these are too many.
        """
        if not 0 <= people <= MOST_PEOPLE:
            raise InputError(
                expected=f"0 to {MOST_PEOPLE} people",
                received=f"{people}",
                remedy="ask for fewer",
            )
        with self._lock:
            self._simulation.people.come(people, Manner.WALK, self.T_map_base)

    def _check(self, place: SE2) -> None:
        if self._simulation.robot.lifted:
            raise InputError(
                expected="a robot on its wheels",
                received="one in somebody's hands",
                remedy=f"wait until it stands again, at most {_CARRY_S:g} s",
            )
        check_room(self._simulation.floor, place, self._scenario.kobuki.radius_m)

    def _wake(self) -> Iterator[Moment]:
        yield from Pause(_BREAK_S).run(self._simulation)
        yield from Stand(_BREAK_S).run(self._simulation)

    def _drive(self, goal: SE2 | None, rest_s: float) -> Iterator[Moment]:
        with suppress(InputError):  # where it was put there may be no way out: it stays
            yield from DriveTo(goal).run(self._simulation)
        yield from Stand(rest_s).run(self._simulation)

    def _be_carried(self, T_map_base: SE2) -> Iterator[Moment]:
        yield from CarryTo(T_map_base, _CARRY_S).run(self._simulation)
        yield from Stand(_REST_S).run(self._simulation)
