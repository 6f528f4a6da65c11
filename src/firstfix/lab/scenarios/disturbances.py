"""Disturbances of a robot: teleported, carried, pushed, or with slipping wheels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.phase import Phase, periods
from firstfix.lab.simulation.simulation import (
    ODOMETRY_HZ,
    PERIOD_S,
    Disturbance,
    Moment,
    Simulation,
)
from firstfix.lab.simulation.sweep import NOBODY
from firstfix.lab.worlds.catalog import random_free_pose

_SWAY_RAD = 1.5  # amplitude of the sway of a carried robot


class Grip(Enum):
    """What the sensor of a carried robot sees of the carrier."""

    OPEN = "open"  # nothing: it is held from below
    HANDS = "hands"  # two hands, and a body behind
    COVERED = "covered"  # something near in every direction


@dataclass(frozen=True, slots=True)
class Teleport(Phase):
    """Move the robot to a pose (None: a random free one) with no signal from wheels or sensors."""

    to: SE2 | None = None

    @property
    def places(self) -> tuple[SE2, ...]:
        """Where it will be."""
        return () if self.to is None else (self.to,)

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Move the robot between two scans."""
        simulation.robot.place(_somewhere(simulation) if self.to is None else self.to)
        simulation.disturbed(Disturbance.TELEPORTED)
        yield from ()


@dataclass(frozen=True, slots=True)
class CarryTo(Phase):
    """A person lifts the robot, carries it to a pose and sets it down.

    The wheels drop and count nothing. The robot sways while it is carried along the path that it
    would drive, or along a straight line if there is no path.

    Parameters
    ----------
    to : SE2 or None
        ``T_map_base`` afterwards; None for a random free pose.
    seconds : float
        Time off the floor, s, at least one scan.
    grip : Grip
        What the sensor sees meanwhile.
    """

    to: SE2 | None = None
    seconds: float = 5.0
    grip: Grip = Grip.HANDS

    @property
    def places(self) -> tuple[SE2, ...]:
        """Where it will be."""
        return () if self.to is None else (self.to,)

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Lift, carry, set down."""
        robot = simulation.robot
        start, goal = robot.T_map_base, _somewhere(simulation) if self.to is None else self.to
        way = _way(simulation, start, goal)
        lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
        steps = max(1, periods(self.seconds))
        sway = simulation.rng.uniform(-_SWAY_RAD, _SWAY_RAD, 2)
        turn = (start.inverse() @ goal).yaw
        robot.lift()
        for i in range(steps):
            share = i / steps
            x, y = (float(np.interp(share * lengths[-1], lengths, side)) for side in way.T)
            to_and_fro = float(sway @ np.sin(share * math.pi * np.array([2.0, 5.0])))
            robot.place(SE2(x, y, start.yaw + share * turn + to_and_fro))
            yield simulation.step("carry", hands=_HANDS[self.grip])
        robot.place(goal)
        robot.set_down()
        simulation.disturbed(Disturbance.CARRIED)


class SlipKind(Enum):
    """What moved alone: the robot, or its wheels."""

    PUSHED = "pushed"  # the robot, aside or ahead, until it meets a wall
    SPINNING = "spinning"  # the wheels, forwards


@dataclass(frozen=True, slots=True)
class Slip(Phase):
    """Odometry and motion disagree: the robot is pushed, or its wheels spin.

    Parameters
    ----------
    metres, degrees : float
        Size of the disagreement.
    kind : SlipKind
        What moved.
    seconds : float
        Duration, s, at least one scan.
    """

    metres: float = 0.5
    degrees: float = 20.0
    kind: SlipKind = SlipKind.PUSHED
    seconds: float = 0.5

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Slip by a small step with every tick."""
        steps = max(1, periods(self.seconds))
        ticks = round(steps * PERIOD_S * ODOMETRY_HZ)
        length, turn = self.metres / ticks, math.radians(self.degrees) / ticks
        bearing = float(simulation.rng.uniform(-math.pi, math.pi))

        def tick(T_map_base: SE2) -> tuple[float, float]:
            if self.kind is SlipKind.SPINNING:
                simulation.robot.spin_wheels(length, turn)
            else:
                # The robot turns while it slides; the foot that pushes does not.
                aside = bearing - T_map_base.yaw
                simulation.robot.push(SE2(length * math.cos(aside), length * math.sin(aside), turn))
            return 0.0, 0.0

        for _ in range(steps):
            yield simulation.step("slip", tick)
        pushed = self.kind is SlipKind.PUSHED
        simulation.disturbed(Disturbance.PUSHED if pushed else Disturbance.SLIPPED)


def _ring() -> NDArray[np.float64]:
    bearings = np.arange(12) * (math.pi / 6.0)
    # Wide enough to leave no gap at 0.3 m; the base's middle is not the sensor's.
    return np.column_stack([0.3 * np.cos(bearings), 0.3 * np.sin(bearings), np.full(12, 0.1)])


# Circles around the robot: x, y in the base frame, radius; m.
_HANDS: dict[Grip, NDArray[np.float64]] = {
    Grip.OPEN: NOBODY,
    Grip.HANDS: np.array([[0.0, 0.2, 0.05], [0.0, -0.2, 0.05], [-0.4, 0.0, 0.2]]),
    Grip.COVERED: _ring(),
}


def _somewhere(simulation: Simulation) -> SE2:
    return random_free_pose(simulation.floor.grid, simulation.rng)


def _way(simulation: Simulation, start: SE2, goal: SE2) -> NDArray[np.float64]:
    try:
        return simulation.planner.path(start, goal)
    except InputError:  # over a wall, then
        return np.array([[start.x, start.y], [goal.x, goal.y]])
