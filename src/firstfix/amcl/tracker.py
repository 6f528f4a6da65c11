"""Tracking: when to update the filter, and the pose between updates."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import FilterState, Injection, start, step
from firstfix.amcl.particles import Particles
from firstfix.amcl.sensor import Sensor
from firstfix.core.scan import Scans
from firstfix.core.se2 import SE2

# Steps that two scans confirm are known twice as well; the alphas are variances. Chosen on the real
# drives of docs/experiments.md.
_CONFIRMED_ALPHAS = 0.25


@dataclass(frozen=True, eq=False, slots=True)
class Track:
    """A belief, and the odometry at which it holds.

    Parameters
    ----------
    state : FilterState
        The belief at the last update.
    T_odom_base : SE2
        Odometry at the last update.
    unconfirmed : int or None
        Steps of the odometry until then that no two scans have confirmed; None if nobody counts.
    """

    state: FilterState
    T_odom_base: SE2
    unconfirmed: int | None = None

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
        self._confirmed = _with_confirmed_steps(config)
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
        self,
        track: Track,
        T_odom_base: SE2,
        scans: Scans,
        rng: np.random.Generator,
        unconfirmed: int | None = None,
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
        unconfirmed : int, optional
            Steps of the odometry so far that no two scans have confirmed.

        Returns
        -------
        Track
            After the update; the same object if there was none.
        """
        moved = track.T_odom_base.inverse() @ T_odom_base
        far = math.hypot(moved.x, moved.y) >= self._config.update_min_d
        turned = abs(moved.yaw) >= self._config.update_min_a
        if not (far or turned):
            return track
        return self.update(track, T_odom_base, scans, rng, unconfirmed)

    def update(
        self,
        track: Track,
        T_odom_base: SE2,
        scans: Scans,
        rng: np.random.Generator,
        unconfirmed: int | None = None,
    ) -> Track:
        """Update by a scan in any case (Nav2: a no-motion update). Arguments as in `follow`."""
        increment = track.T_odom_base.inverse() @ T_odom_base
        is_confirmed = unconfirmed is not None and unconfirmed == track.unconfirmed
        config = self._confirmed if is_confirmed else self._config
        state = step(track.state, increment, scans, self._sensor, rng, config, self._inject)
        return Track(state, T_odom_base, unconfirmed)


def _with_confirmed_steps(config: AmclConfig) -> AmclConfig:
    share = _CONFIRMED_ALPHAS
    return replace(
        config,
        alpha1=share * config.alpha1,
        alpha2=share * config.alpha2,
        alpha3=share * config.alpha3,
        alpha4=share * config.alpha4,
        alpha5=share * config.alpha5,
    )
