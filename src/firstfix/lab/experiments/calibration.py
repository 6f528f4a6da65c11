"""The law of one scan, chosen anew without each building in turn, and judged there.

The JSON document::

    {"suite": "calibration", "machine": {...from `machine.this_machine`...},
     "tried": {"exponent": [...], "floor": [...], "threshold": [...]},
     "rows": [{"building", "sensor", "law", "exponent", "floor", "threshold",
               "scans", "unique", "wrong", "wrong_map_scans", "wrong_map_unique"}, ...],
     "totals": [{"sensor", "law", ...the counts of all buildings...}, ...]}

Each building and sensor has two rows: ``law`` is the one chosen without the building, or the one
of the package.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import usable_beams
from firstfix.global_localization.config import LocateConfig
from firstfix.global_localization.frames import to_cells
from firstfix.global_localization.lead import RIVALS, leads_without_its_best_part, part_costs
from firstfix.global_localization.locate import SURE_OF_SMALL_VIEW
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.sensors import are_surrounded, see_enough
from firstfix.global_localization.verdict import (
    EXPONENT,
    FLOOR,
    WRONG_MAP_COST,
    exponent_of,
    log_likelihoods,
)
from firstfix.lab.experiments.case import Case, known_poses, next_elsewhere
from firstfix.lab.experiments.machine import this_machine
from firstfix.lab.metrics.outcome import is_found
from firstfix.lab.reports.text import Row, columns_table
from firstfix.localizer.precompile import precompile

# Strictest first: of laws that answer as many scans the first one is taken.
EXPONENTS = (6.0, 8.0, 10.0, 12.0, 14.0, 17.0, 20.0)
FLOORS = (0.4, 0.3, 0.2, 0.1)
THRESHOLDS = (0.99, 0.98, 0.95, 0.9)

# Goals for each sensor: of the answers, and of the scans on a wrong map.
MOST_WRONG = 0.005

# One is left out, one has scans and the other one is a wrong map.
FEWEST_BUILDINGS = 3

CHOSEN, PACKAGE = "chosen without it", "the package's"

# Title, key in the document, format.
COUNTS = (
    ("scans", "scans", ".0f"),
    ("UNIQUE", "unique", ".0f"),
    ("wrong", "wrong", ".0f"),
    ("scans on a wrong map", "wrong_map_scans", ".0f"),
    ("UNIQUE there", "wrong_map_unique", ".0f"),
)
CONSTANTS = (
    ("exponent", "exponent", ".0f"),
    ("floor", "floor", ".1f"),
    ("threshold", "threshold", ".2f"),
)


@dataclass(frozen=True, slots=True)
class Law:
    """The constants that make a verdict of costs; see `firstfix.global_localization.verdict`."""

    exponent: float
    floor: float
    threshold: float


THE_PACKAGES = Law(EXPONENT, FLOOR, LocateConfig().unique_probability)


@dataclass(frozen=True, slots=True)
class Claim:
    """What a scan claims, before a law makes a verdict of it.

    Parameters
    ----------
    costs : tuple of float
        Mean costs of the separate places, best first, nats; empty if the scan saw too little.
    share : float
        Of the law's exponent that this scan has: less than 1 with few beams.
    needed : float
        Least probability by the rules of one scan; above 1 if they forbid UNIQUE.
    is_right : bool
        True if the best place is the true one.
    """

    costs: tuple[float, ...]
    share: float
    needed: float
    is_right: bool

    def is_unique(self, law: Law) -> bool:
        """Return whether a law and the rules make this UNIQUE."""
        if not self.costs:
            return False
        # The law with another floor is that of costs which are higher by the difference.
        costs = np.array([*self.costs, WRONG_MAP_COST]) + (law.floor - FLOOR)
        logs = log_likelihoods(costs, law.exponent * self.share)
        likelihoods = np.exp(logs - logs.max())
        return bool(likelihoods[0] / likelihoods.sum() >= max(law.threshold, self.needed))


@dataclass(frozen=True, slots=True)
class CalibrationRun:
    """The claims of the scans of one case.

    Parameters
    ----------
    building, sensor : str
        Of the case.
    own : tuple of Claim
        In its own map.
    elsewhere : tuple of Claim
        In the map of another building, where none is right.
    """

    building: str
    sensor: str
    own: tuple[Claim, ...]
    elsewhere: tuple[Claim, ...]


@dataclass(frozen=True, slots=True)
class CalibrationTask:
    """Search for scans of a case in two maps; ``limit`` scans of it (0: all)."""

    case: Case
    on: Case
    limit: int = 0

    def __call__(self) -> CalibrationRun:
        """Run in this process."""
        precompile()
        recording = self.case.recording()
        truth = known_poses(self.case, recording, self.limit)
        own, other = ScanMatcher(self.case.grid()), ScanMatcher(self.on.grid())
        return CalibrationRun(
            self.case.site,
            self.case.sensor,
            tuple(claim(own, recording.scans[i], pose) for i, pose in truth.items()),
            tuple(claim(other, recording.scans[i], None) for i in truth),
        )


def calibration_tasks(cases: Sequence[Case], limit: int) -> list[CalibrationTask]:
    """Pair every case with the next one of another building."""
    pairs = [(case, next_elsewhere(cases, i)) for i, case in enumerate(cases)]
    return [CalibrationTask(case, on, limit) for case, on in pairs if on is not None]


def claim(matcher: ScanMatcher, scan: LaserScan, truth: SE2 | None) -> Claim:
    """Search for a scan, and keep what its verdict depends on.

    Parameters
    ----------
    matcher : ScanMatcher
        Of a map.
    scan : LaserScan
        The scan.
    truth : SE2 or None
        ``T_map_base``; None in a wrong map.
    """
    places = matcher.locate(scan).hypotheses
    if not places:
        return Claim((), 0.0, 2.0, is_right=False)
    fields, beams = matcher.fields, usable_beams(scan)
    poses = np.array([to_cells(fields.grid, scan, place.pose) for place in places[:RIVALS]])
    needed = 0.0 if see_enough([scan]) else SURE_OF_SMALL_VIEW if are_surrounded([scan]) else 2.0
    if not leads_without_its_best_part(part_costs(poses, beams, fields)):
        needed = 2.0
    return Claim(
        tuple(place.score for place in places),
        exponent_of(beams) / EXPONENT,
        needed,
        is_found(places[0].pose, truth),
    )


def choose(runs: Sequence[CalibrationRun]) -> Law:
    """Choose the law that answers most scans, of those that are seldom wrong with every sensor.

    Parameters
    ----------
    runs : sequence of CalibrationRun
        Of several buildings and sensors.
    """
    laws = [Law(*constants) for constants in product(EXPONENTS, FLOORS, THRESHOLDS)]
    return min(laws, key=lambda law: _faults_and_gaps(runs, law))


def _faults_and_gaps(runs: Sequence[CalibrationRun], law: Law) -> tuple[float, float]:
    """Return how far a law is from the goals, and the share of scans without an answer."""
    by_sensor = [
        counted([run for run in runs if run.sensor == sensor], law)
        for sensor in dict.fromkeys(run.sensor for run in runs)
    ]
    beyond = sum(
        max(0.0, row["wrong"] / max(1, row["unique"]) - MOST_WRONG)
        + max(0.0, row["wrong_map_unique"] / max(1, row["wrong_map_scans"]) - MOST_WRONG)
        for row in by_sensor
    )
    answered = sum(row["unique"] - row["wrong"] for row in by_sensor)
    return beyond, 1.0 - answered / max(1, sum(row["scans"] for row in by_sensor))


def counted(runs: Iterable[CalibrationRun], law: Law) -> dict[str, int]:
    """Count scans, answers and wrong answers by a law."""
    counts = [_counted(run, law) for run in runs]
    return {key: sum(one[key] for one in counts) for _, key, _ in COUNTS}


@cache  # a run takes part in the choice for every other building
def _counted(run: CalibrationRun, law: Law) -> dict[str, int]:
    unique = [claim for claim in run.own if claim.is_unique(law)]
    return {
        "scans": len(run.own),
        "unique": len(unique),
        "wrong": sum(not claim.is_right for claim in unique),
        "wrong_map_scans": len(run.elsewhere),
        "wrong_map_unique": sum(claim.is_unique(law) for claim in run.elsewhere),
    }


def calibration_document(runs: Sequence[CalibrationRun]) -> dict[str, Any]:
    """Choose a law without each building, judge it there, and put both into a document."""
    rows = []
    for building in dict.fromkeys(run.building for run in runs):
        chosen = choose([run for run in runs if run.building != building])
        for run in (run for run in runs if run.building == building):
            names = {"building": building, "sensor": run.sensor}
            for name, law in ((CHOSEN, chosen), (PACKAGE, THE_PACKAGES)):
                rows.append({**names, "law": name, **asdict(law), **counted([run], law)})
    return {
        "suite": "calibration",
        "machine": this_machine(),
        "tried": {"exponent": EXPONENTS, "floor": FLOORS, "threshold": THRESHOLDS},
        "rows": rows,
        "totals": _totals(rows),
    }


def _totals(rows: Sequence[Row]) -> list[dict[str, Any]]:
    keys = dict.fromkeys((row["sensor"], row["law"]) for row in rows)
    return [
        {
            "sensor": sensor,
            "law": law,
            **{
                key: sum(row[key] for row in rows if (row["sensor"], row["law"]) == (sensor, law))
                for _, key, _ in COUNTS
            },
        }
        for sensor, law in keys
    ]


def calibration_tables(document: Row) -> tuple[str, str]:
    """Lay out the sums of all left-out buildings, and each of them, in Markdown."""
    words = {"sensor": "sensor", "law": "law"}
    return (
        columns_table(document["totals"], words, COUNTS),
        columns_table(document["rows"], {"building": "building", **words}, (*CONSTANTS, *COUNTS)),
    )
