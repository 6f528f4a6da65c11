"""Motions of a robot: it stands, drives and turns, with or without people around it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.phase import Phase, periods
from firstfix.lab.simulation.people import Manner
from firstfix.lab.simulation.pilot import Pilot
from firstfix.lab.simulation.simulation import PERIOD_S, Moment, Simulation

_BACK_OFF_MPS = -0.15
_BACK_OFF_S = 1.0
_SPIN_RADPS = 1.0


@dataclass(frozen=True, slots=True)
class Stand(Phase):
    """Stand still for a time (s)."""

    seconds: float

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Stand."""
        for _ in range(periods(self.seconds)):
            yield simulation.step("stand")


@dataclass(frozen=True, slots=True)
class Pause(Phase):
    """Stand still for a time (s), without a scan, odometry or a signal."""

    seconds: float

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Be silent."""
        for _ in range(periods(self.seconds)):
            yield simulation.step_silently("pause")


@dataclass(frozen=True, slots=True)
class DriveTo(Phase):
    """Drive to a goal along a planned path and stop there.

    Parameters
    ----------
    to : SE2 or None
        The goal in the map frame (its heading is ignored); None for a random reachable one.
    seconds : float
        Time limit, s.
    """

    to: SE2 | None = None
    seconds: float = 300.0

    @property
    def places(self) -> tuple[SE2, ...]:
        """The goal."""
        return () if self.to is None else (self.to,)

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Drive; after a bump go back a little and plan anew."""
        here = simulation.robot.T_map_base
        goal = simulation.planner.random_goal(here, simulation.rng) if self.to is None else self.to
        pilot = Pilot(simulation.planner.path(here, goal))
        back_off = 0
        for _ in range(periods(self.seconds)):
            if pilot.arrived:
                break
            if back_off == 0 and simulation.robot.bumped:
                back_off = periods(_BACK_OFF_S)
            if back_off == 0:
                yield simulation.step("drive", pilot.command)
                continue
            yield simulation.step("drive", lambda _: (_BACK_OFF_MPS, 0.0))
            back_off -= 1
            if back_off == 0:
                pilot = Pilot(simulation.planner.path(simulation.robot.T_map_base, goal))


@dataclass(frozen=True, slots=True)
class Wander(Phase):
    """Drive from one random goal to the next for a time (s)."""

    seconds: float

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Drive until time is over."""
        end = simulation.stamp + self.seconds - PERIOD_S / 2.0
        while simulation.stamp < end:
            before = simulation.stamp
            yield from DriveTo(seconds=end - before).run(simulation)
            if simulation.stamp == before:  # in a nook, where every goal is at hand
                yield simulation.step("drive")


@dataclass(frozen=True, slots=True)
class Spin(Phase):
    """Turn on the spot by an angle (rad, positive to the left, any size)."""

    radians: float

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Turn at a steady speed, and stop."""
        turn = math.copysign(_SPIN_RADPS, self.radians)
        for _ in range(periods(abs(self.radians) / _SPIN_RADPS)):
            yield simulation.step("spin", lambda _: (0.0, turn))
        yield simulation.step("spin")


@dataclass(frozen=True, slots=True)
class Crowd(Phase):
    """People come to the robot, which stands still for a while; they stay until the next crowd.

    Parameters
    ----------
    count : int
        Number of people; fewer come if there is no room. 0 removes all.
    seconds : float
        How long the robot stands, s.
    manner : Manner
        Whether they surround it and move with it, or walk about.
    """

    count: int
    seconds: float = 0.0
    manner: Manner = Manner.SURROUND

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Let them come and stand among them."""
        simulation.people.come(self.count, self.manner, simulation.robot.T_map_base)
        for _ in range(periods(self.seconds)):
            yield simulation.step("crowd")
