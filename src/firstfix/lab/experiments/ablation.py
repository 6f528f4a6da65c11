"""The default method with one of its steps left out, put together from its public steps.

The JSON document::

    {"suite": "ablation", "machine": {...from `machine.this_machine`...},
     "rows": [{"without", "kind", "cases", ...the figures of `metrics.Summary`...}, ...],
     "cases": [{"name", "kind", "without", ...the same figures...}, ...]}
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from enum import Enum
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import LocateResult, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS, Beams, usable_beams
from firstfix.global_localization.config import LocateConfig
from firstfix.global_localization.locate import (
    FIRST_LOOK_BEAMS,
    LISTED_PLACES,
    SECOND_LOOK_PLACES,
    doubt_of_one_scan,
    worth_listing,
)
from firstfix.global_localization.places import distinct_places
from firstfix.global_localization.refine import refine_on_field, refine_on_rays
from firstfix.global_localization.search import Candidates, search
from firstfix.global_localization.verdict import (
    exponent_of,
    judge,
    nothing_to_match,
    place_probabilities,
)
from firstfix.global_localization.verify import Verification, verified_place, verify
from firstfix.lab.experiments.case import Case, known_poses
from firstfix.lab.experiments.locate_bench import try_scan
from firstfix.lab.experiments.machine import this_machine
from firstfix.lab.metrics.metrics import summarize, total
from firstfix.lab.metrics.outcome import Answer, Outcome
from firstfix.lab.reports.text import Row, columns_table
from firstfix.localizer.precompile import precompile

# Title, key in the document, format.
COLUMNS = (
    ("cases", "cases", ".0f"),
    ("n", "n", ".0f"),
    ("success", "success", ".1%"),
    ("0.2 m 3°", "success_02", ".1%"),
    ("recall@10", "recall_10", ".1%"),
    ("unique", "unique", ".1%"),
    ("right", "unique_right", ".1%"),
    ("wrong", "wrong_unique", ".0f"),
    ("median m", "median_m", ".3f"),
    ("median °", "median_deg", ".2f"),
    ("CPU s", "cpu_s", ".3f"),
)

Scalar = TypeVar("Scalar", bound=np.generic)


class Without(Enum):
    """Which step is left out; the values are the words of tables."""

    NOTHING = "nothing"
    EXPECTED_RANGES = "expected ranges in the search"
    END_POINTS = "end points in the search"
    FIELD = "refinement on the distance field"
    RAYS = "sharpening on cast rays"
    COST = "verification cost"
    LAW = "verdict law"
    RULES = "rules of one scan"


# Without a cost there is nothing to make a verdict of: as in the paper the first is published.
_NO_VERDICT = frozenset({Without.COST, Without.LAW})


class AblatedMatcher:
    """Locates scans in one map as `ScanMatcher` does, without one step.

    The map must be small enough to be searched whole (`MapFields.is_looked_at`).

    Parameters
    ----------
    fields : MapFields
        The prepared map.
    without : Without
        What is left out.
    """

    def __init__(self, fields: MapFields, without: Without) -> None:
        self._fields = fields
        self._without = without
        # A constant field carries no information about the pose.
        self._searched = fields
        if without is Without.EXPECTED_RANGES:
            self._searched = _altered(fields, ranges=_silent(fields.ranges))
        elif without is Without.END_POINTS:
            silent = replace(fields.endpoints, values=_silent(fields.endpoints.values))
            self._searched = _altered(fields, endpoints=silent)

    def answer(self, scan: LaserScan) -> Answer:
        """Return the answer to a scan, to compare it with the truth."""
        return Answer.of(self.locate(scan))

    def locate(self, scan: LaserScan) -> LocateResult:
        """Find where in the map a scan was taken, as `ScanMatcher.locate` does."""
        started, config, fields = time.perf_counter(), LocateConfig(), self._fields
        beams = usable_beams(scan)
        hits = int(np.count_nonzero(beams.hit))
        if hits < FEWEST_HITS:
            return nothing_to_match(len(scan), hits, FEWEST_HITS, time.perf_counter() - started)
        found, report = search(beams, self._searched, config.shortlist, config.max_poses)
        poses, covariances = self._sharpened(self._best_places(found, beams, config), beams)
        verification = verify(poses, beams, fields)
        ranked = np.arange(len(poses))
        if self._without is not Without.COST:
            resolution = fields.grid.resolution
            ranked = distinct_places(poses, verification.scores, resolution, config.hypotheses)
        probabilities = place_probabilities(verification.scores[ranked], exponent_of(beams))
        verdict, reason = self._judged(scan, beams, verification, ranked, probabilities)
        if self._without in _NO_VERDICT:
            verdict, reason = Verdict.UNIQUE, "the best, whatever it is"
            probabilities = np.zeros(len(ranked))
            probabilities[0] = 1.0
        hypotheses = tuple(
            verified_place(fields.grid, scan, verification, int(i), covariances[i], float(p))
            for i, p in zip(ranked, probabilities, strict=True)
        )
        return LocateResult(verdict, reason, hypotheses, report, time.perf_counter() - started)

    def _judged(
        self,
        scan: LaserScan,
        beams: Beams,
        verification: Verification,
        ranked: NDArray[np.int64],
        probabilities: NDArray[np.float64],
    ) -> tuple[Verdict, str]:
        evidence = verification.evidence(int(ranked[0]))
        verdict, reason = judge(probabilities, evidence, LocateConfig().unique_probability)
        if verdict is Verdict.UNIQUE and self._without is not Without.RULES:
            poses = verification.poses[ranked]
            if doubt := doubt_of_one_scan([scan], poses, probabilities, beams, self._fields):
                return Verdict.AMBIGUOUS, f"{reason}, {doubt}"
        return verdict, reason

    def _best_places(
        self, found: Candidates, beams: Beams, config: LocateConfig
    ) -> NDArray[np.float64]:
        fields, resolution = self._fields, self._fields.grid.resolution
        poses = found.poses
        if self._without is not Without.FIELD:
            poses = refine_on_field(poses, beams, fields)
        if self._without is Without.COST:
            return poses[distinct_places(poses, found.scores, resolution, LISTED_PLACES)]
        scores = verify(poses, beams.thinned(FIRST_LOOK_BEAMS), fields).scores
        poses = poses[distinct_places(poses, scores, resolution, SECOND_LOOK_PLACES)]
        scores = verify(poses, beams, fields).scores
        ranked = distinct_places(poses, scores, resolution, config.hypotheses)
        return poses[ranked[: worth_listing(scores[ranked], exponent_of(beams))]]

    def _sharpened(
        self, poses: NDArray[np.float64], beams: Beams
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if self._without is Without.RAYS:
            return poses, np.zeros((len(poses), 3, 3))
        on_rays, covariances = refine_on_rays(poses, beams, self._fields)
        if self._without is Without.COST:
            return on_rays, covariances
        return np.concatenate([on_rays, poses]), np.concatenate([covariances, covariances])


@dataclass(frozen=True, slots=True)
class AblationRun:
    """One case, with one step left out.

    Parameters
    ----------
    case, kind : str
        The case.
    without : Without
        What was left out.
    outcomes : tuple of Outcome
        One for each scan that was tried.
    """

    case: str
    kind: str
    without: Without
    outcomes: tuple[Outcome, ...]


@dataclass(frozen=True, slots=True)
class AblationTask:
    """Try a case with every step left out in turn; ``limit`` scans of it (0: all)."""

    case: Case
    limit: int = 0

    def __call__(self) -> tuple[AblationRun, ...]:
        """Run in this process."""
        precompile()
        return ablate_case(self.case, self.case.grid(), self.limit)


def ablate_case(case: Case, grid: OccupancyGrid, limit: int) -> tuple[AblationRun, ...]:
    """Locate scans of a case, at most ``limit`` (0: all), with every step left out in turn."""
    recording, fields = case.recording(), MapFields(grid)
    truth = known_poses(case, recording, limit)
    runs = []
    for without in Without:
        locate = AblatedMatcher(fields, without).answer
        outcomes = [try_scan(locate, recording.scans[i], pose, i) for i, pose in truth.items()]
        runs.append(AblationRun(case.name, case.kind, without, tuple(outcomes)))
    return tuple(runs)


def ablation_document(runs: Sequence[AblationRun]) -> dict[str, Any]:
    """Put runs into the document described above."""
    kinds = list(dict.fromkeys(run.kind for run in runs))
    return {
        "suite": "ablation",
        "machine": this_machine(),
        "rows": [
            _row(kind, without, [r for r in runs if r.kind == kind and r.without is without])
            for kind in kinds
            for without in Without
        ],
        "cases": [
            {
                "name": run.case,
                "kind": run.kind,
                "without": run.without.value,
                **asdict(summarize(run.outcomes)),
            }
            for run in runs
        ],
    }


def ablation_table(document: Row) -> str:
    """Lay out what every step is worth, by the kind of case, in Markdown."""
    return columns_table(document["rows"], {"kind": "kind", "without": "without"}, COLUMNS)


def _row(kind: str, without: Without, runs: Sequence[AblationRun]) -> dict[str, Any]:
    figures = asdict(total([summarize(run.outcomes) for run in runs]))
    return {"without": without.value, "kind": kind, "cases": len(runs), **figures}


def _altered(fields: MapFields, **altered: object) -> MapFields:
    """Return the fields of a map with some replaced: a computed field lies in ``__dict__``."""
    copied = MapFields(fields.grid)
    vars(copied).update(vars(fields) | altered)
    return copied


def _silent(field: NDArray[Scalar]) -> NDArray[Scalar]:
    silent = np.zeros_like(field)
    silent.flags.writeable = False
    return silent
