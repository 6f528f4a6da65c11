"""Calibration of the probabilities, and coverage against risk.

For the JSON document of ``bench``, one entry for each method, sensor and kind of case::

    {"method", "sensor", "kind", "n", "wrong_map_n",
     "bins": [{"from", "to", "n", "claimed", "right", "right_low", "right_high"}, ...],
     "own": {"unique_coverage", "unique_risk", "coverage_at_goal_risk", "risk_at_goal_coverage",
             "curve": {"threshold": [...], "coverage": [...], "risk": [...]}},
     "with_wrong_map": {...the same...} or null}
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.global_localization.config import LocateConfig
from firstfix.lab.experiments.locate_bench import CaseRun, WrongMapRun
from firstfix.lab.reports.text import Row, columns_table

GOAL_RISK = 0.003
GOAL_COVERAGE = 0.88

# Narrow near 1, where robots act on the answer.
_EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 0.99, 1.0)

# Points of a curve in the JSON.
_MOST_POINTS = 200

# Two-sided 95 %.
_QUANTILE = 1.96

# Title, key in the document, format.
COLUMNS = (
    ("scans", "scans", ".0f"),
    ("coverage at UNIQUE", "unique_coverage", ".1%"),
    ("risk at UNIQUE", "unique_risk", ".2%"),
    ("coverage at 0.3 % risk", "coverage_at_goal_risk", ".1%"),
    ("risk at 88 % coverage", "risk_at_goal_coverage", ".2%"),
)


@dataclass(frozen=True, eq=False, slots=True)
class RiskCurve:
    """Coverage and risk if every answer from a threshold of probability on is accepted.

    Parameters
    ----------
    thresholds : ndarray, shape (n,)
        The probabilities, falling.
    coverage : ndarray, shape (n,)
        Share of the scans on their own map that is answered.
    risk : ndarray, shape (n,)
        Share of all answers that is wrong; a scan on a wrong map has no right one.
    """

    thresholds: NDArray[np.float64]
    coverage: NDArray[np.float64]
    risk: NDArray[np.float64]

    def at_threshold(self, threshold: float) -> tuple[float, float] | None:
        """Return coverage and risk at a threshold; None where nothing reaches it."""
        reached = np.flatnonzero(self.thresholds >= threshold)
        if len(reached) == 0:
            return None
        return float(self.coverage[reached[-1]]), float(self.risk[reached[-1]])

    def coverage_at_risk(self, risk: float) -> float:
        """Return the greatest coverage whose risk is at most so high; 0 if there is none."""
        return float(self.coverage[self.risk <= risk].max(initial=0.0))

    def risk_at_coverage(self, coverage: float) -> float | None:
        """Return the risk at which so much is first covered; None if it never is."""
        reached = np.flatnonzero(self.coverage >= coverage)
        return float(self.risk[reached[0]]) if len(reached) else None


def risk_curve(
    probabilities: NDArray[np.float64],
    right: NDArray[np.bool_],
    wrong_map: NDArray[np.float64],
) -> RiskCurve:
    """Sweep the threshold over all probabilities that occur and are above 0.

    Parameters
    ----------
    probabilities : ndarray, shape (n,)
        Of the best place of each scan in its own map; at least one.
    right : ndarray of bool, shape (n,)
        Whether it is the right place.
    wrong_map : ndarray, shape (m,)
        Of the best place of scans of other buildings; may be empty.
    """
    thresholds = np.unique(np.concatenate([probabilities, wrong_map]))[::-1]
    thresholds = thresholds[thresholds > 0.0]
    answered = _count_from(probabilities, thresholds)
    wrong = _count_from(probabilities[~right], thresholds)
    accepted = _count_from(wrong_map, thresholds)
    risk = (wrong + accepted) / np.maximum(1, answered + accepted)
    return RiskCurve(thresholds, answered / len(probabilities), risk)


def reliability_bins(
    probabilities: NDArray[np.float64], right: NDArray[np.bool_]
) -> list[dict[str, Any]]:
    """Compare probabilities of the best places, shape (n,), with the share that is right, in bins.

    Every bin that has a scan gives its ends, number of scans, mean probability, share that is
    right, and Wilson's 95 % interval of that share.
    """
    bins = []
    for low, high in pairwise(_EDGES):
        last = high == _EDGES[-1]
        inside = (probabilities >= low) & ((probabilities < high) | last)
        n, hits = int(inside.sum()), int((inside & right).sum())
        if n == 0:
            continue
        lowest, highest = _wilson(hits, n)
        bins.append(
            {
                "from": low,
                "to": high,
                "n": n,
                "claimed": float(probabilities[inside].mean()),
                "right": hits / n,
                "right_low": lowest,
                "right_high": highest,
            }
        )
    return bins


def reliability_document(
    runs: Sequence[CaseRun], wrong_map: Sequence[WrongMapRun]
) -> list[dict[str, Any]]:
    """Put all scans by method, sensor and kind into figures, as described above."""
    keys = dict.fromkeys(_key(run) for run in runs)
    return [
        _entry([r for r in runs if _key(r) == key], [r for r in wrong_map if _key(r) == key])
        for key in keys
    ]


def reliability_table(entries: Sequence[Row]) -> str:
    """Lay out coverage and risk by method, sensor and kind, without and with wrong maps."""
    rows = []
    for entry in entries:
        words = {key: entry[key] for key in ("method", "sensor", "kind")}
        rows.append({**words, **entry["own"], "scans": entry["n"]})
        if entry["with_wrong_map"] is not None:
            words["kind"] += " and wrong map"
            scans = entry["n"] + entry["wrong_map_n"]
            rows.append({**words, **entry["with_wrong_map"], "scans": scans})
    titles = {"method": "method", "sensor": "sensor", "scans of": "kind"}
    return columns_table(rows, titles, COLUMNS)


def _key(run: CaseRun | WrongMapRun) -> tuple[str, str, str]:
    return run.method, run.sensor, run.kind


def _entry(runs: Sequence[CaseRun], wrong_map: Sequence[WrongMapRun]) -> dict[str, Any]:
    outcomes = [outcome for run in runs for outcome in run.outcomes]
    probabilities = np.array([outcome.probability for outcome in outcomes])
    right = np.array([outcome.is_found for outcome in outcomes], np.bool_)
    elsewhere = np.array([p for run in wrong_map for p in run.probabilities])
    nowhere = np.empty(0)
    return {
        "method": runs[0].method,
        "sensor": runs[0].sensor,
        "kind": runs[0].kind,
        "n": len(outcomes),
        "wrong_map_n": len(elsewhere),
        "bins": reliability_bins(probabilities, right),
        "own": _figures(risk_curve(probabilities, right, nowhere)),
        "with_wrong_map": _figures(risk_curve(probabilities, right, elsewhere))
        if len(elsewhere)
        else None,
    }


def _figures(curve: RiskCurve) -> dict[str, Any]:
    coverage, risk = curve.at_threshold(LocateConfig().unique_probability) or (0.0, None)
    return {
        "unique_coverage": coverage,
        "unique_risk": risk,
        "coverage_at_goal_risk": curve.coverage_at_risk(GOAL_RISK),
        "risk_at_goal_coverage": curve.risk_at_coverage(GOAL_COVERAGE),
        "curve": _points(curve),
    }


def _points(curve: RiskCurve) -> dict[str, list[float]]:
    n = len(curve.thresholds)
    kept = np.unique(np.linspace(0, n - 1, min(n, _MOST_POINTS)).round().astype(np.intp))
    return {
        "threshold": curve.thresholds[kept].tolist(),
        "coverage": curve.coverage[kept].tolist(),
        "risk": curve.risk[kept].tolist(),
    }


def _count_from(
    probabilities: NDArray[np.float64], thresholds: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Count for each threshold the probabilities that reach it."""
    ordered = np.sort(probabilities)
    return len(ordered) - np.searchsorted(ordered, thresholds, side="left")


def _wilson(hits: int, n: int) -> tuple[float, float]:
    share, z = hits / n, _QUANTILE
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return min(share, max(0.0, middle - half)), max(share, min(1.0, middle + half))
