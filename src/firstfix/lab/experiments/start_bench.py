"""Starts of the localizer at random places of recorded drives."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from firstfix.core.estimate import Hypothesis
from firstfix.core.odometry import Odometry
from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.case import Case, known_truth, truth_at
from firstfix.lab.experiments.drive import known_odometry
from firstfix.lab.experiments.kidnap_bench import Observation, localized
from firstfix.lab.metrics.kidnap_trial import Instant
from firstfix.lab.metrics.outcome import is_found
from firstfix.localizer.precompile import precompile

# A start that is undecided after this way is counted as open; it is followed a while longer.
OPEN_M = 5.0
_LONGEST_M, _MOST_SCANS = 12.0, 400

# The true place is missing from the reported places, but their probabilities admit it.
ELSEWHERE_MASS = 0.02


class Ending(Enum):
    """How a start ended."""

    RIGHT = "right"
    WRONG = "wrong"
    OPEN = "open"


@dataclass(frozen=True, slots=True)
class StartRun:
    """One start.

    Parameters
    ----------
    case, site, sensor : str
        The case.
    scan : int
        Index of the first scan in its recording.
    ending : Ending
        Whether the first published pose is right or wrong; OPEN if none was published.
    way_m, time_s : float
        True way and time from the first scan to the first published pose, or to the end, m and s.
    scans, reports : int
        Scans until then, and how many of them led to a report of places or to a pose.
    listed, elsewhere : int
        Reports that list the true place, and others that leave at least `ELSEWHERE_MASS` of the
        probability to places that they do not list.
    cpu_ms : tuple of float
        Processor time of each scan, ms.
    """

    case: str
    site: str
    sensor: str
    scan: int
    ending: Ending
    way_m: float
    time_s: float
    scans: int
    reports: int
    listed: int
    elsewhere: int
    cpu_ms: tuple[float, ...]

    @property
    def counts(self) -> bool:
        """True if the start was decided, or went on for `OPEN_M`."""
        return self.ending is not Ending.OPEN or self.way_m >= OPEN_M


@dataclass(frozen=True, slots=True)
class StartResult:
    """The starts on a case, or why there are none."""

    case: str
    runs: tuple[StartRun, ...]
    left_out: str | None = None


@dataclass(frozen=True, slots=True)
class StartTask:
    """Start ``count`` times on the drive of a case; places depend on ``seed`` alone."""

    case: Case
    count: int
    seed: int

    def __call__(self) -> StartResult:
        """Run in this process.

        Raises
        ------
        InputError
            If the case cannot be loaded or has no true pose.
        """
        case, recording = self.case, self.case.recording()
        if recording.odometry is None:
            return StartResult(case.name, (), "no odometry")
        truth = known_truth(case, recording)
        odometry = dict(known_odometry(recording))
        usable = [i for i in odometry if np.isfinite(truth[i]).all()]
        precompile()
        grid, rng = case.grid(), np.random.default_rng(self.seed)
        chosen = rng.permutation(usable)[: self.count].tolist()
        runs = [
            _start(case, first, localized(_observations(recording, odometry, first), grid))
            for first in chosen
        ]
        return StartResult(case.name, tuple(runs))


def _observations(
    recording: Recording, odometry: Mapping[int, SE2], first: int
) -> Iterator[Observation]:
    """Return what the robot reports from a scan to the end of its run, scan by scan."""
    runs = recording.runs
    for i in range(first, min(len(recording), first + _MOST_SCANS)):
        if runs is not None and runs[i] != runs[first]:
            return
        if i in odometry:
            scan = recording.scans[i]
            events = (Odometry(scan.stamp, odometry[i]), scan)
            yield Observation(events, truth_at(recording, i))


def _start(case: Case, first: int, instants: Iterable[Instant]) -> StartRun:
    """Follow a new localizer to its first published pose, to `_LONGEST_M` or to the end."""
    ending, way_m, begin_s = Ending.OPEN, 0.0, math.nan
    reports = listed = elsewhere = 0
    cpu_ms: list[float] = []
    before: SE2 | None = None
    for instant in instants:
        here = instant.truth
        begin_s = instant.stamp if math.isnan(begin_s) else begin_s
        time_s = instant.stamp - begin_s
        cpu_ms.append(1e3 * instant.cpu_s)
        if here is None:
            continue
        way_m += before.distance_to(here) if before is not None else 0.0
        before = here
        if instant.published is not None:
            is_right = is_found(instant.published, here)
            ending = Ending.RIGHT if is_right else Ending.WRONG
            reports, listed = reports + 1, listed + is_right
            break
        if instant.places is not None:
            is_listed = any(is_found(place.pose, here) for place in instant.places)
            reports, listed = reports + 1, listed + is_listed
            elsewhere += not is_listed and _unlisted(instant.places) >= ELSEWHERE_MASS
        if way_m >= _LONGEST_M:
            break
    return StartRun(
        case=case.name,
        site=case.site,
        sensor=case.sensor,
        scan=first,
        ending=ending,
        way_m=way_m,
        time_s=time_s,
        scans=len(cpu_ms),
        reports=reports,
        listed=listed,
        elsewhere=elsewhere,
        cpu_ms=tuple(cpu_ms),
    )


def _unlisted(places: Iterable[Hypothesis]) -> float:
    """Return the probability that is left to places that are not listed."""
    return 1.0 - sum(place.probability for place in places)
