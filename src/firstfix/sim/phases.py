"""What can happen to a robot, one phase after another."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.se2 import SE2
from firstfix.sim.pilot import Pilot
from firstfix.sim.stage import PERIOD_S, Disturbance, Moment, Stage
from firstfix.sim.world import random_free_pose


class Phase(ABC):
    """A part of a scenario."""

    @abstractmethod
    def play(self, stage: Stage) -> Iterator[Moment]:
        """Move the stage on to the end of the phase, scan by scan; a phase may take no time."""


@dataclass(frozen=True, slots=True)
class Stand(Phase):
    """The robot stands still.

    Parameters
    ----------
    seconds : float
        How long, s.
    """

    seconds: float

    def play(self, stage: Stage) -> Iterator[Moment]:
        """Stand."""
        for _ in range(_periods(self.seconds)):
            yield stage.moment("stand")


@dataclass(frozen=True, slots=True)
class DriveTo(Phase):
    """The robot drives to a goal along a planned way and stops there.

    Parameters
    ----------
    to : SE2 or None
        The goal in the map frame (its heading does not count); None for a random one.
    seconds : float
        When to give up, s.
    """

    to: SE2 | None = None
    seconds: float = 300.0

    def play(self, stage: Stage) -> Iterator[Moment]:
        """Drive."""
        here = stage.robot.T_map_base
        goal = stage.planner.random_goal(here, stage.rng) if self.to is None else self.to
        pilot = Pilot(stage.planner.path(here, goal))
        for _ in range(_periods(self.seconds)):
            if pilot.arrived:
                break
            yield stage.moment("drive", pilot.command)


@dataclass(frozen=True, slots=True)
class Teleport(Phase):
    """The robot is somewhere else all of a sudden, and neither wheels nor signals say so.

    Parameters
    ----------
    to : SE2 or None
        ``T_map_base`` afterwards; None for a random free place.
    """

    to: SE2 | None = None

    def play(self, stage: Stage) -> Iterator[Moment]:
        """Move it between two scans."""
        stage.robot.place(_somewhere(stage) if self.to is None else self.to)
        stage.disturbed(Disturbance.TELEPORTED)
        yield from ()


@dataclass(frozen=True, slots=True)
class CarryTo(Phase):
    """Somebody lifts the robot, carries it straight to a place and sets it down.

    The wheels hang and count nothing; the sensor, tilted and turned about, sees the hands and the
    body of who carries it and whatever else is in its way.

    Parameters
    ----------
    to : SE2 or None
        ``T_map_base`` afterwards; None for a random free place.
    seconds : float
        How long this takes, s.
    """

    to: SE2 | None = None
    seconds: float = 5.0

    def play(self, stage: Stage) -> Iterator[Moment]:
        """Lift, carry, set down."""
        start, goal = stage.robot.T_map_base, _somewhere(stage) if self.to is None else self.to
        periods = max(1, _periods(self.seconds))
        stage.robot.lift()
        sway = stage.rng.uniform(-math.pi, math.pi, 2)
        for i in range(periods):
            share = i / periods
            yaw = start.yaw + float(sway @ np.sin(share * np.array([7.0, 23.0])))
            x, y = (a + share * (b - a) for a, b in ((start.x, goal.x), (start.y, goal.y)))
            stage.robot.place(SE2(x, y, yaw))
            yield stage.moment("carry", hands=_HANDS)
        stage.robot.place(goal)
        stage.robot.set_down()
        stage.disturbed(Disturbance.CARRIED)


# Two hands at the rim, and the body behind them: x, y in the base frame, radius; m.
_HANDS: NDArray[np.float64] = np.array([[0.0, 0.2, 0.05], [0.0, -0.2, 0.05], [-0.4, 0.0, 0.2]])


def _periods(seconds: float) -> int:
    return round(seconds / PERIOD_S)


def _somewhere(stage: Stage) -> SE2:
    return random_free_pose(stage.floor.grid, stage.rng)
