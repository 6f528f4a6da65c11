"""The figures of ``firstfix bench --kidnap``: JSON, tables, report, and incidents to look at.

The JSON document::

    {"worlds": [{"name", "scenarios", "kidnaps", "signalled", "detected", "delay_s", "recovered",
                 "recover_s", "recover_s_p95", "wrong_published", "false_alarms_per_h",
                 "false_alarms", "strays", "calm_h", "known_before", "slips", "slips_recovered",
                 "start_right", "start_wrong", "start_s", "hours", "cpu_ms_per_scan", "cpu_ms_p95",
                 "by_kind": {KIND: {...}, ...}}, ...],
     "total": {...the same keys...},
     "incidents": [{"world", "kind", "seed", "stamp", "what", "said": [...]}, ...],
     "left_out": [{"name", "why"}, ...]}
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from firstfix.core.pose_error import PoseError
from firstfix.lab.metrics.kidnap_trial import (
    SLIP,
    SLOW_S,
    Aftermath,
    Instant,
    Trial,
    judge_trial,
)
from firstfix.lab.reports.output_files import make_folder, write_page
from firstfix.lab.reports.text import Row, columns_table
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

# Title, key in the document, format.
COLUMNS = (
    ("scenarios", "scenarios", ".0f"),
    ("kidnaps", "kidnaps", ".0f"),
    ("signalled", "signalled", ".0f"),
    ("detected", "detected", ".0f"),
    ("delay s", "delay_s", ".2f"),
    ("recovered", "recovered", ".0f"),
    ("recover s", "recover_s", ".2f"),
    ("p95 s", "recover_s_p95", ".2f"),
    ("wrong", "wrong_published", ".0f"),
    ("alarms/h", "false_alarms_per_h", ".1f"),
    ("slips", "slips", ".0f"),
    ("followed", "slips_recovered", ".0f"),
    ("CPU ms", "cpu_ms_per_scan", ".1f"),
)
KIND_COLUMNS = (
    ("scenarios", "scenarios", ".0f"),
    ("disturbances", "disturbances", ".0f"),
    ("detected", "detected", ".0f"),
    ("delay s", "delay_s", ".2f"),
    ("recovered", "recovered", ".0f"),
    ("recover s", "recover_s", ".2f"),
    ("p95 s", "recover_s_p95", ".2f"),
    ("wrong", "wrong_published", ".0f"),
    ("alarms/h", "false_alarms_per_h", ".1f"),
)

# Status messages kept with an incident.
_BEFORE_S, _AFTER_S, _LONG_S = 0.5, 2.0, 12.0
_MOST_LINES = 24


@dataclass(frozen=True, slots=True)
class Incident:
    """An event to investigate.

    Parameters
    ----------
    stamp : float
        Time, s.
    what : str
        Description.
    said : tuple of str
        Status messages around it, without repetitions.
    """

    stamp: float
    what: str
    said: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class KidnapRun:
    """One scenario in one world, or one drive joined from pieces of a case.

    Parameters
    ----------
    world : str
        The world or case.
    kind : str
        Kind of the scenario.
    seed : int
        World, kind and seed reproduce the scenario.
    trial : Trial
        The judgement.
    incidents : tuple of Incident
        What to investigate.
    cpu_s : tuple of float
        Processor time for each scan, s.
    """

    world: str
    kind: str
    seed: int
    trial: Trial
    incidents: tuple[Incident, ...]
    cpu_s: tuple[float, ...]


def judged_run(world: str, kind: str, seed: int, instants: Sequence[Instant]) -> KidnapRun:
    """Judge a scenario and collect incidents; arguments as those of `KidnapRun`."""
    trial = judge_trial(instants)
    cpu_s = tuple(instant.cpu_s for instant in instants)
    return KidnapRun(world, kind, seed, trial, _incidents(trial, instants), cpu_s)


def kidnap_document(
    runs: Sequence[KidnapRun], left_out: Sequence[tuple[str, str]] = ()
) -> dict[str, Any]:
    """Put scenarios into the document described above; ``left_out``: case, and why."""
    worlds = list(dict.fromkeys(run.world for run in runs))
    return {
        "worlds": [_row(name, [run for run in runs if run.world == name]) for name in worlds],
        "total": _row("total", runs),
        "incidents": [
            {
                "world": run.world,
                "kind": run.kind,
                "seed": run.seed,
                **asdict(incident),
                "said": list(incident.said),
            }
            for run in runs
            for incident in run.incidents
        ],
        "left_out": [{"name": name, "why": why} for name, why in left_out],
    }


def kidnap_table(document: Row) -> str:
    """Lay out worlds and total in Markdown that is aligned in plain text too."""
    return columns_table([*document["worlds"], document["total"]], {"world": "name"}, COLUMNS)


def kinds_table(document: Row) -> str:
    """Lay out the total by the kind of scenario, in Markdown."""
    rows = [{"name": kind, **row} for kind, row in document["total"]["by_kind"].items()]
    return columns_table(rows, {"kind": "name"}, KIND_COLUMNS)


def _row(name: str, runs: Sequence[KidnapRun]) -> dict[str, Any]:
    aftermaths = [aftermath for run in runs for aftermath in run.trial.aftermaths]
    kidnaps = [aftermath for aftermath in aftermaths if aftermath.is_kidnap]
    slips = [aftermath for aftermath in aftermaths if aftermath.kind == SLIP]
    starts = [run.trial.start for run in runs if run.trial.start is not None]
    cpu_ms = [1e3 * cpu_s for run in runs for cpu_s in run.cpu_s]
    calm_h, alarms = _calm(runs)
    figures = _aftermath_figures(kidnaps)
    return {
        "name": name,
        "scenarios": len(runs),
        "kidnaps": len(kidnaps),
        "signalled": sum(kidnap.signalled for kidnap in kidnaps),
        **figures,
        "wrong_published": sum(len(run.trial.wrong_fixes) for run in runs),
        "false_alarms_per_h": alarms / calm_h if calm_h > 0.0 else None,
        "false_alarms": alarms,
        "strays": sum(len(run.trial.strays) for run in runs),
        "calm_h": calm_h,
        "known_before": sum(kidnap.known_before for kidnap in kidnaps),
        "slips": len(slips),
        "slips_recovered": sum(slip.recovered_after_s is not None for slip in slips),
        "start_right": sum(run.trial.first_fix is True for run in runs),
        "start_wrong": sum(run.trial.first_fix is False for run in runs),
        "start_s": _percentile([start.recovered_after_s for start in starts], 50),
        "hours": sum(run.trial.duration_s for run in runs) / 3600.0,
        "cpu_ms_per_scan": float(np.mean(cpu_ms)) if cpu_ms else None,
        "cpu_ms_p95": _percentile(cpu_ms, 95),
        "by_kind": {
            kind: _kind_row([run for run in runs if run.kind == kind])
            for kind in dict.fromkeys(run.kind for run in runs)
        },
    }


def _kind_row(runs: Sequence[KidnapRun]) -> dict[str, Any]:
    aftermaths = [aftermath for run in runs for aftermath in run.trial.aftermaths]
    calm_h, alarms = _calm(runs)
    return {
        "scenarios": len(runs),
        "disturbances": len(aftermaths),
        **_aftermath_figures(aftermaths),
        "wrong_published": sum(len(run.trial.wrong_fixes) for run in runs),
        "false_alarms_per_h": alarms / calm_h if calm_h > 0.0 else None,
    }


def _aftermath_figures(aftermaths: Sequence[Aftermath]) -> dict[str, Any]:
    detected = [a for a in aftermaths if a.is_detected]
    recover_s = [a.recovered_after_s for a in aftermaths]
    return {
        "detected": len(detected),
        # A localizer without a right pose had nothing to give up.
        "delay_s": _percentile([a.left_after_s for a in detected if a.known_before], 50),
        "recovered": sum(seconds is not None for seconds in recover_s),
        "recover_s": _percentile(recover_s, 50),
        "recover_s_p95": _percentile(recover_s, 95),
    }


def _calm(runs: Sequence[KidnapRun]) -> tuple[float, int]:
    return (
        sum(run.trial.calm_s for run in runs) / 3600.0,
        sum(len(run.trial.alarms) for run in runs),
    )


def _percentile(values: Sequence[float | None], percent: float) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.percentile(known, percent)) if known else None


def _incidents(trial: Trial, instants: Sequence[Instant]) -> tuple[Incident, ...]:
    """List what went wrong or took long, in the order of time."""
    found = [
        (instants[i].stamp, 0.0, f"wrong pose published{_how_wrong(instants[i])}")
        for i in trial.wrong_fixes
    ]
    found += [
        (instants[i].stamp, 0.0, f"false alarm{_error_text(instants[i - 1], ', before')}")
        for i in trial.alarms
    ]
    found += [
        (instants[i].stamp, 0.0, f"went astray{_error_text(instants[i], ':')}")
        for i in trial.strays
    ]
    starts = () if trial.start is None else (trial.start,)
    for aftermath in (*starts, *trial.aftermaths):
        seconds = aftermath.recovered_after_s
        if aftermath.is_kidnap and not aftermath.is_detected:
            found.append((aftermath.stamp, 0.0, f"{aftermath.kind}: not detected"))
        if seconds is None:
            found.append((aftermath.stamp, _LONG_S, f"{aftermath.kind}: not recovered"))
        elif seconds > SLOW_S:
            what = f"{aftermath.kind}: recovered after {seconds:.1f} s"
            found.append((aftermath.stamp, seconds, what))
    return tuple(
        Incident(stamp, what, _said(instants, stamp - _BEFORE_S, stamp + more_s + _AFTER_S))
        for stamp, more_s, what in sorted(found)
    )


def _how_wrong(instant: Instant) -> str:
    if instant.truth is None:
        return ""
    wrong = [pose for pose in instant.fixes if not instant.is_true(pose)]
    errors = [PoseError.between(pose, instant.truth) for pose in wrong]
    return "".join(f", {e.metres:.2f} m {np.degrees(e.radians):.0f}° off" for e in errors)


def _error_text(instant: Instant, words: str) -> str:
    if instant.truth is None or instant.published is None:
        return ""
    error = PoseError.between(instant.published, instant.truth)
    return f"{words} {error.metres:.2f} m {np.degrees(error.radians):.0f}° off"


def _said(instants: Sequence[Instant], begin_s: float, end_s: float) -> tuple[str, ...]:
    """Return the status messages of a time with the pose error; similar lines once."""
    lines: list[str] = []
    last: object = None
    for instant in instants:
        if not begin_s <= instant.stamp <= end_s:
            continue
        for words in instant.said:
            gist = instant.is_right, re.sub(r"[\d.]+", "", words)
            if gist != last:
                lines.append(f"{instant.stamp:.1f} {words}{_error_text(instant, ' |')}")
            last = gist
    left_out = len(lines) - _MOST_LINES
    if left_out > 0:
        lines[_MOST_LINES // 2 : -_MOST_LINES // 2] = [f"... {left_out} more ..."]
    return tuple(lines)


def write_kidnap_report(runs: Sequence[KidnapRun], document: dict[str, Any], folder: Path) -> Path:
    """Write ``report.md`` with its plot into a folder and return it; see `write_page`."""
    make_folder(folder)
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
    parts += ["## Incidents", *(_incident(row) for row in document["incidents"])]
    if not document["incidents"]:
        parts.append("None.")
    return parts


def _incident(row: dict[str, Any]) -> str:
    head = f"**{row['world']}**, {row['kind']}, seed {row['seed']}, {row['stamp']:.1f} s: "
    said = "\n".join(f"    {line}" for line in row["said"])
    return f"{head}{row['what']}\n\n{said}"
