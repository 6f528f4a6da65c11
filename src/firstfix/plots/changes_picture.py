"""The picture of what has changed in a map."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from firstfix.changes.survey import Change, MapChanges
from firstfix.plots.figure import BLUE, GREEN, ORANGE, RED, new_figure, save_figure
from firstfix.plots.map_image import draw_map

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CHANGE_COLOURS = {
    Change.FOUND_FREE: GREEN,
    Change.FOUND_WALL: ORANGE,
    Change.GONE: BLUE,
    Change.NEW: RED,
}
# Of free floor a hint is enough: it covers most of the picture.
_FAINT = {Change.FOUND_FREE: 0.25}
_MARGIN_M = 3.0
_NAMED = 8


def draw_changes(changes: MapChanges, path: Path, title: str) -> Path:
    """Draw a map, and what has changed in it, around the changes.

    Parameters
    ----------
    changes : MapChanges
        The changes.
    path : Path
        File to write; its suffix gives the format: .png, .svg or .pdf.
    title : str
        Above the picture.

    Returns
    -------
    Path
        The file, absolute.

    Raises
    ------
    InputError
        If it cannot be written, or matplotlib is not installed.
    """
    figure = new_figure(11.0, 9.0)
    axes = figure.subplots()
    draw_map(axes, changes.grid)
    _draw_cells(axes, changes)
    worth_naming = [area for area in changes.areas if area.change is not Change.FOUND_FREE]
    for area in worth_naming[:_NAMED]:
        axes.annotate(
            f"{area.area_m2:.2g} m²",
            (area.x, area.y),
            xytext=(12, 12),
            textcoords="offset points",
            fontsize="x-small",
            arrowprops={"arrowstyle": "-", "lw": 0.6},
            bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8},
            zorder=6,
        )
    axes.set_title(title, wrap=True)
    figure.legend(loc="outside lower center", ncols=2, markerscale=3.0)
    return save_figure(figure, path)


def _draw_cells(axes: Axes, changes: MapChanges) -> None:
    grid = changes.grid
    spots = []
    for change, colour in CHANGE_COLOURS.items():
        rows, columns = np.nonzero(changes.kinds == change)
        x, y = grid.to_map(np.column_stack([columns, rows]).astype(np.float64) + 0.5).T
        spots.append(np.column_stack([x, y]))
        label = f"{change.words}: {changes.area_m2(change):.2f} m²"
        # Bigger than a cell, so that a change of one cell is visible in a large building.
        axes.scatter(
            x, y, s=5, marker="s", lw=0, color=colour, alpha=_FAINT.get(change), label=label,
            zorder=4,
        )  # fmt: skip
    shown = np.concatenate(spots)
    if len(shown):
        (left, bottom), (right, top) = shown.min(axis=0), shown.max(axis=0)
        axes.set_xlim(left - _MARGIN_M, right + _MARGIN_M)
        axes.set_ylim(bottom - _MARGIN_M, top + _MARGIN_M)
