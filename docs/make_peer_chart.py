"""Draws docs/peers.png from the recorded comparison: ``python docs/make_peer_chart.py``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from firstfix.plots.figure import BLUE, GREEN, ORANGE, PURPLE, new_figure, save_figure

ROOT = Path(__file__).parents[1]
FIGURES = ROOT / "benchmarks" / "reports" / "2026-11-29" / "peers.json"
PICTURE = Path(__file__).parent / "peers.png"
COLOURS = (GREEN, BLUE, PURPLE, ORANGE)


def main() -> None:
    """Draw CPU time a scan for each method and building, with the success next to the bar."""
    measured = json.loads(FIGURES.read_text(encoding="utf-8"))["locate"]
    figure = new_figure(9.0, 4.6)
    axes = figure.subplots()
    rows = np.arange(len(measured["cases"]))
    height = 0.8 / len(measured["methods"])
    for i, (method, colour) in enumerate(zip(measured["methods"], COLOURS, strict=True)):
        seconds = np.array([np.mean(case["cpu_s"][i]) for case in measured["cases"]])
        places = rows + (i - 1.5) * height
        axes.barh(places, 1e3 * seconds, height, color=colour, label=method)
        for place, value, case in zip(places, seconds, measured["cases"], strict=True):
            found = case["success"][i]
            axes.text(1.1e3 * value, place, found, va="center", fontsize="small")
    axes.set_xscale("log")
    axes.set_xlim(5.0, 1.2e4)
    axes.set_xlabel("CPU time a scan, ms (logarithmic); middle of the range over three cases")
    axes.set_yticks(rows, [case["case"] for case in measured["cases"]])
    axes.invert_yaxis()
    figure.legend(fontsize="small", loc="outside lower center", ncols=2)
    axes.set_title("One simulated scan, no initial guess: CPU time and scans located correctly")
    save_figure(figure, PICTURE)


if __name__ == "__main__":
    main()
