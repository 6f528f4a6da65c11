"""One step of the particle filter, as in the textbook."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.beam_selection import select_beams
from firstfix.amcl.clusters import Cluster, find_clusters
from firstfix.amcl.config import AmclConfig, MotionModel
from firstfix.amcl.kld import adapted_size
from firstfix.amcl.motion import propagate
from firstfix.amcl.particles import Particles, equal_weights
from firstfix.amcl.recovery import WeightHistory
from firstfix.amcl.resampling import systematic
from firstfix.amcl.sensor import Sensor, weigh
from firstfix.core.scan import LaserScan, Scans, as_scans
from firstfix.core.se2 import SE2

Injection = Callable[[tuple[LaserScan, ...], int, np.random.Generator], NDArray[np.float64]]
"""Draws poses for the scans of one time: x (m), y (m), yaw (rad) in the map, shape (n, 3)."""

# At rest no motion noise separates the copies of a particle, and the belief would shrink to a few
# points. Scans at rest are redundant, so particles are spread by about the error of map and sensor
# (roughening: Gordon, Salmond & Smith 1993).
_REST_M = 0.01
_REST_RAD = math.radians(0.5)


@dataclass(frozen=True, eq=False, slots=True)
class FilterState:
    """State of the filter between two scans.

    Parameters
    ----------
    particles : Particles
        The belief.
    clusters : tuple of Cluster
        Its places, heaviest first.
    history : WeightHistory
        Running averages of how well it explains the scans.
    updates : int
        Number of scans used.
    """

    particles: Particles
    clusters: tuple[Cluster, ...]
    history: WeightHistory
    updates: int

    @property
    def estimate(self) -> Cluster:
        """The heaviest place."""
        return self.clusters[0]

    @property
    def elsewhere(self) -> float:
        """Share of the belief that is not in the heaviest place, 0 to 1."""
        return max(0.0, 1.0 - self.clusters[0].mass)


def start(particles: Particles) -> FilterState:
    """Begin with a belief.

    Parameters
    ----------
    particles : Particles
        From `firstfix.amcl.initial`.

    Returns
    -------
    FilterState
        The state before the first scan.
    """
    return FilterState(particles, find_clusters(particles, particles.weight), WeightHistory(), 0)


def step(
    state: FilterState,
    increment: SE2,
    scans: Scans,
    sensor: Sensor,
    rng: np.random.Generator,
    config: AmclConfig,
    inject: Injection,
) -> FilterState:
    """Propagate, reweight, estimate, inject, resample.

    Thrun, Burgard & Fox, "Probabilistic Robotics" (2005), tables 8.2 and 8.3; Fox 2003 for the
    number of particles. The estimate is taken before resampling, which could only add noise to it.

    Parameters
    ----------
    state : FilterState
        The state before.
    increment : SE2
        Odometry since the last step: pose of the base now in the base frame of then.
    scans : LaserScan or sequence of LaserScan
        What the sensor, or each of several, sees now.
    sensor : Sensor
        The sensor model with its map.
    rng : numpy.random.Generator
        Source of randomness.
    config : AmclConfig
        Settings.
    inject : callable
        Where new particles come from, if recovery_alpha_slow and _fast ask for some.

    Returns
    -------
    FilterState
        The state after.
    """
    particles = propagate(state.particles, increment, config, rng)
    if _at_rest(increment, config):
        particles = _roughened(particles, rng)
    scans = as_scans(scans)
    likelihood, fit = weigh(particles, [select_beams(scan, config) for scan in scans], sensor)
    particles = particles.reweighed(likelihood)
    # A wall on one side truncates the belief there, and its mean lies off its mode. Estimate the
    # mean from weights with the scan applied twice, which moves it towards the mode.
    clusters = find_clusters(particles, particles.reweighed(likelihood).weight)
    history = state.history if math.isnan(fit) else state.history.after(fit, config)
    updates = state.updates + 1
    if updates % config.resample_interval == 0:
        fresh = np.empty((0, 3))
        if history.injected_share > 0.0:
            fresh = inject(scans, round(history.injected_share * len(particles)), rng)
            history = WeightHistory()  # or it would inject at every scan until no particle is left
        particles = _resampled(particles, fresh, config, rng)
    return FilterState(particles, clusters, history, updates)


def _resampled(
    particles: Particles,
    fresh: NDArray[np.float64],
    config: AmclConfig,
    rng: np.random.Generator,
) -> Particles:
    """Draw as many particles as their spread needs; the fresh ones replace as many of them."""
    if (
        config.selective_resampling
        and len(fresh) == 0
        and particles.effective >= len(particles) / 2.0
    ):
        return particles
    n = adapted_size(particles, config, rng)
    drawn = particles.drawn(systematic(particles.weight, n, rng))
    if len(fresh) == 0:
        return drawn
    poses = drawn.poses()
    replaced = rng.permutation(n)[: len(fresh)]
    poses[replaced] = fresh[: len(replaced)]
    return equal_weights(poses)


def _at_rest(increment: SE2, config: AmclConfig) -> bool:
    if config.robot_model_type is MotionModel.STATIONARY:
        return True
    return math.hypot(increment.x, increment.y) < _REST_M and abs(increment.yaw) < _REST_RAD


def _roughened(particles: Particles, rng: np.random.Generator) -> Particles:
    noise = rng.standard_normal((len(particles), 3)) * [_REST_M, _REST_M, _REST_RAD]
    moved = equal_weights(particles.poses() + noise)
    return Particles(moved.x, moved.y, moved.yaw, particles.weight)
