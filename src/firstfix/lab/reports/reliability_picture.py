"""Picture of calibration, and of coverage against risk."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from firstfix.lab.metrics.reliability import GOAL_COVERAGE, GOAL_RISK
from firstfix.lab.reports.text import Row
from firstfix.plots.figure import PALETTE, new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Risks are shown linearly up to the first and logarithmically above: 0 is on the axis.
_LINEAR_RISK = 1e-3
_RISKS = (0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
_LEAST_COVERAGE = 0.4


def save_reliability(entries: Sequence[Row], path: Path) -> Path:
    """Draw a reliability diagram and risk-coverage curves of a document; see `save_figure`."""
    figure = new_figure(11.0, 5.0)
    diagram, curves = figure.subplots(1, 2)
    for entry, colour in zip(entries, PALETTE, strict=False):
        label = f"{entry['method']}, {entry['sensor']}, {entry['kind']} ({entry['n']} scans)"
        _draw_bins(diagram, entry, colour, label)
        _draw_curve(curves, entry["own"]["curve"], colour, "-", label)
        if entry["with_wrong_map"] is not None:
            more = f"and {entry['wrong_map_n']} on wrong maps"
            _draw_curve(curves, entry["with_wrong_map"]["curve"], colour, ":", more)
    diagram.plot([0.0, 1.0], [0.0, 1.0], color="0.6", lw=1, zorder=0)
    diagram.set(xlabel="probability claimed for the best place", ylabel="share that is right")
    diagram.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.05))
    curves.plot(GOAL_COVERAGE, GOAL_RISK, "k*", ms=11, label="goal: 0.3 % at 88 %", zorder=5)
    curves.set_yscale("symlog", linthresh=_LINEAR_RISK)
    curves.set_yticks(_RISKS, [f"{100 * risk:g} %" for risk in _RISKS])
    curves.set(xlim=(_LEAST_COVERAGE, 1.01), ylim=(-1e-4, 1.0))
    curves.set(xlabel="coverage: share of scans answered", ylabel="risk: share of answers wrong")
    for axes, corner in ((diagram, "lower right"), (curves, "upper left")):
        axes.grid(alpha=0.25)
        axes.legend(fontsize="x-small", loc=corner)
    return save_figure(figure, path)


def _draw_bins(axes: Axes, entry: Row, colour: str, label: str) -> None:
    bins = entry["bins"]
    claimed, right = [b["claimed"] for b in bins], [b["right"] for b in bins]
    below = [b["right"] - b["right_low"] for b in bins]
    above = [b["right_high"] - b["right"] for b in bins]
    axes.errorbar(
        claimed, right, yerr=[below, above], fmt="o-", ms=4, lw=1.2, color=colour, capsize=2,
        label=label,
    )  # fmt: skip
    for b in bins:
        axes.annotate(
            str(b["n"]), (b["claimed"], b["right"]), xytext=(3, -9), textcoords="offset points",
            fontsize=6, color=colour,
        )  # fmt: skip


def _draw_curve(axes: Axes, curve: Row, colour: str, dash: str, label: str) -> None:
    marker = "o" if len(curve["risk"]) == 1 else None
    axes.plot(
        curve["coverage"], curve["risk"], ls=dash, marker=marker, color=colour, lw=1.4,
        drawstyle="steps-pre", label=label,
    )  # fmt: skip
