"""Scans of a case located by one method, in the right map and in a wrong one, and what it takes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from firstfix.core.estimate import LocateResult, Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.experiments.case import Case, evenly_spaced, known_truth, next_elsewhere
from firstfix.lab.experiments.process_pool import peak_rss_mb
from firstfix.lab.metrics.outcome import Outcome, best_probability, judge
from firstfix.localizer.precompile import precompile


@dataclass(frozen=True, slots=True)
class CaseRun:
    """One case, located by one method.

    Parameters
    ----------
    case, site, kind, sensor : str
        The case.
    method : Method
        The method.
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
    method: Method
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
    method : Method
        The method.
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
    method: Method
    n: int
    unique: int
    probabilities: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class CaseTask:
    """Locate scans of a case, evenly spaced, at most ``limit`` (0: all)."""

    case: Case
    method: Method
    limit: int = 0

    def __call__(self) -> CaseRun:
        """Run in this process.

        Raises
        ------
        InputError
            If the case cannot be loaded or has no true pose.
        """
        case, recording, grid = self.case, self.case.recording(), self.case.grid()
        truth = known_truth(case, recording)
        tried = evenly_spaced(np.flatnonzero(np.isfinite(truth).all(axis=1)), self.limit)
        precompile(methods=[self.method])
        start = time.process_time()
        matcher = ScanMatcher(grid, method=self.method, cache_dir=None)
        prepare_s = time.process_time() - start
        outcomes = tuple(
            try_scan(matcher.locate, recording.scans[i], SE2.from_array(truth[i]), i)
            for i in tried.tolist()
        )
        return CaseRun(
            case=case.name,
            site=case.site,
            kind=case.kind,
            sensor=case.sensor,
            method=self.method,
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
    method: Method
    limit: int = 0

    def __call__(self) -> WrongMapRun:
        """Run in this process."""
        case, scans = self.case, self.case.recording().scans
        matcher = ScanMatcher(self.on.grid(), method=self.method, cache_dir=None)
        tried = evenly_spaced(np.arange(len(scans)), self.limit)
        results = [matcher.locate(scans[i]) for i in tried.tolist()]
        return WrongMapRun(
            case=case.name,
            site=case.site,
            kind=case.kind,
            sensor=case.sensor,
            on=self.on.name,
            method=self.method,
            n=len(results),
            unique=sum(result.verdict is Verdict.UNIQUE for result in results),
            probabilities=tuple(best_probability(result) for result in results),
        )


def wrong_map_tasks(
    cases: Sequence[Case], methods: Sequence[Method], limit: int
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
    locate: Callable[[LaserScan], LocateResult], scan: LaserScan, truth: SE2, index: int
) -> Outcome:
    """Locate a scan, measure the time, and compare the answer with the true ``T_map_base``."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = locate(scan)
    cpu_s, wall_s = time.process_time() - cpu, time.perf_counter() - wall
    return judge(result, truth, index=index, cpu_s=cpu_s, wall_s=wall_s)
