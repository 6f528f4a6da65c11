"""The paper's experiments in figures: the same drives, begun in different ways.

The JSON document::

    {"suite": "paper", "drives": K, "seed", "drive_s",
     "machine": {...from `machine.this_machine`...},
     "rows": [{"world", "start", "drives", "right", "wrong", "open", "misled", "time_s",
               "time_s_max", "driven_m", "start_cpu_s", "cpu_ms_per_scan"}, ...],
     "totals": [{...the same keys, "world" is "total"...}, ...],
     "trials": [{"world", "seed", "start", "ending", "time_s", "driven_m", "misled_s",
                 "start_cpu_s", "cpu_ms_per_scan"}, ...]}
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from itertools import pairwise
from typing import Any

import numpy as np

from firstfix.lab.experiments.starts import Attempt, Belief, Start
from firstfix.lab.metrics.metrics import mean_of_known
from firstfix.lab.metrics.outcome import is_found
from firstfix.lab.reports.tables import Row, columns_table, markdown_table

# A pose that is right in passing is not right: it must have been so for the last seconds.
STAYS_S = 5.0

# Longer than a filter needs to narrow around a pose that was given to it.
MISLED_S = 1.0

# Title, key in the document, format.
COLUMNS = (
    ("drives", "drives", ".0f"),
    ("right", "right", ".0f"),
    ("wrong", "wrong", ".0f"),
    ("open", "open", ".0f"),
    ("misled", "misled", ".0f"),
    ("time s", "time_s", ".1f"),
    ("longest s", "time_s_max", ".1f"),
    ("driven m", "driven_m", ".1f"),
    ("start CPU s", "start_cpu_s", ".2f"),
    ("CPU ms a scan", "cpu_ms_per_scan", ".2f"),
)


class Ending(Enum):
    """How an attempt ended."""

    RIGHT = "right"
    WRONG = "wrong"
    OPEN = "open"


@dataclass(frozen=True, slots=True)
class Trial:
    """One attempt, judged.

    Parameters
    ----------
    world : str
        The building.
    seed : int
        Of the drive.
    start : Start
        The way.
    ending : Ending
        RIGHT: within 0.5 m and 10° of the truth at the end, and for `STAYS_S` before. WRONG: sure
        of another place. OPEN: neither.
    time_s, driven_m : float or None
        Until the pose was right for good, s and m; None if it was not.
    misled_s : float
        For how long it was sure of a wrong pose, s.
    start_cpu_s : float
        Processor time for the map and for all scans up to the first pose, s.
    cpu_ms_per_scan : float
        Processor time of a later scan, mean, ms.
    """

    world: str
    seed: int
    start: Start
    ending: Ending
    time_s: float | None
    driven_m: float | None
    misled_s: float
    start_cpu_s: float
    cpu_ms_per_scan: float


def judge_attempt(world: str, seed: int, attempt: Attempt) -> Trial:
    """Compare what was believed with the truth.

    Parameters
    ----------
    world : str
        The building.
    seed : int
        Of the drive.
    attempt : Attempt
        With at least one belief.

    Returns
    -------
    Trial
        The attempt in figures.
    """
    beliefs = attempt.beliefs
    settled = _settled(beliefs)
    steps = [a.truth.distance_to(b.truth) for a, b in pairwise(beliefs)]
    known = [i for i, belief in enumerate(beliefs) if belief.T_map_base is not None]
    first = known[0] if known else len(beliefs) - 1
    cpu_s = [belief.cpu_s for belief in beliefs]
    later = cpu_s[first + 1 :]
    ending = Ending.WRONG if _is_misled(beliefs[-1]) else Ending.OPEN
    return Trial(
        world=world,
        seed=seed,
        start=attempt.start,
        ending=ending if settled is None else Ending.RIGHT,
        time_s=None if settled is None else beliefs[settled].stamp - beliefs[0].stamp,
        driven_m=None if settled is None else float(sum(steps[:settled])),
        misled_s=_misled_s(beliefs),
        start_cpu_s=attempt.prepare_s + sum(cpu_s[: first + 1]),
        cpu_ms_per_scan=1e3 * sum(later) / len(later) if later else 0.0,
    )


def paper_document(trials: Sequence[Trial], seed: int, drive_s: float) -> dict[str, Any]:
    """Put trials into the document described above; ``seed`` is that of the first drive."""
    worlds = list(dict.fromkeys(trial.world for trial in trials))
    starts = [start for start in Start if any(trial.start is start for trial in trials)]
    rows = [
        _row(world, start, [t for t in trials if t.world == world and t.start is start])
        for world in worlds
        for start in starts
    ]
    return {
        "suite": "paper",
        "drives": len({trial.seed for trial in trials}),
        "seed": seed,
        "drive_s": drive_s,
        "rows": rows,
        "totals": [
            _row("total", start, [t for t in trials if t.start is start]) for start in starts
        ],
        "trials": [
            {**asdict(trial), "start": trial.start.value, "ending": trial.ending.value}
            for trial in trials
        ],
    }


def paper_table(document: Row) -> str:
    """Lay out the sums over all worlds, one way of starting a line, in Markdown."""
    return columns_table(document["totals"], {"start": "start"}, COLUMNS)


def worlds_table(document: Row) -> str:
    """Lay out right, wrong and open of every world and way, in Markdown."""
    starts = [row["start"] for row in document["totals"]]
    cells: dict[str, list[str]] = {}
    for row in document["rows"]:
        ended = f"{row['right']} / {row['wrong']} / {row['open']}"
        cells.setdefault(row["world"], []).append(ended)
    return markdown_table(["world", *starts], [[world, *row] for world, row in cells.items()])


def details_table(document: Row) -> str:
    """Lay out all figures of every world and way, in Markdown."""
    return columns_table(document["rows"], {"world": "world", "start": "start"}, COLUMNS)


def _settled(beliefs: Sequence[Belief]) -> int | None:
    """Return the scan from which on the pose is right, if that is long enough before the end."""
    wrong = [i for i, belief in enumerate(beliefs) if not _is_right(belief)]
    settled = wrong[-1] + 1 if wrong else 0
    if settled == len(beliefs):
        return None
    stayed = beliefs[-1].stamp - beliefs[settled].stamp
    return settled if stayed >= STAYS_S or not wrong else None


def _is_right(belief: Belief) -> bool:
    return belief.T_map_base is not None and is_found(belief.T_map_base, belief.truth)


def _is_misled(belief: Belief) -> bool:
    return belief.sure and not _is_right(belief)


def _misled_s(beliefs: Sequence[Belief]) -> float:
    return math.fsum(
        after.stamp - before.stamp for before, after in pairwise(beliefs) if _is_misled(before)
    )


def _row(world: str, start: Start, trials: Sequence[Trial]) -> dict[str, Any]:
    times = [trial.time_s for trial in trials if trial.time_s is not None]
    driven = [trial.driven_m for trial in trials if trial.driven_m is not None]
    return {
        "world": world,
        "start": start.value,
        "drives": len(trials),
        **{ending.value: sum(t.ending is ending for t in trials) for ending in Ending},
        "misled": sum(trial.misled_s > MISLED_S for trial in trials),
        "time_s": float(np.median(times)) if times else None,
        "time_s_max": max(times) if times else None,
        "driven_m": float(np.median(driven)) if driven else None,
        "start_cpu_s": mean_of_known(trial.start_cpu_s for trial in trials),
        "cpu_ms_per_scan": mean_of_known(trial.cpu_ms_per_scan for trial in trials),
    }
