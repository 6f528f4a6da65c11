"""How good is it: from outcomes to figures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from firstfix.core.estimate import Verdict
from firstfix.lab.metrics.outcome import FOUND_WELL, Outcome


@dataclass(frozen=True, slots=True)
class Summary:
    """Many scans in figures; the names are those of the JSON that ``bench`` writes.

    Parameters
    ----------
    n : int
        Number of scans.
    success : float
        Share whose best hypothesis is within 0.5 m and 10° of the truth, whatever the verdict.
    success_02 : float
        The same within 0.2 m and 3°.
    recall_1, recall_10 : float
        Share with a hypothesis within 0.5 m and 10° among the first 1 and 10.
    unique : float
        Share with the verdict UNIQUE.
    unique_right : float
        Share with the verdict UNIQUE that is a success too.
    wrong_unique : int
        Number of scans with the verdict UNIQUE that are no success.
    no_match : float
        Share with the verdict NO_MATCH.
    median_m, median_deg, p95_m : float or None
        Errors of the successes, m and degrees: median, median, 95th percentile.
    cpu_s, cpu_s_p95, wall_s, wall_s_p95 : float or None
        Processor and wall time of a scan, s: median and 95th percentile.
    """

    n: int
    success: float | None
    success_02: float | None
    recall_1: float | None
    recall_10: float | None
    unique: float | None
    unique_right: float | None
    wrong_unique: int
    no_match: float | None
    median_m: float | None
    median_deg: float | None
    p95_m: float | None
    cpu_s: float | None
    cpu_s_p95: float | None
    wall_s: float | None
    wall_s_p95: float | None


COUNTS = frozenset({"n", "wrong_unique"})


def summarize(outcomes: Sequence[Outcome]) -> Summary:
    """Put the outcomes of one case into figures; what nothing is known of is None."""
    hits = [o.error for o in outcomes if o.is_found]
    unique = [o for o in outcomes if o.verdict is Verdict.UNIQUE]
    cpu, wall = [o.cpu_s for o in outcomes], [o.wall_s for o in outcomes]
    return Summary(
        n=len(outcomes),
        success=_share(o.is_found for o in outcomes),
        success_02=_share(o.error.is_within(FOUND_WELL) for o in outcomes),
        recall_1=_share(o.rank == 1 for o in outcomes),
        recall_10=_share(o.rank is not None and o.rank <= 10 for o in outcomes),
        unique=_share(o.verdict is Verdict.UNIQUE for o in outcomes),
        unique_right=_share(o.verdict is Verdict.UNIQUE and o.is_found for o in outcomes),
        wrong_unique=sum(not o.is_found for o in unique),
        no_match=_share(o.verdict is Verdict.NO_MATCH for o in outcomes),
        median_m=_percentile([e.metres for e in hits], 50),
        median_deg=_percentile([math.degrees(e.radians) for e in hits], 50),
        p95_m=_percentile([e.metres for e in hits], 95),
        cpu_s=_percentile(cpu, 50),
        cpu_s_p95=_percentile(cpu, 95),
        wall_s=_percentile(wall, 50),
        wall_s_p95=_percentile(wall, 95),
    )


def total(summaries: Sequence[Summary]) -> Summary:
    """Put several cases into one summary: counts are summed, the rest are means over cases.

    Every case counts alike, however many scans it has; a case without a figure (no hit, so no
    error of hits) is left out of its mean.
    """
    figures: dict[str, Any] = {
        f.name: (sum if f.name in COUNTS else mean_of_known)(
            [getattr(summary, f.name) for summary in summaries]
        )
        for f in fields(Summary)
    }
    return Summary(**figures)


def mean_of_known(values: Iterable[float | None]) -> float | None:
    """Return the mean of the values that are known; None if none is."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def _share(holds: Iterable[bool]) -> float | None:
    return mean_of_known(float(h) for h in holds)


def _percentile(values: Sequence[float], percent: float) -> float | None:
    return float(np.percentile(values, percent)) if len(values) else None
