"""Plain AMCL beside the localizer: what the robot would believe without global localization."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.initial import around_pose, free_poses, over_free_space
from firstfix.amcl.sensor import build_sensor
from firstfix.amcl.tracker import Track, Tracker
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.simulation import Event
from firstfix.web.snapshot import AmclEstimate, AmclStart

# Nav2's defaults: its initial covariance, and no recovery.
_START_COVARIANCE = np.diag([0.25, 0.25, math.radians(15.0) ** 2])


class PlainAmcl:
    """Textbook AMCL with Nav2's defaults in one map; wheel-drop sensors mean nothing to it.

    It costs one update of at most 2000 particles and 60 beams for each 0.25 m or 0.2 rad.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    start : AmclStart
        Where it starts, at the first scan for which a start is known.
    """

    def __init__(self, grid: OccupancyGrid, start: AmclStart) -> None:
        self.start = start
        self._grid = grid
        self._config = AmclConfig()
        self._rng = np.random.default_rng(self._config.seed)
        self._tracker = Tracker(build_sensor(grid, self._config), self._config, self._draw)
        self._track: Track | None = None
        self._T_odom_base: SE2 | None = None

    def follow(self, events: Iterable[Event], T_map_base: SE2 | None) -> None:
        """Take the reports of the robot.

        Parameters
        ----------
        events : iterable of LaserScan, Odometry or Signal
            In the order of their stamps.
        T_map_base : SE2 or None
            The last known pose, to start from; None if none is known.
        """
        for event in events:
            if isinstance(event, Odometry):
                self._T_odom_base = event.T_odom_base
            elif isinstance(event, LaserScan) and self._T_odom_base is not None:
                self._take_scan(event, self._T_odom_base, T_map_base)

    @property
    def estimate(self) -> AmclEstimate | None:
        """The heaviest cluster, moved by odometry since its update; None before the start."""
        if self._track is None or self._T_odom_base is None:
            return None
        cluster = self._track.state.estimate
        return AmclEstimate(self._track.T_map_odom @ self._T_odom_base, cluster.covariance)

    def _take_scan(self, scan: LaserScan, T_odom_base: SE2, T_map_base: SE2 | None) -> None:
        if self._track is not None:
            self._track = self._tracker.follow(self._track, T_odom_base, scan, self._rng)
            return
        n = self._config.max_particles
        if self.start is AmclStart.UNIFORM:
            particles = over_free_space(self._grid, n, self._rng)
        elif T_map_base is not None:
            particles = around_pose(T_map_base, _START_COVARIANCE, n, self._rng)
        else:
            return
        self._track = self._tracker.begin(particles, T_odom_base, scan, self._rng)

    def _draw(
        self, _: tuple[LaserScan, ...], n: int, rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Draw from free space; Nav2 recovers only where its recovery is switched on."""
        return free_poses(self._grid, n, rng)
