"""The figures of ``firstfix bench --suite paper``: JSON, tables, and a report with pictures.

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

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from firstfix.lab.experiments.machine import machine_text, this_machine
from firstfix.lab.metrics.metrics import mean_of_known
from firstfix.lab.metrics.paper_trial import MISLED_S, STAYS_S, WORDS, Ending, Start, Trial
from firstfix.lab.reports.output_files import make_folder, write_page
from firstfix.lab.reports.paper_picture import Shown, draw_starts
from firstfix.lab.reports.text import Row, columns_table, markdown_table

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
LEGEND = (
    "A simulated Kobuki wakes at a random place, stands for a second and drives from goal to goal. "
    "Every way of starting gets the same scans and the same odometry. AMCL is the filter of this "
    "package under Nav2's default parameters; the map's origin, AMCL's default pose, is a free "
    "place of the building. Right: within 0.5 m and 10° of the truth at the end of the drive and "
    f"for {STAYS_S:g} s before. Wrong: sure of another place at the end. Open: neither. Misled: "
    f"sure of a wrong place for more than {MISLED_S:g} s at some time. Time and way (medians of "
    "the right ones) are counted from the first scan, until the pose was right for good. Start "
    "CPU: preparing the map, and all scans up to the first pose; it is the mean of all drives. "
    "What a person takes to point at the map is not counted."
)
PICTURES = (
    "The first and the last scan, drawn where each way believed the robot to be (blue; the truth "
    "is black), as the paper's figures 4 to 9 do: at the wrong place the end points do not lie on "
    "walls, or lie on those of a place that looks the same. Of the drives, the one in which most "
    "ways went wrong is shown."
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
        "machine": this_machine(),
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


def write_paper_report(shown: Sequence[Shown], document: dict[str, Any], folder: Path) -> Path:
    """Write ``report.md`` with a picture of one drive of each world; see `write_page`."""
    make_folder(folder)
    names = {drive.world: f"{drive.world}.png" for drive in shown}
    for drive in shown:
        draw_starts(drive, folder / names[drive.world])
    starts = {row["start"] for row in document["totals"]}
    ways = [f"- *{start.value}*: {WORDS[start]}." for start in Start if start.value in starts]
    drives = (
        f"{document['drives']} drive(s) of {document['drive_s']:g} s in each world, seeds from "
        f"{document['seed']}. {LEGEND}"
    )
    return write_page(
        [
            "# firstfix bench --suite paper",
            machine_text(document["machine"]),
            drives,
            "\n".join(ways),
            "## All worlds",
            paper_table(document),
            "## Right / wrong / open",
            worlds_table(document),
            "## World by world",
            details_table(document),
            "## Pictures",
            PICTURES,
            *(f"![{world}]({name})" for world, name in names.items()),
        ],
        folder,
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
