"""The picture of a map, in the map frame."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_PIXELS = 2500  # a side; a page shows no more

GREY_WALL, GREY_UNKNOWN, GREY_FREE = 40, 205, 255


def draw_map(axes: Axes, grid: OccupancyGrid) -> None:
    """Draw a map in the map frame, with its yaw; axes in m.

    Parameters
    ----------
    axes : Axes
        Of matplotlib.
    grid : OccupancyGrid
        The map.
    """
    from matplotlib.transforms import Affine2D

    origin = grid.T_map_grid
    pixels = greys(grid, MAX_PIXELS)
    step = math.ceil(max(grid.cells.shape) / MAX_PIXELS)
    height, width = (side * step * grid.resolution for side in pixels.shape)
    image = axes.imshow(
        pixels,
        cmap="gray",
        vmin=0,
        vmax=255,
        origin="lower",
        extent=(0.0, width, 0.0, height),
        interpolation="nearest",
    )
    image.set_transform(
        Affine2D().rotate(origin.yaw).translate(origin.x, origin.y) + axes.transData
    )
    corners = origin.apply(np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]))
    axes.set_xlim(corners[:, 0].min(), corners[:, 0].max())
    axes.set_ylim(corners[:, 1].min(), corners[:, 1].max())
    axes.set_aspect("equal")
    axes.set_facecolor(str(GREY_UNKNOWN / 255))
    axes.set_xlabel("x in m")
    axes.set_ylabel("y in m")


def greys(grid: OccupancyGrid, max_pixels: int) -> NDArray[np.uint8]:
    """Return the map in grey, row 0 at the bottom, at most ``max_pixels`` a side.

    A pixel of several cells shows the darkest, so that thin walls stay: occupied before unknown
    before free.
    """
    return greys_of_blocks(grid, math.ceil(max(grid.cells.shape) / max_pixels))


def greys_of_blocks(grid: OccupancyGrid, step: int) -> NDArray[np.uint8]:
    """Return the map in grey as `greys` does, ``step`` x ``step`` cells to a pixel."""
    grey = np.full(grid.cells.shape, GREY_UNKNOWN, np.uint8)
    grey[grid.seen_free] = GREY_FREE
    grey[grid.occupied] = GREY_WALL
    if step == 1:
        return grey
    blocks = np.pad(grey, [(0, -grid.height % step), (0, -grid.width % step)], mode="edge")
    # One pass for each offset in a block: a minimum over two axes takes seven times as long.
    darkest = blocks[::step, ::step].copy()
    for row in range(step):
        for column in range(step):
            np.minimum(darkest, blocks[row::step, column::step], out=darkest)
    return darkest
