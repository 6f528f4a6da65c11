"""A report of a benchmark: a table, error curves, time against area."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from firstfix.lab.experiments.locate_bench import CaseRun
from firstfix.lab.experiments.machine import machine_text
from firstfix.lab.metrics.outcome import FOUND
from firstfix.lab.metrics.reliability import reliability_table
from firstfix.lab.reports.locate_document import (
    bench_table,
    buildings_table,
    sensors_table,
    wrong_map_table,
)
from firstfix.lab.reports.output_files import make_folder, write_page
from firstfix.lab.reports.reliability_picture import save_reliability
from firstfix.plots.figure import (
    PALETTE,
    line_style,
    new_figure,
    number_plainly,
    save_figure,
    share_curve,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Errors are shown on a logarithmic axis between these, m.
LEAST_M, MOST_M = 1e-3, 1e2
LEGEND = (
    "Success: the best hypothesis within 0.5 m and 10° of the truth, whatever the verdict. "
    "Unique, right and wrong: verdict UNIQUE, of these right (share) and wrong (count). "
    "Errors are those of the successes. Times are of `locate` alone, one scan."
)

BUILDINGS = (
    "Every scan counts alike. A building is out of sample if no constant of the verdict was chosen "
    "with its scans."
)

RELIABILITY = (
    "Left: of the scans for whose best place a probability was claimed, so many are right (bars: "
    "95 % intervals; small numbers: scans). Right: if everything from a probability on is "
    "answered, so much is covered, and so much of it is wrong. Scans count alike, whatever case "
    "they are of. Wrong map: scans of other buildings, where they were tried; they have no right "
    "answer, so that every answer is a risk."
)


def write_report(runs: Sequence[CaseRun], document: dict[str, Any], folder: Path) -> Path:
    """Write ``report.md`` with its plots into a folder and return it; see `write_page`."""
    make_folder(folder)
    save_error_curves(runs, folder / "error_curves.png")
    save_times(runs, folder / "time_by_area.png")
    save_reliability(document["reliability"], folder / "reliability.png")
    return write_page(_parts(document), folder)


def save_error_curves(runs: Sequence[CaseRun], path: Path) -> Path:
    """Plot for every case which share of its scans has at most which position error."""
    settings = _settings(runs)
    figure = new_figure(4.0 + 5.0 * len(settings), 6.0)
    panels = figure.subplots(1, len(settings), squeeze=False, sharey=True)[0]
    names = list(dict.fromkeys(run.case for run in runs))
    for setting, axes in zip(settings, panels, strict=True):
        for run in runs:
            if _setting(run) == setting:
                _error_curve(axes, run, names.index(run.case))
        axes.axvline(FOUND.metres, color="0.5", lw=1, zorder=0)
        axes.set(xscale="log", xlim=(LEAST_M, MOST_M), ylim=(0.0, 1.02))
        axes.set(title=setting, xlabel="error of position at most, m")
        axes.grid(which="both", alpha=0.25)
    panels[0].set_ylabel("share of scans")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", fontsize="small")
    return save_figure(figure, path)


def save_times(runs: Sequence[CaseRun], path: Path) -> Path:
    """Plot processor time of a scan, median and 95th percentile, against the free area."""
    figure = new_figure(9.0, 6.0)
    axes = figure.subplots()
    lowest: dict[str, tuple[float, float]] = {}
    for setting, colour, marker in zip(_settings(runs), PALETTE, "osD^v*", strict=False):
        own = [run for run in runs if _setting(run) == setting]
        area = np.array([run.free_area_m2 for run in own])
        times_ms = [[1e3 * outcome.cpu_s for outcome in run.outcomes] for run in own]
        median, most = (np.array([np.percentile(t, p) for t in times_ms]) for p in (50, 95))
        axes.vlines(area, median, most, color=colour, alpha=0.5, lw=1.5)
        axes.scatter(area, median, color=colour, marker=marker, label=setting, zorder=3)
        for run, y in zip(own, median, strict=True):
            x, least = lowest.get(run.site, (run.free_area_m2, y))
            lowest[run.site] = (x, min(least, y))
    for site, point in lowest.items():  # the names of all cases of a building would hide each other
        axes.annotate(
            site, point, xytext=(4, -9), textcoords="offset points", fontsize=6, color="0.35"
        )
    axes.set(xscale="log", yscale="log")
    axes.margins(0.12)
    number_plainly(axes.xaxis)
    number_plainly(axes.yaxis)
    axes.set(xlabel="free area of the map, m²", ylabel="CPU time of a scan, ms (line: up to p95)")
    axes.grid(which="both", alpha=0.25)
    axes.legend()
    return save_figure(figure, path)


def _error_curve(axes: Axes, run: CaseRun, number: int) -> None:
    errors = [outcome.error.metres for outcome in run.outcomes]
    x, y = share_curve(errors, LEAST_M, MOST_M)
    axes.step(x, y, where="post", **line_style(number), lw=1.3, label=run.case)


def _setting(run: CaseRun) -> str:
    return f"{run.method}, {run.sensor}"


def _settings(runs: Sequence[CaseRun]) -> list[str]:
    return list(dict.fromkeys(_setting(run) for run in runs))


def _parts(document: dict[str, Any]) -> list[str]:
    parts = [
        "# firstfix bench",
        machine_text(document["machine"]),
        LEGEND,
        bench_table(document),
        "## Sensors",
        sensors_table(document),
        "## Buildings",
        BUILDINGS,
        buildings_table(document),
    ]
    if document["wrong_map_cases"]:
        parts += ["## Scans on the maps of other buildings", wrong_map_table(document)]
    parts += [
        "## Probabilities",
        RELIABILITY,
        reliability_table(document["reliability"]),
        "![claims and risk](reliability.png)",
        "## Errors",
        "![share of scans by position error](error_curves.png)",
        "## Time",
        "![CPU time by free area](time_by_area.png)",
    ]
    return parts
