"""One method on one case, with the time it takes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from firstfix.core.estimate import LocateResult, Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.experiments.case import Case, evenly_spaced, known_truth
from firstfix.lab.experiments.process_pool import peak_rss_mb
from firstfix.lab.metrics.outcome import Outcome, best_probability, judge
from firstfix.localizer.precompile import scan_of, small_room


@dataclass(frozen=True, slots=True)
class CaseRun:
    """One case, tried with one method.

    Parameters
    ----------
    case, site, kind : str
        The case.
    method : Method
        The method.
    outcomes : tuple of Outcome
        One for each scan that was tried.
    free_area_m2 : float
        Free area of the map, m².
    prepare_s : float
        Processor time (user + system) that preparing the map took without a disk cache, kernels
        compiled, s. Not wall time: that would depend on what else the machine does.
    rss_mb : float or None
        Peak resident memory of the process that did this and nothing else, MB.
    """

    case: str
    site: str
    kind: str
    method: Method
    outcomes: tuple[Outcome, ...]
    free_area_m2: float
    prepare_s: float
    rss_mb: float | None


@dataclass(frozen=True, slots=True)
class WrongMapRun:
    """Scans of one case, tried on the map of another building.

    Parameters
    ----------
    case, on : str
        Whose scans, and whose map.
    method : Method
        The method.
    n, unique : int
        Scans tried, and how many of them got the verdict UNIQUE: false accepts all.
    kind : str
        Where the scans come from.
    probabilities : tuple of float
        Of the best place of each scan; 0 where there was none.
    """

    case: str
    on: str
    method: Method
    n: int
    unique: int
    kind: str
    probabilities: tuple[float, ...]


def run_case(case: Case, method: Method, limit: int = 0) -> CaseRun:
    """Try a case with a method, in this process.

    Parameters
    ----------
    case : Case
        The case.
    method : Method
        The method.
    limit : int
        Scans to try, evenly spaced over those whose truth is known; 0 for all.

    Returns
    -------
    CaseRun
        The outcomes, and what they took.

    Raises
    ------
    InputError
        If the case cannot be loaded or has no truth.
    """
    recording, grid = case.recording(), case.grid()
    truth = known_truth(case, recording)
    tried = evenly_spaced(np.flatnonzero(np.isfinite(truth).all(axis=1)), limit)
    compile_kernels(method)
    start = time.process_time()
    matcher = ScanMatcher(grid, method=method, cache_dir=None)
    prepare_s = time.process_time() - start
    outcomes = tuple(
        try_scan(matcher.locate, recording.scans[i], SE2.from_array(truth[i]), i)
        for i in tried.tolist()
    )
    return CaseRun(
        case=case.name,
        site=case.site,
        kind=case.kind,
        method=method,
        outcomes=outcomes,
        free_area_m2=grid.free_area,
        prepare_s=prepare_s,
        rss_mb=peak_rss_mb(),
    )


def run_wrong_map(case: Case, on: Case, method: Method, limit: int = 0) -> WrongMapRun:
    """Try scans of one case on the map of another, in this process.

    Parameters
    ----------
    case : Case
        Whose scans.
    on : Case
        Whose map.
    method : Method
        The method.
    limit : int
        Scans to try, evenly spaced; 0 for all.

    Returns
    -------
    WrongMapRun
        How many scans were claimed to be found.
    """
    scans = case.recording().scans
    matcher = ScanMatcher(on.grid(), method=method, cache_dir=None)
    tried = evenly_spaced(np.arange(len(scans)), limit)
    results = [matcher.locate(scans[i]) for i in tried.tolist()]
    return WrongMapRun(
        case=case.name,
        on=on.name,
        method=method,
        n=len(results),
        unique=sum(result.verdict is Verdict.UNIQUE for result in results),
        kind=case.kind,
        probabilities=tuple(best_probability(result) for result in results),
    )


def try_scan(
    locate: Callable[[LaserScan], LocateResult], scan: LaserScan, truth: SE2, index: int
) -> Outcome:
    """Locate a scan, take the time and compare with the truth.

    Parameters
    ----------
    locate : callable
        The method, for one map.
    scan : LaserScan
        The scan.
    truth : SE2
        ``T_map_base``.
    index : int
        Index of the scan in its recording.

    Returns
    -------
    Outcome
        The scan in figures.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    result = locate(scan)
    cpu_s, wall_s = time.process_time() - cpu, time.perf_counter() - wall
    return judge(result, truth, index=index, cpu_s=cpu_s, wall_s=wall_s)


def compile_kernels(method: Method) -> None:
    """Locate in a small room, so that no figure contains the compiler."""
    grid = small_room()
    scan = scan_of(grid, SE2(3.0, 2.5, 0.4))
    ScanMatcher(grid, method=method, cache_dir=None).locate(scan)
