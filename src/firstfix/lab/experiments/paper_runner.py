"""A simulated robot wakes up in the worlds of ``bench --suite paper``, and its pose is sought."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.case import truth_at
from firstfix.lab.experiments.drive import plan_drive
from firstfix.lab.experiments.paper_suite import Ending, Trial, judge_attempt
from firstfix.lab.experiments.starts import NO_CLOUD, Attempt, Belief, Start, attempt, cloud_of
from firstfix.lab.reports.paper_picture import Shown
from firstfix.lab.scenarios.phases import Stand, Wander
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.recorder import record
from firstfix.lab.worlds.catalog import WORLDS, random_free_pose
from firstfix.lab.worlds.paper_rooms import laboratory, two_corridors
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Output, TrackedPose
from firstfix.localizer.precompile import small_room
from firstfix.localizer.replay import replay

PAPER_WORLDS: dict[str, Callable[[], OccupancyGrid]] = {
    "laboratory": laboratory,
    "two-corridors": two_corridors,
    **WORLDS,
}

# The paper's robot was driven for a while; a minute at 0.4 m/s is about 20 m.
DRIVE_S = 60.0
_STANDS_S = 1.0


@dataclass(frozen=True, eq=False, slots=True)
class Played:
    """One world: its trials, and what to draw of it."""

    world: str
    trials: tuple[Trial, ...]
    shown: Shown


@dataclass(frozen=True, slots=True)
class PaperTask:
    """Drive in one world, once for each seed, and begin every drive in every way."""

    world: str
    seeds: tuple[int, ...]
    drive_s: float = DRIVE_S

    def __call__(self) -> Played:
        """Play in this process."""
        _attempts(simulated_drive(small_room(), 0, 3.0), small_room(), 0)  # compiles all kernels
        grid = at_home(PAPER_WORLDS[self.world]())
        trials: list[Trial] = []
        stories: list[tuple[int, Shown]] = []
        for seed in self.seeds:
            recording = simulated_drive(grid, seed, self.drive_s)
            attempts = _attempts(recording, grid, seed)
            judged = [judge_attempt(self.world, seed, tried) for tried in attempts]
            trials += judged
            shown = Shown(self.world, seed, grid, recording.scans, attempts)
            stories.append((_differences(judged), shown))
        _, most_telling = max(stories, key=lambda story: story[0])
        return Played(self.world, tuple(trials), most_telling)


def at_home(grid: OccupancyGrid) -> OccupancyGrid:
    """Move the origin of the map frame to a free place, where a mapping run would have begun.

    The drawn buildings have theirs in a corner, where no robot can be: AMCL's default pose would
    be impossible instead of merely wrong.
    """
    home = random_free_pose(grid, np.random.default_rng(0))
    return replace(grid, T_map_grid=SE2(-home.x, -home.y, 0.0) @ grid.T_map_grid)


def simulated_drive(grid: OccupancyGrid, seed: int, seconds: float) -> Recording:
    """Let a robot wake up somewhere and drive from goal to goal for a time (s)."""
    return record(run(Scenario([Stand(_STANDS_S), Wander(seconds - _STANDS_S)]), grid, seed))


def follow_with_system(recording: Recording, grid: OccupancyGrid) -> Attempt:
    """Let a new localizer live through a drive whose truth is known."""
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
    """Tell how much a drive has to show: ways that end wrong although others end right."""
    wrong = sum(trial.ending is Ending.WRONG for trial in judged)
    return wrong if any(trial.ending is Ending.RIGHT for trial in judged) else 0
