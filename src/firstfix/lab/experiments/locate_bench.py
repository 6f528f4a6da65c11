"""Scans of a case located by one method, in the right map and in a wrong one, and what it takes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from firstfix.core.estimate import Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.bench_method import BenchMethod
from firstfix.lab.experiments.case import Case, evenly_spaced, known_poses, next_elsewhere
from firstfix.lab.experiments.process_pool import peak_rss_mb
from firstfix.lab.metrics.outcome import Answer, Outcome, judge


@dataclass(frozen=True, slots=True)
class CaseRun:
    """One case, located by one method.

    Parameters
    ----------
    case, site, kind, sensor : str
        The case.
    method : str
        Name of the method.
    outcomes : tuple of Outcome
        One for each scan that was located.
    free_area_m2 : float
        Free area of the map, m².
    prepare_s : float
        Processor time (user + system) of preparing the map without a disk cache, kernels compiled,
        s. Unlike wall time it does not depend on what else the machine does.
    rss_mb : float or None
        Peak resident memory of the process that did this and nothing else, MB.
    """

    case: str
    site: str
    kind: str
    sensor: str
    method: str
    outcomes: tuple[Outcome, ...]
    free_area_m2: float
    prepare_s: float
    rss_mb: float | None


@dataclass(frozen=True, slots=True)
class WrongMapRun:
    """Scans of one case, located in the map of another building.

    Parameters
    ----------
    case, site, kind, sensor : str
        The case of the scans.
    on : str
        The case of the map.
    method : str
        Name of the method.
    n, unique : int
        Scans, and how many of them got the verdict UNIQUE, which is always wrong here.
    probabilities : tuple of float
        Of the best place of each scan; 0 if there was none.
    """

    case: str
    site: str
    kind: str
    sensor: str
    on: str
    method: str
    n: int
    unique: int
    probabilities: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class CaseTask:
    """Locate scans of a case, evenly spaced, at most ``limit`` (0: all)."""

    case: Case
    method: BenchMethod
    limit: int = 0

    def __call__(self) -> CaseRun:
        """Run in this process.

        Raises
        ------
        InputError
            If the case cannot be loaded or has no true pose.
        """
        case, recording, grid = self.case, self.case.recording(), self.case.grid()
        truth = known_poses(case, recording, self.limit)
        self.method.compile()
        start = time.process_time()
        locate = self.method.prepare(case.name, grid)
        prepare_s = time.process_time() - start
        outcomes = tuple(
            try_scan(partial(locate, i), recording.scans[i], pose, i) for i, pose in truth.items()
        )
        return CaseRun(
            case=case.name,
            site=case.site,
            kind=case.kind,
            sensor=case.sensor,
            method=self.method.name,
            outcomes=outcomes,
            free_area_m2=grid.free_area,
            prepare_s=prepare_s,
            rss_mb=peak_rss_mb(),
        )


@dataclass(frozen=True, slots=True)
class WrongMapTask:
    """Locate scans of a case in another building, evenly spaced, at most ``limit`` (0: all)."""

    case: Case
    on: Case
    method: BenchMethod
    limit: int = 0

    def __call__(self) -> WrongMapRun:
        """Run in this process."""
        case, scans = self.case, self.case.recording().scans
        locate = self.method.prepare(self.on.name, self.on.grid())
        tried = evenly_spaced(np.arange(len(scans)), self.limit)
        answers = [locate(i, scans[i]) for i in tried.tolist()]
        return WrongMapRun(
            case=case.name,
            site=case.site,
            kind=case.kind,
            sensor=case.sensor,
            on=self.on.name,
            method=self.method.name,
            n=len(answers),
            unique=sum(answer.verdict is Verdict.UNIQUE for answer in answers),
            probabilities=tuple(answer.probability for answer in answers),
        )


def wrong_map_tasks(
    cases: Sequence[Case], methods: Sequence[BenchMethod], limit: int
) -> list[WrongMapTask]:
    """List every case with the next one that is another building, for every method."""
    pairs = [(case, next_elsewhere(cases, i)) for i, case in enumerate(cases)]
    return [
        WrongMapTask(case, on, method, limit)
        for method in methods
        for case, on in pairs
        if on is not None
    ]


def try_scan(
    locate: Callable[[LaserScan], Answer], scan: LaserScan, truth: SE2, index: int
) -> Outcome:
    """Locate a scan, measure the time, and compare the answer with the true ``T_map_base``."""
    wall, cpu = time.perf_counter(), time.process_time()
    answer = locate(scan)
    cpu_s, wall_s = time.process_time() - cpu, time.perf_counter() - wall
    return judge(answer, truth, index=index, cpu_s=cpu_s, wall_s=wall_s)
