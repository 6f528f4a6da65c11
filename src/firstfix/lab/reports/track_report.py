"""A tracked log as JSON, as text, and as a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.lab.experiments.drive_tracking import TrackedScan
from firstfix.lab.experiments.track_log import TrackedLog
from firstfix.lab.metrics.outcome import FOUND
from firstfix.lab.metrics.track_metrics import RPE_PIECE_M, ErrorFigures, TrackFigures
from firstfix.lab.reports.text import pose_text
from firstfix.plots.figure import BLUE, GREEN, ORANGE, RED, SKY, new_figure, save_figure
from firstfix.plots.map_image import draw_map

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Enough for a closed outline of what was seen; more would hide the map.
MOST_SCANS = 200
MOST_POINTS = 40_000

LONG_SIDE_IN, LEAST_SIDE_IN = 14.0, 5.0
LETTERING_IN = 1.0  # title, axis and legend
MARGIN_M = 1.0


def track_document(log: TrackedLog, figures: TrackFigures) -> dict[str, Any]:
    """Put a tracked log into the document that ``track --json`` writes (docs/json.md)."""
    start, drive, tracked = log.start, log.drive, log.tracked
    first, last = tracked[0], tracked[-1]
    return {
        "start": {
            "origin": start.origin.value,
            "pose": drive.begin_at.as_array().tolist(),
            "stamp": first.sight.scan.stamp,
        },
        "end": {
            "pose": last.T_map_base.as_array().tolist(),
            "covariance": last.covariance.tolist(),
            "elsewhere": last.elsewhere,
            "stamp": last.sight.scan.stamp,
        },
        "skipped": drive.skipped,
        "restarts": sum(scan.sight.begin_at is not None for scan in tracked) - 1,
        **asdict(figures),
    }


def track_text(tracked: Sequence[TrackedScan], figures: TrackFigures) -> str:
    """Describe a tracked log in lines for a person."""
    last = tracked[-1]
    sigma = np.sqrt(np.clip(np.diagonal(last.covariance), 0.0, None))
    cpu = f"{figures.cpu_update_ms:.2f} ms an update, 95 % up to {figures.cpu_update_ms_p95:.2f} ms"
    lines = [
        f"scans        {figures.scans}, {figures.updates} of them used for an update",
        f"drive        {figures.way_m:.1f} m by odometry in {figures.duration_s:.1f} s",
        f"end          {pose_text(last.T_map_base)}",
        f"σ            {pose_text(SE2.from_array(sigma))}",
        f"elsewhere    {last.elsewhere:.1%} of the belief",
        f"particles    {figures.particles_mean:.0f} on average",
        f"CPU          {cpu}",
    ]
    if figures.ape is not None:
        within = f"within {FOUND.metres:g} m and {math.degrees(FOUND.radians):.0f}°"
        lines += [
            f"kept         {figures.kept:.1%} of {figures.n} scans {within} of the truth",
            f"APE          {_errors_text(figures.ape)}",
        ]
    if figures.rpe is not None:
        lines.append(f"RPE          {_errors_text(figures.rpe)}, over {RPE_PIECE_M:g} m of way")
    return "\n".join(lines)


def track_title(figures: TrackFigures) -> str:
    """Return the title of the picture."""
    words = f"{figures.scans} scans, {figures.way_m:.0f} m, {figures.updates} updates"
    if figures.ape is None:
        return words
    return f"{words}; error {figures.ape.rmse_m:.3f} m RMSE, at most {figures.ape.max_m:.2f} m"


def trajectory_of(tracked: Sequence[TrackedScan]) -> Trajectory:
    """Return the tracked poses, ``T_map_base`` at every scan."""
    stamps = np.array([scan.sight.scan.stamp for scan in tracked])
    return Trajectory(stamps, np.array([scan.T_map_base.as_array() for scan in tracked]))


def draw_track(grid: OccupancyGrid, tracked: Sequence[TrackedScan], path: Path, title: str) -> Path:
    """Draw a tracked drive of at least one scan into a file; see `save_figure`."""
    track = np.array([scan.T_map_base.as_array()[:2] for scan in tracked])
    points = end_points(tracked)
    west, south, east, north = _view(np.concatenate([track, points]), track)
    scale = LONG_SIDE_IN / max(east - west, north - south)
    width = max(LEAST_SIDE_IN, scale * (east - west))
    height = max(LEAST_SIDE_IN, scale * (north - south)) + LETTERING_IN
    figure = new_figure(width, height)
    axes = figure.subplots()
    draw_map(axes, grid)
    if len(points):
        axes.scatter(
            points[:, 0], points[:, 1], s=2.5, color=SKY, lw=0, alpha=0.7, zorder=2,
            label="end points of the scans, where they were tracked",
        )  # fmt: skip
    _draw_paths(axes, tracked)
    axes.plot(*track[0], "o", color=GREEN, ms=9, mec="white", zorder=7, label="start")
    axes.plot(*track[-1], "s", color=RED, ms=9, mec="white", zorder=7, label="end")
    axes.set(xlim=(west, east), ylim=(south, north), title=title)
    legend = figure.legend(loc="outside lower center", ncols=max(2, round(width / 3.5)))
    for handle in legend.legend_handles:
        if handle is not None and hasattr(handle, "set_sizes"):
            handle.set_sizes([30.0])  # the points themselves are too small for a legend
    return save_figure(figure, path)


def end_points(tracked: Sequence[TrackedScan]) -> NDArray[np.float64]:
    """Return end points of evenly chosen scans at their tracked poses, shape (n, 2), m, map."""
    chosen = tracked[:: math.ceil(len(tracked) / MOST_SCANS)]
    points = np.concatenate([scan.T_map_base.apply(scan.sight.scan.points()) for scan in chosen])
    kept: NDArray[np.float64] = points[:: max(1, math.ceil(len(points) / MOST_POINTS))]
    return kept


def anchored_odometry(tracked: Sequence[TrackedScan]) -> list[SE2]:
    """Return where odometry alone would have led, from each start on (``T_map_base``)."""
    poses = []
    T_map_odom = tracked[0].T_map_odom
    for scan in tracked:
        if scan.sight.begin_at is not None:
            T_map_odom = scan.T_map_odom
        poses.append(T_map_odom @ scan.sight.T_odom_base)
    return poses


def _draw_paths(axes: Axes, tracked: Sequence[TrackedScan]) -> None:
    breaks = [i for i, scan in enumerate(tracked) if not scan.sight.same_run and i > 0]
    odometry = _xy(anchored_odometry(tracked))
    truth = _xy([scan.sight.truth for scan in tracked])
    track = _xy([scan.T_map_base for scan in tracked])
    for poses, colour, width, label in (
        (odometry, ORANGE, 0.8, "odometry alone"),
        (truth, "black", 2.2, "truth"),
        (track, BLUE, 1.2, "tracked"),
    ):
        if np.isfinite(poses).any():
            # A row of NaN ends a line, so that gaps between runs stay open.
            x, y = np.insert(poses, breaks, np.nan, axis=0).T
            axes.plot(x, y, color=colour, lw=width, label=label, zorder=3)


def _xy(poses: Sequence[SE2 | None]) -> NDArray[np.float64]:
    return np.array([(math.nan, math.nan) if p is None else (p.x, p.y) for p in poses])


def _view(
    seen: NDArray[np.float64], track: NDArray[np.float64]
) -> tuple[float, float, float, float]:
    """Return west, south, east and north of what to show, m: the track, and most of what it saw."""
    # A few stray far returns must not shrink the building to a stamp.
    low = np.minimum(np.percentile(seen, 1, axis=0), track.min(axis=0)) - MARGIN_M
    high = np.maximum(np.percentile(seen, 99, axis=0), track.max(axis=0)) + MARGIN_M
    (west, south), (east, north) = low.tolist(), high.tolist()
    return west, south, east, north


def _errors_text(errors: ErrorFigures) -> str:
    rows = (
        ("RMSE", errors.rmse_m, errors.rmse_deg),
        ("median", errors.median_m, errors.median_deg),
        ("at most", errors.max_m, errors.max_deg),
    )
    return ", ".join(f"{word} {metres:.3f} m {degrees:.2f}°" for word, metres, degrees in rows)
