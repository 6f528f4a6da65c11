"""The figures of ``firstfix bench --starts``: JSON, tables and report.

The JSON document::

    {"seed", "machine": {...see `machine.this_machine`...},
     "sensors": [{"sensor", "starts", "counted", "right", "wrong", "open", "right_share",
                  "wrong_share", "open_share", "way_m", "way_m_p90", "time_s", "time_s_p90",
                  "reports", "listed", "elsewhere", "contained", "cpu_ms", "cpu_ms_p95"}, ...],
     "buildings": [{"site", ...the same keys...}, ...],
     "cases": [{"name", "site", ...the same keys...}, ...],
     "starts": [{"case", "site", "sensor", "scan", "ending", "way_m", "time_s", "scans", "reports",
                 "listed", "elsewhere", "cpu_ms"}, ...],
     "left_out": [{"name", "why"}, ...]}
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from firstfix.lab.experiments.machine import machine_text, this_machine
from firstfix.lab.experiments.start_bench import ELSEWHERE_MASS, OPEN_M, Ending, StartRun
from firstfix.lab.reports.output_files import write_page
from firstfix.lab.reports.text import Row, columns_table
from firstfix.plots.figure import line_style, new_figure, save_figure, share_curve

# Title, key in the document, format.
COLUMNS = (
    ("starts", "starts", ".0f"),
    ("counted", "counted", ".0f"),
    ("right", "right", ".0f"),
    ("wrong", "wrong", ".0f"),
    ("open", "open", ".0f"),
    ("right %", "right_share", ".1%"),
    ("wrong %", "wrong_share", ".1%"),
    ("open %", "open_share", ".1%"),
    ("way m", "way_m", ".1f"),
    ("p90 m", "way_m_p90", ".1f"),
    ("time s", "time_s", ".1f"),
    ("p90 s", "time_s_p90", ".1f"),
    ("listed", "listed", ".1%"),
    ("elsewhere", "elsewhere", ".1%"),
    ("CPU ms", "cpu_ms", ".1f"),
    ("p95 ms", "cpu_ms_p95", ".1f"),
)
LEGEND = (
    "The localizer starts at random scans of each drive and gets scans and odometry until it "
    "publishes a pose. Counted: the starts that were decided, or that went on for "
    f"{OPEN_M:g} m; the others end with the recorded run. Right and wrong: the first published "
    "pose, within 0.5 m and 10° of the truth or not. Open: no pose. Way and time (median, 90th "
    "percentile) go to the first pose; an open start counts as infinite. Listed: the reports of "
    "places that contain the true place. Elsewhere: the other reports that leave at least "
    f"{ELSEWHERE_MASS:.0%} of the probability to places that they do not list. CPU: of one scan."
)
_LEAST_M, _MOST_M = 0.1, 10.0


def start_document(
    runs: Sequence[StartRun], seed: int, left_out: Sequence[tuple[str, str]] = ()
) -> dict[str, Any]:
    """Put starts, at least one, into the document above; ``left_out``: case and reason."""
    return {
        "seed": seed,
        "machine": this_machine(),
        "sensors": _rows(runs, lambda run: {"sensor": run.sensor}),
        "buildings": _rows(runs, lambda run: {"site": run.site, "sensor": run.sensor}),
        "cases": _rows(
            runs, lambda run: {"name": run.case, "site": run.site, "sensor": run.sensor}
        ),
        "starts": [
            {**asdict(run), "ending": run.ending.value, "cpu_ms": sum(run.cpu_ms)} for run in runs
        ],
        "left_out": [{"name": name, "why": why} for name, why in left_out],
    }


def sensors_table(document: Row) -> str:
    """Lay out the figures of every sensor."""
    return columns_table(document["sensors"], {"sensor": "sensor"}, COLUMNS)


def buildings_table(document: Row) -> str:
    """Lay out the figures of every building."""
    words = {"building": "site", "sensor": "sensor"}
    return columns_table(document["buildings"], words, COLUMNS)


def write_start_report(runs: Sequence[StartRun], document: dict[str, Any], folder: Path) -> Path:
    """Write ``report.md`` with its plot into a folder and return it; see `write_page`."""
    save_way_curves(runs, folder / "way_to_first_pose.png")
    return write_page(
        [
            "# firstfix bench --starts",
            machine_text(document["machine"]),
            LEGEND,
            sensors_table(document),
            "## Buildings",
            buildings_table(document),
            *(f"Left out: {row['name']} ({row['why']})." for row in document["left_out"]),
            "## Way to the first pose",
            "![share of the starts that are right by the way driven](way_to_first_pose.png)",
        ],
        folder,
    )


def save_way_curves(runs: Sequence[StartRun], path: Path) -> Path:
    """Plot for every sensor the share of starts that are right within a way."""
    figure = new_figure(9.0, 5.0)
    axes = figure.subplots()
    for number, sensor in enumerate(dict.fromkeys(run.sensor for run in runs)):
        counted = [run for run in runs if run.sensor == sensor and run.counts]
        ways = [run.way_m if run.ending is Ending.RIGHT else math.inf for run in counted]
        if ways:
            x, y = share_curve(ways, _LEAST_M, _MOST_M)
            axes.step(x, y, where="post", **line_style(number), label=f"{sensor} ({len(ways)})")
    axes.set(xscale="log", xlim=(_LEAST_M, _MOST_M), ylim=(0.0, 1.02))
    axes.set(xlabel="way driven, m", ylabel="share of starts with a right pose")
    axes.grid(which="both", alpha=0.25)
    if axes.get_legend_handles_labels()[0]:
        figure.legend(loc="outside right upper", title="sensor (starts)", fontsize="small")
    return save_figure(figure, path)


def _rows(
    runs: Sequence[StartRun], words_of: Callable[[StartRun], dict[str, str]]
) -> list[dict[str, Any]]:
    groups: dict[tuple[str, ...], list[StartRun]] = {}
    for run in runs:
        groups.setdefault(tuple(words_of(run).values()), []).append(run)
    return [{**words_of(group[0]), **_figures(group)} for group in groups.values()]


def _figures(runs: Sequence[StartRun]) -> dict[str, Any]:
    counted = [run for run in runs if run.counts]
    endings = {e.value: sum(run.ending is e for run in counted) for e in Ending}
    reports = sum(run.reports for run in runs)
    listed, elsewhere = (sum(getattr(run, key) for run in runs) for key in ("listed", "elsewhere"))
    decided = [run.ending is not Ending.OPEN for run in counted]
    ways = [run.way_m if done else math.inf for run, done in zip(counted, decided, strict=True)]
    times = [run.time_s if done else math.inf for run, done in zip(counted, decided, strict=True)]
    cpu_ms = [ms for run in runs for ms in run.cpu_ms]
    return {
        "starts": len(runs),
        "counted": len(counted),
        **endings,
        **{f"{ending}_share": _share(n, len(counted)) for ending, n in endings.items()},
        "way_m": _percentile(ways, 50),
        "way_m_p90": _percentile(ways, 90),
        "time_s": _percentile(times, 50),
        "time_s_p90": _percentile(times, 90),
        "reports": reports,
        "listed": _share(listed, reports),
        "elsewhere": _share(elsewhere, reports),
        "contained": _share(listed + elsewhere, reports),
        "cpu_ms": _percentile(cpu_ms, 50),
        "cpu_ms_p95": _percentile(cpu_ms, 95),
    }


def _share(n: int, of: int) -> float | None:
    return n / of if of else None


def _percentile(values: Sequence[float], percent: float) -> float | None:
    """Return the smallest value that so many percent do not exceed; None if it is not finite."""
    if not values:
        return None
    value = float(np.percentile(values, percent, method="inverted_cdf"))
    return value if math.isfinite(value) else None
