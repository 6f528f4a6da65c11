"""The picture of a result: the map, the places that fit, and the scan at the best one."""

from __future__ import annotations

import math
from collections.abc import Sequence
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
    from matplotlib.figure import Figure

ROBOT_M = 0.2
LEAST_VIEW_M = 2.0  # half a side
LEAST_DRAWN = 0.005  # less likely places, "0 %", would hide the others

BEAM_COLOURS = {
    BeamClass.EXPLAINED: GREEN,
    BeamClass.SHORT: ORANGE,
    BeamClass.THROUGH_WALL: RED,
    BeamClass.UNKNOWN: PURPLE,
}


def draw_result(
    grid: OccupancyGrid,
    scans: Sequence[LaserScan],
    result: LocateResult,
    path: Path,
    truth: SE2 | None = None,
) -> Path:
    """Draw a result into a file, as `result_figure` does.

    Parameters
    ----------
    grid, scans, result, truth
        As in `result_figure`.
    path : Path
        File to write; its suffix gives the format: .png, .svg or .pdf.

    Returns
    -------
    Path
        The file, absolute.

    Raises
    ------
    InputError
        If it cannot be written, or matplotlib is not installed.
    """
    return save_figure(result_figure(grid, scans, result, truth), path)


def result_figure(
    grid: OccupancyGrid,
    scans: Sequence[LaserScan],
    result: LocateResult,
    truth: SE2 | None = None,
) -> Figure:
    """Draw a result: the whole map with all places, and the scans at the best place.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scans : sequence of LaserScan
        One of each sensor.
    result : LocateResult
        The result.
    truth : SE2 or None
        ``T_map_base`` where it is known.

    Returns
    -------
    Figure
        Two axes, in the map frame, m.

    Raises
    ------
    InputError
        If matplotlib is not installed.
    """
    figure = new_figure(14.0, 7.0)
    whole, near = figure.subplots(1, 2)
    draw_map(whole, grid)
    draw_map(near, grid)
    best = result.best
    if best is not None:
        _draw_scans(near, grid, scans, best.pose)
        _zoom(near, scans, best.pose)
    for axes in (whole, near):
        for rank, hypothesis in reversed(list(enumerate(result.hypotheses, 1))):
            if rank == 1 or hypothesis.probability >= LEAST_DRAWN:
                _draw_hypothesis(axes, rank, hypothesis)
        if truth is not None:
            axes.plot(truth.x, truth.y, "k+", ms=14, mew=2, label="truth", zorder=6)
    whole.set_title("places that fit" if best is not None else "no place fits")
    near.set_title("the beams that hit, at the best place" if best is not None else "the map")
    handles, labels = near.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower right", ncols=3, fontsize="small")
    figure.suptitle(f"{result.verdict.value}: {result.reason}", wrap=True)
    return figure


def _draw_scans(
    axes: Axes, grid: OccupancyGrid, scans: Sequence[LaserScan], T_map_base: SE2
) -> None:
    """Draw the beams that hit; the shares of the legend count those without a return, too."""
    beams = classify_beams(scans, T_map_base, MapFields(grid))
    for kind, colour in BEAM_COLOURS.items():
        x, y = beams.ends[beams.hit & (beams.classes == kind)].T
        if beams.share(kind) > 0.0:
            label = f"{100 * beams.share(kind):.0f} % {kind.label}"
            axes.scatter(x, y, s=9, color=colour, label=label, zorder=4)


def _draw_hypothesis(axes: Axes, rank: int, hypothesis: Hypothesis) -> None:
    """Draw a robot with its heading; the less likely, the fainter."""
    pose = hypothesis.pose
    colour, solid = (BLUE, 1.0) if rank == 1 else (PURPLE, 0.15 + 0.85 * hypothesis.probability)
    left, right = axes.get_xlim()
    # In a large map a robot to scale would be a dot.
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
    axes.annotate(
        f"{rank}: {100 * hypothesis.probability:.0f} %",
        xy=(pose.x, pose.y),
        # Above or below, where the arrow does not point.
        xytext=(pose.x, pose.y - math.copysign(1.5 * size, pose.yaw)),
        ha="center",
        va="top" if pose.yaw >= 0.0 else "bottom",
        color=colour,
        fontsize="small",
        bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.7},
        clip_on=True,
        zorder=7,
    )


def _zoom(axes: Axes, scans: Sequence[LaserScan], T_map_base: SE2) -> None:
    """Show the scans and the robot, but not a few stray far returns."""
    ends = [T_map_base.apply(scan.points()) for scan in scans]
    points = np.vstack([*ends, [T_map_base.x, T_map_base.y]])
    low, high = np.percentile(points, [1.0, 99.0], axis=0)
    low, high = np.minimum(low, points[-1]), np.maximum(high, points[-1])
    half = np.maximum(LEAST_VIEW_M, 0.55 * (high - low))
    (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
