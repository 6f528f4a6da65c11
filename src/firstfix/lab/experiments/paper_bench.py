"""The paper's experiments: the same simulated drives, begun in different ways.

The ways are the paper's, those that were usual before it, and ours.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import FilterState
from firstfix.amcl.initial import around_pose, over_free_space
from firstfix.amcl.particles import Particles
from firstfix.amcl.tracker import Track, Tracker
from firstfix.core.estimate import Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.experiments.case import truth_at
from firstfix.lab.experiments.drive import Drive, Sight, plan_drive
from firstfix.lab.experiments.drive_tracking import GIVEN_START, make_tracker, spread
from firstfix.lab.metrics.paper_trial import (
    NO_CLOUD,
    Attempt,
    Belief,
    Ending,
    Start,
    Trial,
    judge_attempt,
)
from firstfix.lab.reports.paper_picture import Shown
from firstfix.lab.scenarios.phases import Stand, Wander
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.recorder import record
from firstfix.lab.worlds.catalog import WORLDS, random_free_pose
from firstfix.lab.worlds.paper_rooms import laboratory, two_corridors
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Output, TrackedPose
from firstfix.localizer.precompile import precompile
from firstfix.localizer.replay import replay

PAPER_WORLDS: dict[str, Callable[[], OccupancyGrid]] = {
    "laboratory": laboratory,
    "two-corridors": two_corridors,
    **WORLDS,
}

# The paper's robot was driven for a while; a minute at 0.4 m/s is about 20 m.
DRIVE_S = 60.0
_STANDS_S = 1.0

# Error of a person who points at a map.
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

Beginning = Callable[[Sight], Particles | None]
"""The particles to begin with at a scan; None if the scan does not give a pose."""


def attempt(start: Start, drive: Drive, grid: OccupancyGrid, seed: int) -> Attempt:
    """Track a drive with AMCL under Nav2's default parameters, from one kind of start.

    ``start`` is any but `Start.SYSTEM`; the drive has odometry and true poses.
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
        assert sight.truth is not None  # noqa: S101 - ensured by `attempt`
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
    assert sight.truth is not None  # noqa: S101 - ensured by `attempt`
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


@dataclass(frozen=True, eq=False, slots=True)
class PaperResult:
    """One world: its trials, and what to draw of it."""

    world: str
    trials: tuple[Trial, ...]
    shown: Shown


@dataclass(frozen=True, slots=True)
class PaperTask:
    """Drive in one world, once for each seed, and start every drive in every way."""

    world: str
    seeds: tuple[int, ...]
    drive_s: float = DRIVE_S

    def __call__(self) -> PaperResult:
        """Run in this process."""
        precompile(methods=[Method.PAPER])
        grid = at_home(PAPER_WORLDS[self.world]())
        trials: list[Trial] = []
        shown_drives: list[tuple[int, Shown]] = []
        for seed in self.seeds:
            recording = simulated_drive(grid, seed, self.drive_s)
            attempts = _attempts(recording, grid, seed)
            judged = [judge_attempt(self.world, seed, tried) for tried in attempts]
            trials += judged
            shown = Shown(self.world, seed, grid, recording.scans, attempts)
            shown_drives.append((_differences(judged), shown))
        _, most_telling = max(shown_drives, key=lambda shown: shown[0])
        return PaperResult(self.world, tuple(trials), most_telling)


def at_home(grid: OccupancyGrid) -> OccupancyGrid:
    """Move the origin of the map frame to a free place, where a mapping run would have begun.

    The drawn buildings have theirs in a corner, where no robot can be: AMCL's default pose would
    be impossible instead of merely wrong.
    """
    home = random_free_pose(grid, np.random.default_rng(0))
    return replace(grid, T_map_grid=SE2(-home.x, -home.y, 0.0) @ grid.T_map_grid)


def simulated_drive(grid: OccupancyGrid, seed: int, seconds: float) -> Recording:
    """Simulate a robot that wakes up at a random pose and drives from goal to goal (s)."""
    return record(run(Scenario([Stand(_STANDS_S), Wander(seconds - _STANDS_S)]), grid, seed))


def follow_with_system(recording: Recording, grid: OccupancyGrid) -> Attempt:
    """Replay a drive with known truth to a new localizer."""
    began = time.process_time()
    localizer = Localizer()
    localizer.handle(NewMap(0.0, grid))
    prepare_s = time.process_time() - began
    beliefs: list[Belief] = []
    first = last = NO_CLOUD
    outputs: list[Output] = []
    began = time.process_time()
    for given, answers in replay(recording.messages(), localizer):
        outputs += answers
        if not isinstance(given, LaserScan):
            continue
        cpu_s = time.process_time() - began
        truth = truth_at(recording, len(beliefs))
        assert truth is not None  # noqa: S101 - the simulation knows it
        poses = [output.T_map_base for output in outputs if isinstance(output, TrackedPose)]
        pose = poses[-1] if poses else None
        beliefs.append(Belief(given.stamp, truth, pose, pose is not None, cpu_s))
        if localizer.particles is not None:
            last = cloud_of(localizer.particles)
            first = first if len(first) else last
        outputs = []
        began = time.process_time()
    return Attempt(Start.SYSTEM, prepare_s, tuple(beliefs), first, last)


def _attempts(recording: Recording, grid: OccupancyGrid, seed: int) -> tuple[Attempt, ...]:
    drive = plan_drive(recording, None)
    filters = [start for start in Start if start is not Start.SYSTEM]
    followed = [attempt(start, drive, grid, seed) for start in filters]
    return (*followed, follow_with_system(recording, grid))


def _differences(judged: Sequence[Trial]) -> int:
    """Count the starts that end wrong, if others end right: how instructive a drive is."""
    wrong = sum(trial.ending is Ending.WRONG for trial in judged)
    return wrong if any(trial.ending is Ending.RIGHT for trial in judged) else 0
