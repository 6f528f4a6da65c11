"""What sensors can do in a map, in words and as heat maps over the floor."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.experiments.sensor_prediction import Answer, Effort, Prediction, share
from firstfix.plots.figure import RED, new_figure, save_figure
from firstfix.plots.map_image import draw_map

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

# Cells of a heat map along the longer side of the map: finer than the places are.
_TILES = 120

_MEANING = {
    Effort.SCAN: "the pose is published before the robot moves",
    Effort.TURN: "the robot sees in all directions what one scan did not show",
    Effort.METRE: "a few views from other places tell look-alikes apart",
}


def prediction_text(words: str, predictions: Sequence[Prediction], seed: int) -> str:
    """Return the shares of one sensor, each with a sentence."""
    lines = [f"{words}, at {len(predictions)} random places (seed {seed}), among unmapped boxes:"]
    lines += [
        f"{effort.value:<21}{share(predictions, effort, Answer.RIGHT):6.1%}  {_MEANING[effort]}"
        for effort in Effort
    ]
    wrong = max(share(predictions, effort, Answer.WRONG) for effort in Effort)
    if wrong > 0.0:
        lines.append(f"{'wrong pose':<21}{wrong:6.1%}  another place looks the same from there")
    little = sum(p.sees_little for p in predictions) / max(1, len(predictions))
    if little > 0.0:
        lines.append(
            f"{'sees too little':<21}{little:6.1%}  fewer than 8 beams hit anything: the range is "
            "too short there, or free cells of the map are outdoors"
        )
    return "\n".join(lines)


def draw_predictions(
    grid: OccupancyGrid, sensors: Sequence[tuple[str, Sequence[Prediction]]], path: Path
) -> Path:
    """Draw a row of heat maps for each sensor: where one scan, one turn, one metre are enough.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    sensors : sequence of (str, sequence of Prediction)
        Words and predictions of each; at least one.
    path : Path
        File to write: .png, .svg or .pdf.

    Returns
    -------
    Path
        The file, absolute.

    Raises
    ------
    InputError
        If it cannot be written, or matplotlib is not installed.
    """
    aspect = min(1.5, grid.height / grid.width)
    figure = new_figure(15.0, (4.5 * aspect + 1.2) * len(sensors) + 1.2)
    rows = figure.subplots(len(sensors), len(Effort), squeeze=False)
    for (words, predictions), row in zip(sensors, rows, strict=True):
        for effort, axes in zip(Effort, row, strict=True):
            draw_map(axes, grid)
            mesh = _draw_heat(axes, grid, predictions, effort)
            right = share(predictions, effort, Answer.RIGHT)
            axes.set_title(f"{words}\n{effort.value}: enough at {right:.0%}", fontsize="medium")
    bar = figure.colorbar(mesh, ax=rows, location="bottom", shrink=0.4, aspect=40)
    bar.set_label(
        f"share of places around where it is enough (dots: {len(sensors[0][1])} sampled places, "
        "crosses: wrong)"
    )
    return save_figure(figure, path)


def _draw_heat(
    axes: Axes, grid: OccupancyGrid, predictions: Sequence[Prediction], effort: Effort
) -> QuadMesh:
    places = np.array([[p.T_map_base.x, p.T_map_base.y] for p in predictions])
    answers = [p.answers[effort] for p in predictions]
    right = np.array([answer is Answer.RIGHT for answer in answers])
    wrong = np.array([answer is Answer.WRONG for answer in answers])
    step = max(1, max(grid.cells.shape) // _TILES)
    corners = np.stack(
        np.meshgrid(
            np.arange(0.0, grid.width + step, step), np.arange(0.0, grid.height + step, step)
        ),
        axis=-1,
    )
    middles = grid.to_map(corners[:-1, :-1] + step / 2)
    heat = smoothed(middles, places, right, grid.free_area)
    rows, columns = np.minimum(
        (corners[:-1, :-1] + step / 2).astype(int), [grid.width - 1, grid.height - 1]
    ).T[::-1]
    shown = np.where(grid.seen_free[rows, columns].T, heat, np.nan)
    x, y = np.moveaxis(grid.to_map(corners), -1, 0)
    mesh = axes.pcolormesh(x, y, shown, cmap="viridis", vmin=0.0, vmax=1.0, alpha=0.75, zorder=2)
    x, y = places.T
    axes.scatter(x, y, s=5, c=np.where(right, "black", "white"), ec="black", lw=0.4, zorder=4)
    axes.scatter(x[wrong], y[wrong], s=50, marker="x", color=RED, zorder=5)
    return mesh


def smoothed(
    at: NDArray[np.float64],
    places: NDArray[np.float64],
    values: NDArray[np.bool_],
    area_m2: float,
) -> NDArray[np.float64]:
    """Return the weighted share of true values around some points.

    Parameters
    ----------
    at : ndarray, shape (..., 2)
        The points, m.
    places : ndarray, shape (n, 2)
        Where the values are known, m.
    values : ndarray of bool, shape (n,)
        The values.
    area_m2 : float
        Area over which the places are spread: each speaks for its part of it.

    Returns
    -------
    ndarray, shape (...)
        0 to 1; the nearest place counts most.
    """
    spread = area_m2 / max(1, len(places))
    squares = ((at[..., None, :] - places) ** 2).sum(axis=-1)
    # Relative to the nearest place, so that none is too far to count.
    weights = np.exp(-(squares - squares.min(axis=-1, keepdims=True)) / (2.0 * spread))
    shares: NDArray[np.float64] = (weights * values).sum(axis=-1) / weights.sum(axis=-1)
    return shares
