"""Kidnaps of simulated robots, and of recorded ones by joining pieces of their drives."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.cache import cache_folder
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.lab.experiments.case import Case, truth_at
from firstfix.lab.experiments.splice import Unfit, splice
from firstfix.lab.metrics.kidnap_trial import SLIP, Instant
from firstfix.lab.reports.kidnap_report import KidnapRun, judged_run
from firstfix.lab.scenarios.kidnap_scripts import scripted
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.simulation import Disturbance, Moment
from firstfix.lab.worlds.catalog import WORLDS
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Hypotheses, InitialPose, Output, Status, TrackedPose
from firstfix.localizer.precompile import precompile
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
class Observation:
    """The reports of a robot around one scan, and the truth.

    Parameters
    ----------
    events : tuple of LaserScan, Odometry or Signal
        In the order of their stamps, with one scan.
    truth : SE2 or None
        ``T_map_base`` at the scan.
    disturbed : bool
        True during a disturbance.
    over : str or None
        The disturbance that ended just before.
    """

    events: tuple[LaserScan | Odometry | Signal, ...]
    truth: SE2 | None
    disturbed: bool = False
    over: str | None = None


@dataclass(frozen=True, slots=True)
class KidnapResult:
    """The scenarios of a task, or why there are none."""

    name: str
    runs: tuple[KidnapRun, ...]
    left_out: str | None = None


@dataclass(frozen=True, slots=True)
class KidnapWorldTask:
    """Run scenarios in a drawn building, one for each seed."""

    world: str
    seeds: tuple[int, ...]

    def __call__(self) -> KidnapResult:
        """Run in this process."""
        precompile()
        grid = WORLDS[self.world]()
        return KidnapResult(self.world, tuple(self._run(grid, seed) for seed in self.seeds))

    def _run(self, grid: OccupancyGrid, seed: int) -> KidnapRun:
        kind, phases = scripted(seed)
        moments = run(Scenario(phases), grid, seed)
        return judged_run(self.world, kind, seed, [*localized(simulated(moments), grid)])


@dataclass(frozen=True, slots=True)
class KidnapCaseTask:
    """Run drives joined from pieces of a case, one for each seed."""

    case: Case
    seeds: tuple[int, ...]

    def __call__(self) -> KidnapResult:
        """Run in this process."""
        precompile()
        name, recording, grid = self.case.name, self.case.recording(), self.case.grid()
        runs = []
        for seed in self.seeds:
            drive = splice(recording, SPLICES, np.random.default_rng(seed))
            if isinstance(drive, Unfit):
                return KidnapResult(name, (), drive.why)
            runs.append(judged_run(name, "splice", seed, [*localized(recorded(drive), grid)]))
        return KidnapResult(name, tuple(runs))


def recorded(drive: Recording) -> Iterator[Observation]:
    """Return the observations of a joined drive, scan by scan; its runs are the pieces."""
    assert drive.odometry is not None  # noqa: S101 - `splice` made it
    assert drive.runs is not None  # noqa: S101
    poses = [SE2.from_array(pose) for pose in drive.odometry.poses]
    seams = np.diff(drive.runs, prepend=drive.runs[:1]) != 0
    for i, (scan, T_odom_base) in enumerate(zip(drive.scans, poses, strict=True)):
        events = (Odometry(scan.stamp, T_odom_base), scan)
        yield Observation(events, truth_at(drive, i), over="splice" if seams[i] else None)


def simulated(moments: Iterable[Moment]) -> Iterator[Observation]:
    """Return the observations of a simulated robot, scan by scan."""
    for moment in moments:
        over = None if moment.disturbance is None else _KINDS[moment.disturbance]
        underway = moment.phase in _UNDERWAY
        yield Observation(moment.events, moment.T_map_base, underway, over)


def localized(observations: Iterable[Observation], grid: OccupancyGrid) -> Iterator[Instant]:
    """Hand observations to a new localizer, and yield its answer to every scan."""
    localizer = Localizer(cache_dir=cache_folder())
    localizer.handle(NewMap(0.0, grid))
    lifted: set[SignalKind] = set()
    T_odom_base = SE2.identity()
    for observation in observations:
        outputs: list[Output] = []
        scan: LaserScan | None = None
        raised = False
        began = time.process_time()
        for event, answers in replay(iter(observation.events), localizer):
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
        listed = [output for output in outputs if isinstance(output, Hypotheses)]
        yield Instant(
            stamp=scan.stamp,
            truth=observation.truth,
            T_odom_base=T_odom_base,
            useful=not lifted and int(scan.hit.sum()) >= FEWEST_HITS,
            disturbed=observation.disturbed,
            over=observation.over,
            signalled=raised,
            localized=localizer.state is State.LOCALIZED,
            published=tracked[-1].T_map_base if tracked else None,
            fixes=tuple(out.T_map_base for out in outputs if isinstance(out, InitialPose)),
            places=listed[-1].places if listed else None,
            said=tuple(
                f"{out.state.value} {out.reason}" for out in outputs if isinstance(out, Status)
            ),
            cpu_s=cpu_s,
        )
