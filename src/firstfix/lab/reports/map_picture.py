"""A picture of a map, and of the places that look alike in it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.experiments.perceptual_aliasing import Look, Place, doubles
from firstfix.plots.figure import GREEN, ORANGE, PURPLE, RED, new_figure, save_figure
from firstfix.plots.map_image import draw_map

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOOK_COLOURS = {
    Look.FOUND: GREEN,
    Look.AMBIGUOUS: ORANGE,
    Look.LOST: PURPLE,
    Look.MISTAKEN: RED,
}


def draw_grid(grid: OccupancyGrid, path: Path, title: str, places: Sequence[Place] = ()) -> Path:
    """Draw a map into a file, and places by how they look; the rest is as in `draw_result`."""
    figure = new_figure(10.0, 10.0)
    axes = figure.subplots()
    draw_map(axes, grid)
    _draw_places(axes, places)
    if places:
        figure.legend(loc="outside lower center", ncols=len(LOOK_COLOURS) + 1)
    axes.set_title(title)
    return save_figure(figure, path)


def _draw_places(axes: Axes, places: Sequence[Place]) -> None:
    for look, colour in LOOK_COLOURS.items():
        alike = np.array([[place.pose.x, place.pose.y] for place in places if place.look is look])
        if len(alike):
            label = f"{len(alike)} {look.value}"
            axes.scatter(alike[:, 0], alike[:, 1], s=36, color=colour, label=label, zorder=5)
    for i, (pose, double) in enumerate(doubles(places)):
        axes.plot(
            [double.pose.x, pose.x],
            [double.pose.y, pose.y],
            color=ORANGE,
            lw=0.8,
            ls=":",
            marker="o",
            markevery=[0],
            markerfacecolor="none",
            label=None if i else "where else it fits",
            zorder=4,
        )
