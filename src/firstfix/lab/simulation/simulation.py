"""Where a scenario plays: the robot, its sensors and the clock, moved on by one scan at a time."""

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
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.people import People
from firstfix.lab.simulation.planner import Planner
from firstfix.lab.simulation.robot import Kobuki, Robot
from firstfix.lab.simulation.sweep import NOBODY, sweep

SCAN_HZ = 10
ODOMETRY_HZ = 50
PERIOD_S = 1.0 / SCAN_HZ

_STEPS = ODOMETRY_HZ // SCAN_HZ
# A planned way keeps so much more room than the robot needs, which does not follow it exactly.
_MARGIN_M = 0.05

Command = Callable[[SE2], tuple[float, float]]
"""From where the robot is (``T_map_base``) to what it shall do: v (m/s) and w (rad/s)."""

Event = LaserScan | Odometry | Signal


class Shutter(Enum):
    """When the beams of a scan are measured."""

    AT_ONCE = "at once"
    ROLLING = "rolling"  # one after another, while the sensor turns: motion skews the scan


class Disturbance(Enum):
    """What happened to a robot that its wheels know nothing about, or too much."""

    TELEPORTED = "teleported"
    CARRIED = "carried"
    PUSHED = "pushed"
    SLIPPED = "slipped"


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What a robot reports from one scan to the next, and where it truly is.

    Parameters
    ----------
    stamp : float
        Time of the scan, s.
    events : tuple of LaserScan, Odometry or Signal
        In the order of their stamps; odometry comes before a scan of the same stamp.
    T_map_base : SE2
        The truth at `stamp`.
    phase : str
        Which phase of the scenario this is, for people.
    disturbance : Disturbance or None
        What was over just before `stamp`, if anything.
    """

    stamp: float
    events: tuple[Event, ...]
    T_map_base: SE2
    phase: str
    disturbance: Disturbance | None = None

    @property
    def scan(self) -> LaserScan | None:
        """The scan; None in a pause."""
        return next((event for event in self.events if isinstance(event, LaserScan)), None)


def at_rest(T_map_base: SE2) -> tuple[float, float]:
    """Command nothing, wherever the robot is."""
    del T_map_base
    return 0.0, 0.0


class Simulation:
    """The state of a running simulation.

    Parameters
    ----------
    floor : Floor
        Walls and furniture.
    kobuki : Kobuki
        The robot's kind.
    lidar : Lidar
        Its sensor.
    shutter : Shutter
        When the sensor measures its beams.
    T_map_base : SE2
        Where it stands at first.
    seed : numpy.random.SeedSequence
        Source of all chance.
    """

    def __init__(
        self,
        floor: Floor,
        kobuki: Kobuki,
        lidar: Lidar,
        shutter: Shutter,
        T_map_base: SE2,
        seed: np.random.SeedSequence,
    ) -> None:
        # Streams of their own: another noise of the sensor must not send the robot elsewhere.
        wheels, beams, script, whims = (np.random.default_rng(child) for child in seed.spawn(4))
        self.floor = floor
        self.robot = Robot(kobuki, floor, T_map_base, wheels)
        self.planner = Planner(floor, kobuki.radius_m + _MARGIN_M)
        self.people = People(floor, whims)
        self.rng = script
        self.lidar = lidar
        self._shutter = shutter
        self._beams = beams
        self._ticks = 0
        self._disturbance: Disturbance | None = None

    def disturbed(self, by: Disturbance) -> None:
        """Note what has just happened, for the next moment."""
        self._disturbance = by

    def step(
        self, phase: str, command: Command = at_rest, hands: NDArray[np.float64] = NOBODY
    ) -> Moment:
        """Go on to the next scan.

        Parameters
        ----------
        phase : str
            What this is, for people.
        command : Command
            What the robot does meanwhile.
        hands : ndarray, shape (n, 3)
            Circles around the robot that go with it: x, y in the base frame, radius; m.

        Returns
        -------
        Moment
            What was reported.
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
        scan = sweep(
            self.lidar,
            self.floor,
            T_map_base,
            self._beams,
            stamp=stamp,
            circles=circles,
            T_map_base_after=self.robot.T_map_base if self._shutter is Shutter.ROLLING else None,
        )
        # A scan has the stamp of its first beam, though it is complete only with its last.
        beginning = sum(event.stamp == stamp for event in events)
        events.insert(beginning, scan)
        return self._end(stamp, events, T_map_base, phase)

    def step_silently(self, phase: str) -> Moment:
        """Go on as far, with nothing reported at all."""
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
