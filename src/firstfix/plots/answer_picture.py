"""A picture of an answer: the map, the places that fit, and the scan at the best of them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from firstfix.core.estimate import Hypothesis, LocateResult
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.scoring import classify_beams
from firstfix.global_localization.verify import BeamClass
from firstfix.plots.figure import BLUE, GREEN, ORANGE, PURPLE, RED, new_figure, save_figure
from firstfix.plots.map_image import draw_map

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROBOT_M = 0.2
LEAST_VIEW_M = 4.0
LEAST_LABELLED = 0.005  # what would read "0 %" hides what matters

BEAM_COLOURS = {
    BeamClass.EXPLAINED: GREEN,
    BeamClass.SHORT: ORANGE,
    BeamClass.THROUGH_WALL: RED,
    BeamClass.UNKNOWN: PURPLE,
}


def draw_answer(
    grid: OccupancyGrid,
    scan: LaserScan,
    result: LocateResult,
    path: Path,
    truth: SE2 | None = None,
) -> Path:
    """Draw an answer into a file.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        The scan.
    result : LocateResult
        The answer.
    path : Path
        Where the picture goes; its suffix names the format: .png, .svg or .pdf.
    truth : SE2 or None
        ``T_map_base`` where it is known.

    Returns
    -------
    Path
        The file, absolute.

    Raises
    ------
    InputError
        If it cannot be written, or matplotlib is not installed.
    """
    figure = new_figure(14.0, 7.0)
    whole, near = figure.subplots(1, 2)
    draw_map(whole, grid)
    draw_map(near, grid)
    best = result.best
    if best is not None:
        _draw_scan(near, grid, scan, best.pose)
        _zoom(near, scan, best.pose)
    for axes in (whole, near):
        for rank, hypothesis in reversed(list(enumerate(result.hypotheses, 1))):
            _draw_hypothesis(axes, rank, hypothesis)
        if truth is not None:
            axes.plot(truth.x, truth.y, "k+", ms=14, mew=2, label="truth", zorder=6)
    whole.set_title("places that fit" if best is not None else "no place fits")
    near.set_title("the beams that hit, at the best place" if best is not None else "the map")
    if near.get_legend_handles_labels()[0]:
        near.legend(loc="upper right", fontsize="small")
    figure.suptitle(f"{result.verdict.value}: {result.reason}", wrap=True)
    return save_figure(figure, path)


def _draw_scan(axes: Axes, grid: OccupancyGrid, scan: LaserScan, T_map_base: SE2) -> None:
    """Draw the beams that hit; the shares of the legend count those without a return, too."""
    beams = classify_beams(scan, T_map_base, MapFields(grid))
    for kind, colour in BEAM_COLOURS.items():
        x, y = beams.ends[beams.hit & (beams.classes == kind)].T
        if beams.share(kind) > 0.0:
            label = f"{100 * beams.share(kind):.0f} % {kind.label}"
            axes.scatter(x, y, s=9, color=colour, label=label, zorder=4)


def _draw_hypothesis(axes: Axes, rank: int, hypothesis: Hypothesis) -> None:
    """Draw a robot with its heading, a ghost the less likely it is."""
    pose = hypothesis.pose
    colour, solid = (BLUE, 1.0) if rank == 1 else (PURPLE, 0.15 + 0.85 * hypothesis.probability)
    left, right = axes.get_xlim()
    # On the whole of a large map a robot to scale would be a dot.
    size = max(ROBOT_M, (right - left) / 60)
    tip = pose.apply(np.array([3.0 * size, 0.0]))
    axes.annotate(
        "",
        xy=(tip[0], tip[1]),
        xytext=(pose.x, pose.y),
        arrowprops={"arrowstyle": "-|>", "color": colour, "alpha": solid, "lw": 2},
        zorder=5,
    )
    ring = np.linspace(-math.pi, math.pi, 40)
    axes.fill(
        pose.x + size * np.cos(ring),
        pose.y + size * np.sin(ring),
        color=colour,
        alpha=solid,
        zorder=5,
    )
    if hypothesis.probability < LEAST_LABELLED:
        return
    axes.annotate(
        f"{rank}: {100 * hypothesis.probability:.0f} %",
        xy=(pose.x, pose.y),
        xytext=(8, 8),
        textcoords="offset points",
        color=colour,
        fontsize="small",
        bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.7},
        clip_on=True,
        zorder=7,
    )


def _zoom(axes: Axes, scan: LaserScan, T_map_base: SE2) -> None:
    points = T_map_base.apply(scan.points())
    here = np.array([[T_map_base.x, T_map_base.y]])
    # A few stray far returns must not shrink the room to a stamp.
    far = np.percentile(np.abs(points - here), 98) if len(points) else 0.0
    half = max(LEAST_VIEW_M, 1.1 * float(far))
    axes.set_xlim(T_map_base.x - half, T_map_base.x + half)
    axes.set_ylim(T_map_base.y - half, T_map_base.y + half)
