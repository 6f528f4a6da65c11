"""The simulation: robot, sensors, people and clock, advanced by one scan at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.odometry import Odometry, Signal
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.people import People
from firstfix.lab.simulation.planner import Planner
from firstfix.lab.simulation.rigs import Rig
from firstfix.lab.simulation.robot import Kobuki, Robot
from firstfix.lab.simulation.sweep import NOBODY

SCAN_HZ = 10
ODOMETRY_HZ = 50
PERIOD_S = 1.0 / SCAN_HZ

_STEPS = ODOMETRY_HZ // SCAN_HZ
# Extra room of a planned path, because the robot does not follow it exactly.
_MARGIN_M = 0.05

Command = Callable[[SE2], tuple[float, float]]
"""A controller: from ``T_map_base`` to the speed v (m/s) and the turn rate w (rad/s)."""

Event = LaserScan | Odometry | Signal


class Disturbance(Enum):
    """A motion that the odometry does not report, or that it only reports."""

    TELEPORTED = "teleported"
    CARRIED = "carried"
    PUSHED = "pushed"
    SLIPPED = "slipped"


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """The reports of a robot from one scan to the next, and the truth.

    Parameters
    ----------
    stamp : float
        Time of the scan, s.
    events : tuple of LaserScan, Odometry or Signal
        In the order of their stamps; odometry comes before a scan of the same stamp.
    T_map_base : SE2
        The true pose at `stamp`.
    phase : str
        Name of the phase, for people.
    disturbance : Disturbance or None
        The disturbance that ended just before `stamp`.
    """

    stamp: float
    events: tuple[Event, ...]
    T_map_base: SE2
    phase: str
    disturbance: Disturbance | None = None

    @property
    def scans(self) -> tuple[LaserScan, ...]:
        """One scan of each sensor; none in a pause."""
        return tuple(event for event in self.events if isinstance(event, LaserScan))

    @property
    def scan(self) -> LaserScan | None:
        """The scan of the first sensor; None in a pause."""
        return next(iter(self.scans), None)


def at_rest(T_map_base: SE2) -> tuple[float, float]:
    """Command nothing, wherever the robot is."""
    del T_map_base
    return 0.0, 0.0


class Simulation:
    """The state of a running simulation: robot, sensor, people and clock.

    Parameters
    ----------
    floor : Floor
        Walls and furniture.
    kobuki : Kobuki
        Parameters of the robot.
    rig : Rig
        Its sensors; may be exchanged.
    T_map_base : SE2
        First pose.
    seed : numpy.random.SeedSequence
        Source of all randomness.
    """

    def __init__(
        self,
        floor: Floor,
        kobuki: Kobuki,
        rig: Rig,
        T_map_base: SE2,
        seed: np.random.SeedSequence,
    ) -> None:
        # Separate streams: a change of the sensor noise must not change the path of the robot.
        wheels, beams, script, crowd = (np.random.default_rng(child) for child in seed.spawn(4))
        self.floor = floor
        self.robot = Robot(kobuki, floor, T_map_base, wheels)
        self.planner = Planner(floor, kobuki.radius_m + _MARGIN_M)
        self.people = People(floor, crowd)
        self.rng = script
        self.rig = rig
        self._beams = beams
        self._ticks = 0
        self._disturbance: Disturbance | None = None

    def disturbed(self, by: Disturbance) -> None:
        """Attach a disturbance to the next moment."""
        self._disturbance = by

    def step(
        self, phase: str, command: Command = at_rest, hands: NDArray[np.float64] = NOBODY
    ) -> Moment:
        """Advance to the next scan.

        Parameters
        ----------
        phase : str
            Name of the phase, for people.
        command : Command
            The motion of the robot meanwhile.
        hands : ndarray, shape (n, 3)
            Circles that move with the robot: x, y in the base frame, radius; m.
        """
        stamp, T_map_base = self.stamp, self.robot.T_map_base
        circles = np.concatenate(
            [self.people.circles, np.column_stack([T_map_base.apply(hands[:, :2]), hands[:, 2]])]
        )
        events: list[Event] = []
        for _ in range(_STEPS):
            events.extend(self.robot.signals(self.stamp))
            events.append(Odometry(self.stamp, self.robot.T_odom_base))
            self._tick(command)
        # A scan has the stamp of its first beam, though it is complete only with its last.
        beginning = sum(event.stamp == stamp for event in events)
        events[beginning:beginning] = self._scans(stamp, T_map_base, circles)
        return self._end(stamp, events, T_map_base, phase)

    def _scans(
        self, stamp: float, T_map_base: SE2, circles: NDArray[np.float64]
    ) -> list[LaserScan]:
        """Take one scan of each sensor, begun at a pose and ended at the present one."""
        return [
            *self.rig.sweeps(
                self.floor, T_map_base, self.robot.T_map_base, self._beams, stamp, circles
            )
        ]

    def step_silently(self, phase: str) -> Moment:
        """Advance as far with nothing reported."""
        stamp, T_map_base = self.stamp, self.robot.T_map_base
        for _ in range(_STEPS):
            self._tick(at_rest)
        return self._end(stamp, [], T_map_base, phase)

    def _tick(self, command: Command) -> None:
        self.robot.drive(*command(self.robot.T_map_base), 1.0 / ODOMETRY_HZ)
        self._ticks += 1

    def _end(self, stamp: float, events: list[Event], T_map_base: SE2, phase: str) -> Moment:
        self.people.walk(self.robot.T_map_base, PERIOD_S)
        disturbance, self._disturbance = self._disturbance, None
        return Moment(stamp, tuple(events), T_map_base, phase, disturbance)

    @property
    def stamp(self) -> float:
        """The time, s."""
        return self._ticks / ODOMETRY_HZ
