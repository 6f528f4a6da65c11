"""The map as a PNG for browsers."""

from __future__ import annotations

import io
import math
import threading
from collections import OrderedDict

import numpy as np

from firstfix.plots.map_image import greys_of_blocks
from firstfix.web.snapshot import ActiveMap

# Limits of the longer side, pixels. A browser on a phone still draws 4096 in one piece.
MOST_PIXELS = 4096
LEAST_PIXELS = 64

# Images kept in memory. The largest takes 16 MB before compression.
_CACHED = 4


def cells_per_pixel(active_map: ActiveMap, most_pixels: int) -> int:
    """Return the side of the block of cells that shares a pixel."""
    return math.ceil(max(active_map.grid.width, active_map.grid.height) / most_pixels)


def png_layout(active_map: ActiveMap, most_pixels: int = MOST_PIXELS) -> tuple[int, int, float]:
    """Return width and height (pixels) and resolution (m per pixel) of the PNG.

    Its lower-left corner is that of the map. At the other two sides the last pixel may extend
    beyond the map.
    """
    grid, step = active_map.grid, cells_per_pixel(active_map, most_pixels)
    return math.ceil(grid.width / step), math.ceil(grid.height / step), step * grid.resolution


class MapPngCache:
    """Encodes maps as PNG, each size once. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._cached: OrderedDict[tuple[str, int], bytes] = OrderedDict()

    def png(self, active_map: ActiveMap, most_pixels: int = MOST_PIXELS) -> bytes:
        """Encode a map: walls dark, unknown in between, free space white.

        Parameters
        ----------
        active_map : ActiveMap
            The map.
        most_pixels : int
            The longer side, pixels. Where cells share a pixel the darkest is drawn, so that thin
            walls stay visible.

        Returns
        -------
        bytes
            An 8-bit grey PNG. Its top row has the greatest y of the grid.
        """
        step = cells_per_pixel(active_map, most_pixels)
        with self._lock:
            png = self._cached.pop((active_map.key, step), None) or _encode(active_map, step)
            self._cached[active_map.key, step] = png
            while len(self._cached) > _CACHED:
                self._cached.popitem(last=False)
        return png


def _encode(active_map: ActiveMap, step: int) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(np.flipud(greys_of_blocks(active_map.grid, step))).save(file, "PNG")
    return file.getvalue()
