"""Ways in which a robot that wakes up can come by its pose: the paper's, those before it, ours."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import FilterState
from firstfix.amcl.initial import around_pose, over_free_space
from firstfix.amcl.particles import Particles
from firstfix.amcl.tracker import Track, Tracker
from firstfix.core.estimate import Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.experiments.drive import Drive, Sight
from firstfix.lab.experiments.drive_tracking import GIVEN_START, make_tracker, spread

# How far a person who points at a map is off.
HAND_SIGMA_M = 0.3
HAND_SIGMA_RAD = math.radians(10.0)

# The covariance of the static stage is that of one scan in a perfect map; a filter begins wider.
_HANDED_OVER = spread(0.05, 2.0)

# A belief is sure of a place that has nine tenths of it and is known to half a metre (the
# distance at which ROS calls its filter converged).
_SURE_SHARE = 0.9
_SURE_M = 0.5

# Enough to see a cloud in a picture.
_KEPT_PARTICLES = 400
NO_CLOUD: NDArray[np.float64] = np.empty((0, 3))


class Start(Enum):
    """How a robot comes by its first pose; the values are the words of tables."""

    BY_HAND = "by hand"
    DEFAULT_POSE = "default pose"
    UNIFORM = "uniform"
    PAPER = "paper"
    FAST = "fast"
    SYSTEM = "system"


WORDS = {
    Start.BY_HAND: "a person points at the map (sigma 0.3 m, 10°), then AMCL",
    Start.DEFAULT_POSE: "AMCL begins at (0, 0, 0), as ROS does",
    Start.UNIFORM: "AMCL begins with particles over all free space",
    Start.PAPER: "the paper's static stage gives the pose of the first scan to AMCL",
    Start.FAST: "the default static stage gives AMCL the pose of the first scan that is UNIQUE",
    Start.SYSTEM: "the whole system (`Localizer`): several places are followed until one has won",
}


@dataclass(frozen=True, slots=True)
class Belief:
    """Where a robot was, and was believed to be, at one scan.

    Parameters
    ----------
    stamp : float
        Time, s.
    truth : SE2
        ``T_map_base``.
    T_map_base : SE2 or None
        The pose believed in; None while there is none.
    sure : bool
        True if it would be acted upon.
    cpu_s : float
        Processor time of this scan, s.
    """

    stamp: float
    truth: SE2
    T_map_base: SE2 | None
    sure: bool
    cpu_s: float


@dataclass(frozen=True, eq=False, slots=True)
class Attempt:
    """One drive, begun in one way.

    Parameters
    ----------
    start : Start
        The way.
    prepare_s : float
        Processor time that preparing the map took, s.
    beliefs : tuple of Belief
        One for each scan.
    first_cloud, last_cloud : ndarray, shape (n, 3)
        Some of the particles at the beginning and at the end: x (m), y (m), yaw (rad).
    """

    start: Start
    prepare_s: float
    beliefs: tuple[Belief, ...]
    first_cloud: NDArray[np.float64]
    last_cloud: NDArray[np.float64]


Beginning = Callable[[Sight], Particles | None]
"""The belief to begin with at a scan; None if that scan does not tell."""


def attempt(start: Start, drive: Drive, grid: OccupancyGrid, seed: int) -> Attempt:
    """Begin a drive in one way and follow it with AMCL under Nav2's default parameters.

    Parameters
    ----------
    start : Start
        Any but `Start.SYSTEM`, which is more than a filter that was begun somewhere.
    drive : Drive
        Scans with odometry and truth.
    grid : OccupancyGrid
        The map.
    seed : int
        Of all randomness.

    Returns
    -------
    Attempt
        What was believed, scan by scan.
    """
    config, rng = AmclConfig(), np.random.default_rng(seed)
    began = time.process_time()
    tracker = make_tracker(grid, config)
    beginning = _beginning(start, grid, config.max_particles, rng)
    prepare_s = time.process_time() - began
    beliefs, first, last = [], NO_CLOUD, NO_CLOUD
    for belief, track in _follow(drive, tracker, beginning, config, rng):
        beliefs.append(belief)
        if track is not None:
            last = cloud_of(track.state.particles)
            first = first if len(first) else last
    return Attempt(start, prepare_s, tuple(beliefs), first, last)


def cloud_of(particles: Particles) -> NDArray[np.float64]:
    """Return some of the particles, evenly chosen, for a picture; shape (n, 3)."""
    return particles.poses()[:: math.ceil(len(particles) / _KEPT_PARTICLES)]


def _follow(
    drive: Drive,
    tracker: Tracker,
    beginning: Beginning,
    config: AmclConfig,
    rng: np.random.Generator,
) -> Iterator[tuple[Belief, Track | None]]:
    track: Track | None = None
    tried_at: SE2 | None = None
    for sight in drive.sights:
        assert sight.truth is not None  # noqa: S101 - said in `attempt`
        cpu = time.thread_time()
        if track is not None:
            track = tracker.follow(track, sight.T_odom_base, sight.scan, rng)
        elif tried_at is None or _moved_on(tried_at, sight.T_odom_base, config):
            tried_at = sight.T_odom_base
            particles = beginning(sight)
            if particles is not None:
                track = tracker.begin(particles, sight.T_odom_base, sight.scan, rng)
        cpu_s = time.thread_time() - cpu
        stamp, truth = sight.scan.stamp, sight.truth
        if track is None:
            yield Belief(stamp, truth, None, sure=False, cpu_s=cpu_s), None
            continue
        T_map_base = track.T_map_odom @ sight.T_odom_base
        yield Belief(stamp, truth, T_map_base, _is_sure(track.state), cpu_s), track


def _moved_on(before: SE2, now: SE2, config: AmclConfig) -> bool:
    moved = before.inverse() @ now
    far = math.hypot(moved.x, moved.y) >= config.update_min_d
    return far or abs(moved.yaw) >= config.update_min_a


def _is_sure(state: FilterState) -> bool:
    spread_m = math.sqrt(float(np.linalg.eigvalsh(state.estimate.covariance[:2, :2])[-1]))
    return 1.0 - state.elsewhere >= _SURE_SHARE and spread_m < _SURE_M


def _beginning(start: Start, grid: OccupancyGrid, n: int, rng: np.random.Generator) -> Beginning:
    if start is Start.UNIFORM:
        return lambda _: over_free_space(grid, n, rng)
    if start is Start.DEFAULT_POSE:
        return lambda _: around_pose(SE2.identity(), GIVEN_START, n, rng)
    if start is Start.BY_HAND:
        return lambda sight: around_pose(_pointed_at(sight, rng), GIVEN_START, n, rng)
    if start is Start.PAPER:
        return _by_paper(ScanMatcher(grid, method=Method.PAPER), n, rng)
    if start is Start.FAST:
        return _when_unique(ScanMatcher(grid), n, rng)
    raise ValueError(start)


def _pointed_at(sight: Sight, rng: np.random.Generator) -> SE2:
    assert sight.truth is not None  # noqa: S101 - said in `attempt`
    error = rng.standard_normal(3) * [HAND_SIGMA_M, HAND_SIGMA_M, HAND_SIGMA_RAD]
    return SE2.from_array(sight.truth.as_array() + error)


def _by_paper(matcher: ScanMatcher, n: int, rng: np.random.Generator) -> Beginning:
    def begin(sight: Sight) -> Particles | None:
        best = matcher.locate(sight.scan).best
        return around_pose(best.pose, GIVEN_START, n, rng) if best is not None else None

    return begin


def _when_unique(matcher: ScanMatcher, n: int, rng: np.random.Generator) -> Beginning:
    def begin(sight: Sight) -> Particles | None:
        result = matcher.locate(sight.scan)
        best = result.best
        if best is None or result.verdict is not Verdict.UNIQUE:
            return None
        return around_pose(best.pose, best.covariance + _HANDED_OVER, n, rng)

    return begin
