"""Reports of the suites that have no pictures of places: ablation and scaling."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firstfix.lab.experiments.ablation import ablation_table
from firstfix.lab.experiments.calibration import calibration_tables
from firstfix.lab.experiments.machine import machine_text
from firstfix.lab.experiments.scaling import cost_table, threads_table
from firstfix.lab.reports.output_files import make_folder, write_page
from firstfix.lab.reports.text import Row
from firstfix.plots.figure import PALETTE, new_figure, number_plainly, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ABLATION = (
    "The default method with one of its steps left out; figures are means over the cases of a "
    "kind. Without expected ranges or end points the search adds up only the other score. Without "
    "verification cost places keep the order of the search. Without it, or without the verdict "
    "law, the first place is always published, as the paper does. The rules of one scan ask for "
    "a view that is wide enough, and for a lead in more than one thing."
)
CALIBRATION = (
    "The law of one scan (exponent, floor, threshold), chosen with all buildings but one: the law "
    "that answers most scans, of those that are wrong in at most 0.5 % of the answers and of the "
    "scans on a wrong map, with every sensor. It is judged on the building that was left out, "
    "beside the law of the package. The rules of one scan hold for both."
)
SCALING = (
    "Drawn offices of one plan side by side, each furnished in its own way, on cells of 0.05 m; "
    "scans of 360 beams all round, 12 m far. Prepare: processor time for the map, no cache. CPU: "
    "of one scan, median and most. RSS: peak of a process that does nothing else, with that "
    "of Python and its compiled kernels alone before it. Above 800 000 positions the default "
    "search looks every 0.4 m instead of 0.2 m. Success is no promise for a building: here a scan "
    "may fit on every floor but for a few boxes, and with a hundred floors the right one may be "
    "missing in the shortlist of 150 places."
)
THREADS = (
    "No kernel starts threads of its own, so a scan takes one core (`NUMBA_NUM_THREADS` changes "
    "nothing). All kernels release the GIL: threads that share one `ScanMatcher` locate several "
    "scans at a time, with the same answers. Of seven runs in turn the fastest counts: what "
    "else the machine does only slows them."
)


def write_ablation_report(document: dict[str, Any], folder: Path) -> Path:
    """Write ``report.md`` into a folder and return it; see `write_page`."""
    return write_page(
        [
            "# firstfix bench --suite ablation",
            machine_text(document["machine"]),
            ABLATION,
            ablation_table(document),
        ],
        folder,
    )


def write_calibration_report(document: dict[str, Any], folder: Path) -> Path:
    """Write ``report.md`` into a folder and return it; see `write_page`."""
    totals, rows = calibration_tables(document)
    return write_page(
        [
            "# firstfix bench --suite calibration",
            machine_text(document["machine"]),
            CALIBRATION,
            totals,
            "## Each building that was left out",
            rows,
        ],
        folder,
    )


def write_scaling_report(document: dict[str, Any], folder: Path) -> Path:
    """Write ``report.md`` with its plot into a folder and return it; see `write_page`."""
    make_folder(folder)
    save_scaling(document, folder / "scaling.png")
    return write_page(
        [
            "# firstfix bench --suite scaling",
            machine_text(document["machine"]),
            SCALING,
            "![time and memory against area and beams](scaling.png)",
            "## Area",
            cost_table(document["area"]),
            "## Beams",
            cost_table(document["beams"]),
            "## Threads",
            THREADS,
            threads_table(document["threads"]),
        ],
        folder,
    )


def save_scaling(document: dict[str, Any], path: Path) -> Path:
    """Plot time and memory against area, and time against beams."""
    figure = new_figure(13.0, 4.5)
    time, memory, beams = figure.subplots(1, 3)
    methods = list(dict.fromkeys(row["method"] for row in document["area"]))
    for method, colour in zip(methods, PALETTE, strict=False):
        rows = [row for row in document["area"] if row["method"] == method]
        _plot(time, rows, "cpu_s", colour, "-", f"{method}, a scan")
        _plot(time, rows, "prepare_s", colour, ":", f"{method}, preparing")
        _plot(memory, rows, "rss_mb", colour, "-", method)
        wide = [row for row in document["beams"] if row["method"] == method]
        for area, dash in zip(
            dict.fromkeys(row["map_area_m2"] for row in wide), "-:", strict=False
        ):
            some = [row for row in wide if row["map_area_m2"] == area]
            y = [row["cpu_s"] for row in some]
            x = [row["beams"] for row in some]
            beams.plot(x, y, dash, marker="o", color=colour, label=f"{method}, {area:.0f} m²")
    time.set(xlabel="area of the map, m²", ylabel="CPU s")
    memory.set(xlabel="area of the map, m²", ylabel="peak memory, MB", ylim=(0.0, None))
    beams.set(xlabel="beams of a scan", ylabel="CPU s a scan", xscale="log", yscale="log")
    time.set(xscale="log", yscale="log")
    memory.set(xscale="log")
    for axis in (time.xaxis, time.yaxis, memory.xaxis, beams.xaxis, beams.yaxis):
        number_plainly(axis)
    for axes in (time, memory, beams):
        axes.grid(which="both", alpha=0.25)
        axes.legend(fontsize="x-small")
    return save_figure(figure, path)


def _plot(axes: Axes, rows: Sequence[Row], key: str, colour: str, dash: str, label: str) -> None:
    x, y = [row["map_area_m2"] for row in rows], [row[key] for row in rows]
    axes.plot(x, y, dash, marker="o", color=colour, label=label)
