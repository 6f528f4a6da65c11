"""A picture of the demo: true and published poses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.demo import DemoStep
from firstfix.plots.figure import BLUE, GREEN, RED, new_figure, save_figure
from firstfix.plots.map_image import draw_map

LONG_SIDE_IN = 12.0
LETTERING_IN = 1.2


def draw_scenario(grid: OccupancyGrid, steps: Sequence[DemoStep], path: Path) -> Path:
    """Draw the true and the published poses of a demo, at least one step; see `save_figure`."""
    wide, high = grid.width * grid.resolution, grid.height * grid.resolution
    scale = LONG_SIDE_IN / max(wide, high)
    figure = new_figure(scale * wide, scale * high + LETTERING_IN)
    axes = figure.subplots()
    draw_map(axes, grid)
    for episode in sorted({step.episode for step in steps}):
        part = [step for step in steps if step.episode == episode]
        label = episode == 0
        axes.plot(*_xy([s.truth for s in part if not s.lifted]), color="black", lw=2.6,
                  label="truth" if label else None, zorder=3)  # fmt: skip
        # The line is broken where the robot was found: the published pose jumps there.
        tracked = [s.published if s.initial is None else None for s in part]
        axes.plot(*_xy(tracked), color=BLUE, lw=1.4,
                  label="published" if label else None, zorder=4)  # fmt: skip
        if episode > 0:
            carried = [steps[steps.index(part[0]) - 1].truth, _first_standing(part).truth]
            axes.plot(*_xy(carried), ":", color=RED, lw=1.5, zorder=2,
                      label="carried away" if episode == 1 else None)  # fmt: skip
    found = [step for step in steps if step.initial is not None]
    for i, step in enumerate(found):
        initial = step.initial or step.truth
        axes.plot(initial.x, initial.y, "o", color=GREEN, ms=11, mec="white", zorder=6,
                  label="found" if i == 0 else None)  # fmt: skip
        axes.annotate(f"{step.stamp:.1f} s", (initial.x, initial.y), (8, 8),
                      textcoords="offset points", zorder=7, color=GREEN, weight="bold")  # fmt: skip
    axes.set(title="Found, tracked, carried away, found again")
    figure.legend(loc="outside lower center", ncols=5)
    return save_figure(figure, path)


def _first_standing(steps: Sequence[DemoStep]) -> DemoStep:
    return next((step for step in steps if not step.lifted), steps[-1])


def _xy(poses: Sequence[SE2 | None]) -> NDArray[np.float64]:
    """Return x and y, shape (2, n), m; NaN, which breaks a line, where there is no pose."""
    nowhere = (np.nan, np.nan)
    return np.array([nowhere if p is None else (p.x, p.y) for p in poses]).reshape(-1, 2).T
