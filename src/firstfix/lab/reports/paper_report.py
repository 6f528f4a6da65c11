"""A report of the paper's experiments: tables, and a picture of one drive in every world."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from firstfix.lab.experiments.machine import machine_text
from firstfix.lab.experiments.paper_suite import (
    MISLED_S,
    STAYS_S,
    details_table,
    paper_table,
    worlds_table,
)
from firstfix.lab.experiments.starts import WORDS, Start
from firstfix.lab.reports.page import write_page
from firstfix.lab.reports.paper_picture import Shown, draw_starts

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


def write_paper_report(shown: Sequence[Shown], document: dict[str, Any], folder: Path) -> Path:
    """Write ``report.md`` with its pictures into a folder, which is made where it is missing.

    Parameters
    ----------
    shown : sequence of Shown
        One drive of each world.
    document : dict
        The figures, from `paper_document`, with ``machine``.
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
    names = {story.world: f"{story.world}.png" for story in shown}
    for story in shown:
        draw_starts(story, folder / names[story.world])
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
