"""Draws docs/explanation/method.png: ``python docs/make_method_figure.py``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import firstfix as ff
from firstfix.fields.distance import euclidean_distance
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import WORLDS
from firstfix.plots.figure import GREEN, RED, new_figure, save_figure
from firstfix.plots.map_image import draw_map

PICTURE = Path(__file__).parent / "explanation" / "method.png"
TRUTH = ff.SE2(14.5, 15.0, 0.6)
SIMILAR = ff.SE2(4.0, 14.6, 0.6)
STEP_M = 0.25
REACH_M = 0.5


def main() -> None:
    """Draw two scores of one scan, and what is left of all positions."""
    grid = WORLDS["office"]()
    scan = Lidar().scan(grid, TRUTH, np.random.default_rng(1))
    matcher = ff.ScanMatcher(grid)
    figure = new_figure(12.0, 7.4)
    near, far, whole, last = figure.subplots(2, 2).flat

    for axes, pose, words in ((near, TRUTH, "right"), (far, SIMILAR, "wrong")):
        _draw_distance(axes, grid)
        points = pose.apply(scan.points())
        axes.plot(points[:, 0], points[:, 1], ".", ms=3, color=GREEN if pose is TRUTH else RED)
        _mark(axes, pose)
        axes.set_title(f"distance to walls; end points at a {words} pose")

    poses, shares = _explained(matcher, grid, scan)
    draw_map(whole, grid)
    seen = whole.scatter(poses[:, 0], poses[:, 1], c=shares, s=2.5, marker="s", cmap="viridis")
    figure.colorbar(seen, ax=whole, label="share of beams explained")
    whole.set_title(f"every {STEP_M} m, at the right heading")
    _mark(whole, TRUTH)

    result = matcher.locate(scan)
    draw_map(last, grid)
    for hypothesis in reversed(result.hypotheses):
        colour = GREEN if hypothesis is result.best else RED
        pose = hypothesis.pose
        last.plot(pose.x, pose.y, "o", ms=9, color=colour, alpha=0.3 + 0.7 * hypothesis.probability)
    last.set_title(f"{result.verdict.value}: {len(result.hypotheses)} places refined and judged")
    save_figure(figure, PICTURE)


def _draw_distance(axes, grid: ff.OccupancyGrid) -> None:
    draw_map(axes, grid)
    metres = np.minimum(euclidean_distance(grid.occupied) * grid.resolution, REACH_M)
    origin, (height, width) = grid.T_map_grid, np.array(metres.shape) * grid.resolution
    extent = (origin.x, origin.x + width, origin.y, origin.y + height)
    axes.imshow(metres, origin="lower", extent=extent, cmap="Blues_r")


def _explained(matcher: ff.ScanMatcher, grid: ff.OccupancyGrid, scan: ff.LaserScan):
    stride = round(STEP_M / grid.resolution)
    rows, columns = np.nonzero(grid.seen_free[::stride, ::stride])
    points = grid.to_map(stride * np.column_stack([columns, rows]) + 0.5)
    looks = matcher.score_poses(scan, [ff.SE2(x, y, TRUTH.yaw) for x, y in points.tolist()])
    return points, np.array([look.evidence.explained for look in looks])


def _mark(axes, pose: ff.SE2) -> None:
    axes.plot(pose.x, pose.y, "k+", ms=12, mew=2)


if __name__ == "__main__":
    main()
