"""The changes of a map in words, as a document, and in a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from firstfix.changes.counts import DayCounts
from firstfix.changes.survey import Change, MapChanges
from firstfix.io.map_changes import save_counts
from firstfix.io.maps.map_server import save_map
from firstfix.lab.reports.output_files import write_json
from firstfix.plots.changes_picture import draw_changes
from firstfix.plots.figure import can_draw

_REPORTED = (Change.GONE, Change.NEW, Change.FOUND_WALL, Change.FOUND_FREE)
_MOST_LINES = 12


def changes_title(changes: MapChanges) -> str:
    """Return a line about what was compared."""
    return f"{changes.views} views of {_period(changes)} against the map"


def changes_text(changes: MapChanges, explained: float) -> str:
    """Return the changes in words, the largest areas by name."""
    lines = [f"{changes_title(changes)}: {explained:.0%} of the beams end at its walls"]
    for change in _REPORTED:
        count = sum(area.change is change for area in changes.areas)
        lines.append(f"{change.words:<34}{changes.area_m2(change):8.2f} m²  in {count} areas")
    named = [area for area in changes.areas if area.change is not Change.FOUND_FREE]
    lines += [
        f"  {area.change.name.lower().replace('_', ' '):<12}{area.area_m2:6.2f} m² at "
        f"({area.x:.2f}, {area.y:.2f}) m, box {area.width_m:.1f} x {area.height_m:.1f} m, "
        f"{area.views} views, {area.days} days"
        for area in named[:_MOST_LINES]
    ]
    if len(named) > _MOST_LINES:
        lines.append(f"  and {len(named) - _MOST_LINES} more")
    if not changes.areas:
        lines.append("nothing has changed where the robot looked")
    return "\n".join(lines)


def changes_document(changes: MapChanges, explained: float) -> dict[str, Any]:
    """Return the changes as JSON values: m², m in the map frame."""
    return {
        "days": list(changes.dates),
        "views": changes.views,
        "explained": round(explained, 4),
        "area_m2": {change.name.lower(): round(changes.area_m2(change), 4) for change in _REPORTED},
        "areas": [
            {
                "change": area.change.name.lower(),
                "area_m2": round(area.area_m2, 4),
                "position": [round(area.x, 3), round(area.y, 3)],
                "size_m": [round(area.width_m, 3), round(area.height_m, 3)],
                "views": area.views,
                "days": area.days,
            }
            for area in changes.areas
        ],
    }


def write_changes(
    changes: MapChanges, days: Sequence[DayCounts], explained: float, folder: Path
) -> Path:
    """Write the layer, the redrawn map, the counts, the document and a picture into a folder.

    Raises
    ------
    InputError
        If one of them cannot be written.
    """
    save_map(changes.layer(), folder / "changes.yaml")
    save_map(changes.redrawn(), folder / "map.yaml")
    save_counts(days, changes.grid, folder)
    write_json(changes_document(changes, explained), folder / "changes.json")
    if can_draw():
        draw_changes(changes, folder / "changes.png", changes_title(changes))
    return folder.resolve()


def _period(changes: MapChanges) -> str:
    first, last = changes.dates[0], changes.dates[-1]
    if last < "2000":  # the log counts from its own beginning
        return "one drive" if first == last else f"{len(changes.dates)} days"
    return first if first == last else f"{first} to {last}"
