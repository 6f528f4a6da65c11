"""A localizer meets kidnappers: simulated ones, and those who splice drives."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.cache import cache_folder
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.lab.experiments.case import Case, truth_at
from firstfix.lab.experiments.kidnap_bench import KidnapRun, judged_run
from firstfix.lab.experiments.splice import Unfit, splice
from firstfix.lab.metrics.kidnap_trial import SLIP, Instant
from firstfix.lab.scenarios.kidnap_scripts import scripted
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.simulation import Disturbance, Moment
from firstfix.lab.worlds.catalog import WORLDS
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Output, Status, TrackedPose
from firstfix.localizer.precompile import scan_of, small_room
from firstfix.localizer.replay import replay
from firstfix.localizer.states import State

# Kidnaps of one spliced drive: three such drives are a dozen.
SPLICES = 4

_UNDERWAY = {"carry", "slip"}
_KINDS = {
    Disturbance.TELEPORTED: "teleport",
    Disturbance.CARRIED: "carry",
    Disturbance.PUSHED: SLIP,
    Disturbance.SLIPPED: SLIP,
}


@dataclass(frozen=True, eq=False, slots=True)
class Happening:
    """What a robot reports around one scan, and what is true at it.

    Parameters
    ----------
    events : tuple of LaserScan, Odometry or Signal
        In the order of their stamps, with one scan.
    truth : SE2 or None
        ``T_map_base`` at the scan.
    disturbed : bool
        True while something is being done to the robot.
    over : str or None
        The disturbance that was over just before.
    """

    events: tuple[LaserScan | Odometry | Signal, ...]
    truth: SE2 | None
    disturbed: bool = False
    over: str | None = None


@dataclass(frozen=True, slots=True)
class Played:
    """What came of a task: scenarios, or why there are none."""

    name: str
    runs: tuple[KidnapRun, ...]
    left_out: str | None = None


@dataclass(frozen=True, slots=True)
class WorldTask:
    """Play some scenarios in a drawn building, one for each seed."""

    world: str
    seeds: tuple[int, ...]

    def __call__(self) -> Played:
        """Play in this process."""
        _compile_kernels()
        grid = WORLDS[self.world]()
        return Played(self.world, tuple(self._play(grid, seed) for seed in self.seeds))

    def _play(self, grid: OccupancyGrid, seed: int) -> KidnapRun:
        kind, phases = scripted(seed)
        moments = run(Scenario(phases), grid, seed)
        return judged_run(self.world, kind, seed, [*watched(simulated(moments), grid)])


@dataclass(frozen=True, slots=True)
class CaseTask:
    """Play some drives spliced of a case's, one for each seed."""

    case: Case
    seeds: tuple[int, ...]

    def __call__(self) -> Played:
        """Play in this process."""
        _compile_kernels()
        name, recording, grid = self.case.name, self.case.recording(), self.case.grid()
        runs = []
        for seed in self.seeds:
            drive = splice(recording, SPLICES, np.random.default_rng(seed))
            if isinstance(drive, Unfit):
                return Played(name, (), drive.why)
            runs.append(judged_run(name, "splice", seed, [*watched(recorded(drive), grid)]))
        return Played(name, tuple(runs))


def _compile_kernels() -> None:
    """Find and follow a robot in a small room, and lose it."""
    grid, here, there = small_room(), SE2(3.0, 2.5, 0.4), SE2(6.0, 4.5, 2.0)
    seen = [here, here @ SE2(0.3, 0.0, 0.3), there, there]
    odometry = [SE2.identity(), SE2(0.3, 0.0, 0.3), SE2(0.3, 0.0, 0.3), SE2(0.3, 0.0, 0.3)]
    happenings = [
        Happening((Odometry(float(i), T_odom_base), replace(scan_of(grid, pose), stamp=i)), pose)
        for i, (pose, T_odom_base) in enumerate(zip(seen, odometry, strict=True))
    ]
    for _ in watched(happenings, grid):
        pass


def recorded(drive: Recording) -> Iterator[Happening]:
    """Return what happens to the robot of a spliced drive, scan by scan; its runs are pieces."""
    assert drive.odometry is not None  # noqa: S101 - `splice` made it
    assert drive.runs is not None  # noqa: S101
    poses = [SE2.from_array(pose) for pose in drive.odometry.poses]
    seams = np.diff(drive.runs, prepend=drive.runs[:1]) != 0
    for i, (scan, T_odom_base) in enumerate(zip(drive.scans, poses, strict=True)):
        events = (Odometry(scan.stamp, T_odom_base), scan)
        yield Happening(events, truth_at(drive, i), over="splice" if seams[i] else None)


def simulated(moments: Iterable[Moment]) -> Iterator[Happening]:
    """Return what happens to a simulated robot, scan by scan."""
    for moment in moments:
        over = None if moment.disturbance is None else _KINDS[moment.disturbance]
        underway = moment.phase in _UNDERWAY
        yield Happening(moment.events, moment.T_map_base, underway, over)


def watched(happenings: Iterable[Happening], grid: OccupancyGrid) -> Iterator[Instant]:
    """Let a new localizer live through what happens.

    Parameters
    ----------
    happenings : iterable of Happening
        In the order of their stamps.
    grid : OccupancyGrid
        The map.

    Yields
    ------
    Instant
        One for every scan.
    """
    localizer = Localizer(cache_dir=cache_folder())
    localizer.handle(NewMap(0.0, grid))
    lifted: set[SignalKind] = set()
    T_odom_base = SE2.identity()
    for happening in happenings:
        outputs: list[Output] = []
        scan: LaserScan | None = None
        raised = False
        began = time.process_time()
        for event, answers in replay(iter(happening.events), localizer):
            outputs += answers
            if isinstance(event, LaserScan):
                scan = event
            elif isinstance(event, Odometry):
                T_odom_base = event.T_odom_base if scan is None else T_odom_base
            elif isinstance(event, Signal) and event.kind.means_lifted:
                raised |= event.active
                (lifted.add if event.active else lifted.discard)(event.kind)
        cpu_s = time.process_time() - began
        if scan is None:
            continue
        tracked = [output for output in outputs if isinstance(output, TrackedPose)]
        yield Instant(
            stamp=scan.stamp,
            truth=happening.truth,
            T_odom_base=T_odom_base,
            useful=not lifted and int(scan.hit.sum()) >= FEWEST_HITS,
            disturbed=happening.disturbed,
            over=happening.over,
            signalled=raised,
            localized=localizer.state is State.LOCALIZED,
            published=tracked[-1].T_map_base if tracked else None,
            fixes=tuple(out.T_map_base for out in outputs if isinstance(out, InitialPose)),
            said=tuple(
                f"{out.state.value} {out.reason}" for out in outputs if isinstance(out, Status)
            ),
            cpu_s=cpu_s,
        )
