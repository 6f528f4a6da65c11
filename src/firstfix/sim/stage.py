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
from firstfix.sim.floor import Floor
from firstfix.sim.lidar import Lidar
from firstfix.sim.planner import Planner
from firstfix.sim.robot import Kobuki, Robot
from firstfix.sim.sweep import NOBODY, sweep

SCAN_HZ = 10
ODOMETRY_HZ = 50
PERIOD_S = 1.0 / SCAN_HZ

_STEPS = ODOMETRY_HZ // SCAN_HZ
# A planned way keeps so much more room than the robot needs, which does not follow it exactly.
_MARGIN_M = 0.05

Command = Callable[[SE2], tuple[float, float]]
"""From where the robot is (``T_map_base``) to what it shall do: v (m/s) and w (rad/s)."""

Event = LaserScan | Odometry | Signal


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


def at_rest(T_map_base: SE2) -> tuple[float, float]:
    """Command nothing, wherever the robot is."""
    del T_map_base
    return 0.0, 0.0


class Stage:
    """The state of a running simulation.

    Parameters
    ----------
    floor : Floor
        Walls and furniture.
    kobuki : Kobuki
        The robot's kind.
    lidar : Lidar
        Its sensor.
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
        T_map_base: SE2,
        seed: np.random.SeedSequence,
    ) -> None:
        # Streams of their own: another noise of the sensor must not send the robot elsewhere.
        wheels, beams, script = (np.random.default_rng(child) for child in seed.spawn(3))
        self.floor = floor
        self.robot = Robot(kobuki, floor, T_map_base, wheels)
        self.planner = Planner(floor, kobuki.radius_m + _MARGIN_M)
        self.rng = script
        self._lidar = lidar
        self._beams = beams
        self._ticks = 0
        self._disturbance: Disturbance | None = None

    def disturbed(self, by: Disturbance) -> None:
        """Note what has just happened, for the next moment."""
        self._disturbance = by

    def moment(
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
        stamp, T_map_base = self._stamp, self.robot.T_map_base
        circles = np.column_stack([T_map_base.apply(hands[:, :2]), hands[:, 2]])
        scan = sweep(self._lidar, self.floor, T_map_base, self._beams, stamp=stamp, circles=circles)
        events: list[Event] = []
        for step in range(_STEPS):
            events.extend(self.robot.signals(self._stamp))
            events.append(Odometry(self._stamp, self.robot.T_odom_base))
            if step == 0:
                events.append(scan)
            self.robot.drive(*command(self.robot.T_map_base), 1.0 / ODOMETRY_HZ)
            self._ticks += 1
        disturbance, self._disturbance = self._disturbance, None
        return Moment(stamp, tuple(events), T_map_base, phase, disturbance)

    @property
    def _stamp(self) -> float:
        return self._ticks / ODOMETRY_HZ
