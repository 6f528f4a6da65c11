"""One drive, begun in several ways, as the paper's figures 4 to 9 show it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.core.pose_error import PoseError
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.scoring import classify_beams
from firstfix.lab.metrics.outcome import is_found
from firstfix.lab.metrics.paper_trial import Attempt, Belief, Start
from firstfix.plots.figure import BLUE, GREEN, RED, SKY, new_figure, save_figure
from firstfix.plots.map_image import draw_map
from firstfix.plots.result_picture import BEAM_COLOURS, ROBOT_M

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

_WIDE_IN, _NARROW_IN = 12.0, 8.0
_LETTERING_IN = 0.5

# Way, and whether its first or its last scan is shown.
_PANELS = (
    (Start.DEFAULT_POSE, "first"),
    (Start.DEFAULT_POSE, "last"),
    (Start.UNIFORM, "first"),
    (Start.UNIFORM, "last"),
    (Start.BY_HAND, "first"),
    (Start.BY_HAND, "last"),
    (Start.PAPER, "first"),
    (Start.SYSTEM, "first"),
)


@dataclass(frozen=True, eq=False, slots=True)
class Shown:
    """A drive to draw.

    Parameters
    ----------
    world : str
        The building.
    seed : int
        Of the drive.
    grid : OccupancyGrid
        The map.
    scans : tuple of LaserScan
        Of the drive.
    attempts : tuple of Attempt
        Each with one belief for every scan.
    """

    world: str
    seed: int
    grid: OccupancyGrid
    scans: tuple[LaserScan, ...]
    attempts: tuple[Attempt, ...]


def draw_starts(shown: Shown, path: Path) -> Path:
    """Draw the first and the last scan at the estimate of each kind of start; see `save_figure`."""
    attempts = {attempt.start: attempt for attempt in shown.attempts}
    panels = [(start, when) for start, when in _PANELS if start in attempts]
    shape = shown.grid.height / shown.grid.width
    width, columns = (_NARROW_IN, 4) if shape > 1.2 else (_WIDE_IN, 4 if shape > 0.4 else 2)
    rows = math.ceil(len(panels) / columns)
    height = rows * (shape * width / columns + _LETTERING_IN) + 2 * _LETTERING_IN
    figure = new_figure(width, height)
    grid_of_axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (start, when) in zip(grid_of_axes, panels, strict=False):
        _draw_panel(axes, shown, attempts[start], when)
    for axes in grid_of_axes[len(panels) :]:
        axes.set_axis_off()
    known: dict[str, Artist] = {}
    for axes in grid_of_axes[: len(panels)]:
        handles, labels = axes.get_legend_handles_labels()
        known |= dict(zip(labels, handles, strict=True))
    figure.legend(
        known.values(), known.keys(), loc="outside lower center", ncols=4 if shape > 1.2 else 8,
        markerscale=2, fontsize="x-small",
    )  # fmt: skip
    figure.suptitle(f"{shown.world}, drive {shown.seed}", fontsize="small")
    return save_figure(figure, path)


def _draw_panel(axes: Axes, shown: Shown, attempt: Attempt, when: str) -> None:
    is_last = when == "last"
    i = len(attempt.beliefs) - 1 if is_last else _first_word(attempt)
    belief, scan = attempt.beliefs[i], shown.scans[i]
    draw_map(axes, shown.grid)
    axes.set(xlabel="", ylabel="")
    if is_last:
        _draw_way(axes, [known.truth for known in attempt.beliefs], "black", "truth", 1.8)
        _draw_way(axes, [known.T_map_base for known in attempt.beliefs], BLUE, "believed", 1.0)
    cloud = attempt.last_cloud if is_last else attempt.first_cloud
    if len(cloud):
        axes.plot(cloud[:, 0], cloud[:, 1], ".", ms=2, color=SKY, label="particles", zorder=3)
    if belief.T_map_base is not None:
        _draw_scan(axes, shown.grid, scan, belief.T_map_base)
        _draw_robot(axes, belief.T_map_base, BLUE, "believed")
    _draw_robot(axes, belief.truth, "black", "truth")
    title = _title(attempt.start, belief, shown.scans[0].stamp)
    axes.set_title(title, fontsize="x-small", color=_colour(belief))
    axes.tick_params(labelsize="xx-small")


def _first_word(attempt: Attempt) -> int:
    """Return the first scan with a pose; the last one if there is none."""
    known = (i for i, belief in enumerate(attempt.beliefs) if belief.T_map_base is not None)
    return next(known, len(attempt.beliefs) - 1)


def _title(start: Start, belief: Belief, began_s: float) -> str:
    when = f"{start.value}, after {belief.stamp - began_s:.0f} s"
    if belief.stamp == began_s:
        when = f"{start.value}, first scan"
    if belief.T_map_base is None:
        return f"{when}:\nno estimate"
    error = PoseError.between(belief.T_map_base, belief.truth)
    sure = "sure" if belief.sure else "not sure"
    return f"{when}:\n{error.metres:.2f} m {math.degrees(error.radians):.0f}° off, {sure}"


def _colour(belief: Belief) -> str:
    if belief.T_map_base is None:
        return "black"
    return GREEN if is_found(belief.T_map_base, belief.truth) else RED


def _draw_way(axes: Axes, poses: list[SE2 | None], colour: str, label: str, width: float) -> None:
    points = [(math.nan, math.nan) if pose is None else (pose.x, pose.y) for pose in poses]
    axes.plot(*np.array(points).T, color=colour, lw=width, label=label, zorder=4)


def _draw_scan(axes: Axes, grid: OccupancyGrid, scan: LaserScan, T_map_base: SE2) -> None:
    beams = classify_beams([scan], T_map_base, MapFields(grid))
    for kind, colour in BEAM_COLOURS.items():
        x, y = beams.ends[beams.hit & (beams.classes == kind)].T
        if len(x):
            axes.scatter(x, y, s=4, color=colour, label=kind.label, zorder=5)


def _draw_robot(axes: Axes, pose: SE2, colour: str, label: str) -> None:
    sides = (abs(high - low) for low, high in (axes.get_xlim(), axes.get_ylim()))
    shorter, longer = sorted(sides)
    size = max(ROBOT_M, min(longer / 50, shorter / 10))
    ring = np.linspace(-math.pi, math.pi, 40)
    x, y = pose.x + size * np.cos(ring), pose.y + size * np.sin(ring)
    axes.fill(x, y, facecolor="none" if colour == "black" else colour, edgecolor=colour, lw=1.5,
              label=f"robot, {label}", zorder=7)  # fmt: skip
    tip = pose.apply(np.array([2.5 * size, 0.0]))
    axes.plot([pose.x, tip[0]], [pose.y, tip[1]], color=colour, lw=1.5, zorder=7)
