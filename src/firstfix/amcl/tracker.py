"""Tracking: when to update the filter, and the pose between updates."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import FilterState, Injection, start, step
from firstfix.amcl.particles import Particles
from firstfix.amcl.sensor import Sensor
from firstfix.core.scan import Scans
from firstfix.core.se2 import SE2


@dataclass(frozen=True, eq=False, slots=True)
class Track:
    """A belief, and the odometry at which it holds.

    Parameters
    ----------
    state : FilterState
        The belief at the last update.
    T_odom_base : SE2
        Odometry at the last update.
    """

    state: FilterState
    T_odom_base: SE2

    @property
    def T_map_odom(self) -> SE2:
        """Drift of the odometry: ``T_map_odom @ T_odom_base`` is the robot's pose now."""
        return self.state.estimate.pose @ self.T_odom_base.inverse()


class Tracker:
    """Tracks a robot in one map by AMCL.

    Parameters
    ----------
    sensor : Sensor
        The sensor model with its map.
    config : AmclConfig
        Settings.
    inject : callable
        Where new particles come from (`firstfix.amcl.filter.Injection`).
    """

    def __init__(self, sensor: Sensor, config: AmclConfig, inject: Injection) -> None:
        self._sensor = sensor
        self._config = config
        self._inject = inject

    def begin(
        self, particles: Particles, T_odom_base: SE2, scans: Scans, rng: np.random.Generator
    ) -> Track:
        """Start with a belief and update it by a first scan.

        Parameters
        ----------
        particles : Particles
            The belief.
        T_odom_base : SE2
            Odometry at the scan.
        scans : LaserScan or sequence of LaserScan
            The first scan, or one of each sensor.
        rng : numpy.random.Generator
            Source of randomness.

        Returns
        -------
        Track
            After one update.
        """
        return self.update(Track(start(particles), T_odom_base), T_odom_base, scans, rng)

    def follow(
        self, track: Track, T_odom_base: SE2, scans: Scans, rng: np.random.Generator
    ) -> Track:
        """Update by a scan if the robot has moved enough since the last update.

        Parameters
        ----------
        track : Track
            The track so far.
        T_odom_base : SE2
            Odometry at the scan.
        scans : LaserScan or sequence of LaserScan
            The next scan, or one of each sensor.
        rng : numpy.random.Generator
            Source of randomness.

        Returns
        -------
        Track
            After the update; the same object if there was none.
        """
        moved = track.T_odom_base.inverse() @ T_odom_base
        far = math.hypot(moved.x, moved.y) >= self._config.update_min_d
        turned = abs(moved.yaw) >= self._config.update_min_a
        return self.update(track, T_odom_base, scans, rng) if far or turned else track

    def update(
        self, track: Track, T_odom_base: SE2, scans: Scans, rng: np.random.Generator
    ) -> Track:
        """Update by a scan in any case (Nav2: a no-motion update). Arguments as in `follow`."""
        increment = track.T_odom_base.inverse() @ T_odom_base
        state = step(track.state, increment, scans, self._sensor, rng, self._config, self._inject)
        return Track(state, T_odom_base)
