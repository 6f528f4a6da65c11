"""The report of a soak: tables, figures as JSON, and a picture of the whole time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from soak_judged import RIGHT_DEG, RIGHT_M, STALE_S

from firstfix.lab.experiments.machine import machine_text
from firstfix.lab.reports.text import columns_table, markdown_table
from firstfix.plots.figure import BLUE, GREEN, ORANGE, RED, SKY, new_figure, save_figure

Row = dict[str, Any]

_MINUTES = (
    ("minute", "minute", ".0f"),
    ("faults", "faults", ".0f"),
    ("RSS MB", "rss_mb", ".0f"),
    ("CPU", "cpu", ".0%"),
    ("scans/s", "scans_hz", ".1f"),
    ("poses/s", "poses_hz", ".1f"),
    ("lag ms", "median", ".1f"),
    ("p99", "p99", ".0f"),
    ("most", "max", ".0f"),
    ("right", "right", ".0f"),
    ("stale", "stale", ".0f"),
    ("wrong", "wrong", ".0f"),
    ("page gap s", "page_gap_s", ".1f"),
)
_FAULTS = (
    ("n", "n", ".0f"),
    ("lasted s", "lasted_s", ".1f"),
    ("right after s", "median", ".1f"),
    ("most", "max", ".1f"),
    ("next came first", "next_came_first", ".0f"),
)
_LIVES = (
    ("from s", "from_s", ".0f"),
    ("lived s", "seconds", ".0f"),
    ("MB after 1 min", "mb_after_a_minute", ".0f"),
    ("MB at the end", "mb_at_the_end", ".0f"),
    ("MB/h", "mb_an_hour", "+.1f"),
    ("threads most", "threads_most", ".0f"),
    ("end", "threads_at_the_end", ".0f"),
    ("files most", "files_most", ".0f"),
    ("files end", "files_at_the_end", ".0f"),
)
_NONE = {"n": 0, "median": None, "p99": None, "max": None}


def write_report(figures: Row, folder: Path | None) -> str:
    """Write a report, with its figures and its picture, and return its text.

    Parameters
    ----------
    figures : dict
        From `soak_judged.judge`.
    folder : Path or None
        Where to; None for nowhere.

    Returns
    -------
    str
        Markdown.
    """
    text = "\n\n".join(_sections(figures)) + "\n"
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "report.md").write_text(text, encoding="utf-8")
        kept = {key: value for key, value in figures.items() if key != "series"}
        short = json.dumps(_shortened(kept), indent=1)
        (folder / "figures.json").write_text(short + "\n", encoding="utf-8")
        _draw(figures, folder / "soak.png")
    return text


def _sections(figures: Row) -> list[str]:
    settings = figures["settings"]
    command = " ".join(f"--{name} {value}" for name, value in settings.items())
    return [
        f"# benchmarks/soak.py {command}",
        machine_text(figures["machine"]),
        (
            f"A simulated Kobuki in the built-in `{settings['world']}`, over a real roscore; "
            f"`firstfix serve --robot ros1` in mode `{settings['mode']}`; a viewer of its page. "
            f"Right: within {RIGHT_M:g} m and {RIGHT_DEG:g} degrees at the stamp of the scan. "
            "Stale: the robot was just moved, and the pose continues the last right "
            f"one by odometry, for {STALE_S:g} s at most. Wrong: anything else."
        ),
        "![memory, lag and faults over time](soak.png)",
        "## Poses",
        _poses(figures),
        _wrong(figures),
        "## Time",
        _time(figures),
        "## Faults",
        _faults(figures),
        "## The node's memory",
        columns_table(figures["memory"], {}, _LIVES).rstrip(),
        _processes(figures),
        "## Log messages",
        _log(figures),
        "## Minute by minute",
        _minutes(figures),
    ]


def _poses(figures: Row) -> str:
    rows = [
        [topic, *map(str, counts.values())] for topic, counts in sorted(figures["poses"].items())
    ]
    head = ["topic", *next(iter(figures["poses"].values()), {})]
    held = [move for move in figures["stale"] if move["poses"]]
    worst = max((move["held_s"] for move in held), default=0.0)
    return (
        f"{markdown_table(head, rows)}\n"
        f"A right pose came for {figures['right_share']:.1%} of all scans that were sent. The "
        f"robot was moved {len(figures['stale'])} times; after {len(held)} of these the old "
        f"pose was believed for a while, {worst:.1f} s at most from the moment it was moved."
    )


def _wrong(figures: Row) -> str:
    if not figures["wrong"]:
        return "No wrong pose was published."
    keys = ("topic", "at_s", "off_m", "off_deg", "phase", "moved", "since_moved_s")
    cells = [
        [f"{row[key]:.2f}" if isinstance(row[key], float) else f"{row[key]}" for key in keys]
        for row in figures["wrong"]
    ]
    return "Wrong poses, the first of each topic:\n\n" + markdown_table(keys, cells).rstrip()


def _time(figures: Row) -> str:
    page = figures["page"]
    rows = [
        ["scan to pose, all, ms", figures["lag_ms"]["all"]],
        ["scan to pose, calm, ms", figures["lag_ms"]["calm"]],
        ["scan to page, calm, ms", page["lag_calm_ms"]],
        ["gaps of the page above 1 s, s", page["gaps_s"]],
        ["those in calm times, s", page["gaps_calm_s"]],
    ]
    cells = [
        [name, f"{spread['n']}", *(f"{spread[key]:.1f}" for key in ("median", "p99", "max"))]
        for name, spread in rows
        if spread is not None
    ]
    scans = figures["answered_calm"]
    cuts = ", ".join(f"{n} {why}" for why, n in page["cuts"].items()) or "none"
    return (
        f"{markdown_table(['time', 'n', 'median', 'p99', 'most'], cells)}\n"
        f"In calm times {scans['with a pose']} of {scans['scans']} scans have a pose. The viewer "
        f"connected {page['connections']} times (refused or cut: {cuts}) and got {page['states']} "
        "states."
    )


def _faults(figures: Row) -> str:
    rows = [
        {**row, **(row["right_after_s"] or _NONE)} | {"n": row["n"]} for row in figures["faults"]
    ]
    return (
        columns_table(rows, {"what": "kind"}, _FAULTS)
        + "\nRight after: from the end of the fault to the arrival of the next right pose (for a "
        "process that is killed: from its start, with all that it loads)."
    )


def _processes(figures: Row) -> str:
    cells = [[p["who"], f"{p['cpu']:.0%}", f"{p['mb_most']:.0f}"] for p in figures["parts"]]
    deaths = figures["deaths"]
    died = ", ".join(f"{d['who']} at {d['at']:.0f} s" for d in deaths) or "none"
    table = markdown_table(["process", "CPU (of a core)", "most MB"], cells)
    return f"{table}\nProcesses that ended by themselves: {died}."


def _log(figures: Row) -> str:
    cells = [
        [row["who"], row["level"] or "-", str(row["n"]), row["text"].replace("|", "/")]
        for row in figures["log"]
    ]
    return markdown_table(["who", "level", "n", "text"], cells).rstrip()


def _minutes(figures: Row) -> str:
    rows = [{**row, **(row["lag_ms"] or _NONE)} for row in figures["minutes"]]
    return columns_table(rows, {}, _MINUTES).rstrip()


def _shortened(value: Any) -> Any:
    """Round to six digits, which is more than was measured."""
    if isinstance(value, dict):
        return {key: _shortened(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_shortened(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _draw(figures: Row, path: Path) -> None:
    """Draw memory, lag and what happened against time."""
    series = figures["series"]
    drawing = new_figure(12.0, 8.0)
    memory, lag, faults = drawing.subplots(
        3, 1, sharex=True, gridspec_kw={"height_ratios": [1.0, 1.0, 2.2]}
    )
    for life in series["memory"]:
        memory.plot([at / 60.0 for at, _ in life], [mb for _, mb in life], color=BLUE)
    memory.set_ylabel("node, MB")
    memory.set_ylim(bottom=0.0)
    lag.semilogy([at / 60.0 for at, _ in series["lag"]], [ms for _, ms in series["lag"]], ".",
                 color=SKY, markersize=2)  # fmt: skip
    lag.set_ylabel("scan to pose, ms")
    kinds = sorted({fault["kind"] for fault in figures["fault_list"]})
    for fault in figures["fault_list"]:
        row, begin = kinds.index(fault["kind"]), fault["begin"] / 60.0
        lasted = max(fault["end"] - fault["begin"], 2.0) / 60.0
        after = min(fault["right_after_s"] or 0.0, 60.0) / 60.0
        faults.barh(row, after, left=fault["end"] / 60.0, color=GREEN, height=0.5)
        faults.barh(row, lasted, left=begin, color=ORANGE, height=0.8)
    for wrong in figures["wrong"]:
        faults.axvline(wrong["at_s"] / 60.0, color=RED)
    faults.set_yticks(range(len(kinds)), kinds)
    faults.set_xlabel("minutes; orange: a fault, green: until the pose is right again")
    save_figure(drawing, path)
