"""A report of kidnaps: tables, time to recover, and what a person should look at."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from firstfix.lab.experiments.kidnap_bench import KidnapRun, kidnap_table, kinds_table
from firstfix.lab.reports.page import write_page
from firstfix.plots.figure import line_style, new_figure, save_figure, share_curve

LEGEND = (
    "Detected: the old pose was given up within 3 s of useful scans; delay: median time until "
    "then. Recovered: the published pose is within 0.45 m and 10° of the truth for 10 s before the "
    "next disturbance; its times (median, p95) are those until these 10 s begin. Wrong: poses "
    "published as found that are not. Alarms: given up or found anew although nothing had "
    "happened. Slips are followed if the pose is right again, or still, as after a kidnap."
)

# Times are shown on a logarithmic axis between these, s.
LEAST_S, MOST_S = 0.05, 30.0


def write_kidnap_report(runs: Sequence[KidnapRun], document: dict[str, Any], folder: Path) -> Path:
    """Write ``report.md`` with its plot into a folder, which is made where it is missing.

    Parameters
    ----------
    runs : sequence of KidnapRun
        All scenarios.
    document : dict
        Their figures, from `kidnap_document`.
    folder : Path
        Where the report goes; its files are replaced.

    Returns
    -------
    Path
        ``report.md``, absolute.

    Raises
    ------
    InputError
        If it cannot be written, or matplotlib is not installed.
    """
    save_recovery_curves(runs, folder / "time_to_recover.png")
    return write_page(_parts(document), folder)


def save_recovery_curves(runs: Sequence[KidnapRun], path: Path) -> Path:
    """Plot for every world which share of its kidnaps is recovered within which time."""
    figure = new_figure(9.0, 5.0)
    axes = figure.subplots()
    worlds = list(dict.fromkeys(run.world for run in runs))
    for number, world in enumerate(worlds):
        times = [
            np.inf if kidnap.recovered_after_s is None else kidnap.recovered_after_s
            for run in runs
            if run.world == world
            for kidnap in run.trial.aftermaths
            if kidnap.is_kidnap
        ]
        if not times:
            continue
        x, y = share_curve(times, LEAST_S, MOST_S)
        axes.step(x, y, where="post", **line_style(number), label=f"{world} ({len(times)})")
    axes.set(xscale="log", xlim=(LEAST_S, MOST_S), ylim=(0.0, 1.02))
    axes.set(xlabel="time after the first useful scan, s", ylabel="share of kidnaps recovered")
    axes.grid(which="both", alpha=0.25)
    if axes.get_legend_handles_labels()[0]:
        figure.legend(loc="outside right upper", title="world (kidnaps)", fontsize="small")
    return save_figure(figure, path)


def _parts(document: dict[str, Any]) -> list[str]:
    parts = ["# firstfix bench --kidnap", LEGEND, kidnap_table(document), kinds_table(document)]
    if document["left_out"]:
        parts += [f"Left out: {row['name']} ({row['why']})." for row in document["left_out"]]
    parts += ["## Time to recover", "![share recovered by time](time_to_recover.png)"]
    parts += ["## What to look at", *(_incident(row) for row in document["incidents"])]
    if not document["incidents"]:
        parts.append("Nothing.")
    return parts


def _incident(row: dict[str, Any]) -> str:
    head = f"**{row['world']}**, {row['kind']}, seed {row['seed']}, {row['stamp']:.1f} s: "
    said = "\n".join(f"    {line}" for line in row["said"])
    return f"{head}{row['what']}\n\n{said}"
