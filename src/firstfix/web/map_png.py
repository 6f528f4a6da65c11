"""The map as a picture for browsers."""

from __future__ import annotations

import io
import math
import threading
from collections import OrderedDict
from typing import Any

import numpy as np

from firstfix.plots.map_image import greys_of_blocks
from firstfix.web.snapshot import ActiveMap

# The longer side, pixels: what a browser on a phone can still draw in one piece.
MOST_PIXELS = 4096
LEAST_PIXELS = 64

# Pictures that are kept: the largest is 16 MB before it is packed.
_KEPT = 4


def cells_per_pixel(active_map: ActiveMap, most_pixels: int) -> int:
    """Return how many cells a side share a pixel where the picture may have so many a side."""
    return math.ceil(max(active_map.grid.width, active_map.grid.height) / most_pixels)


def image_of(active_map: ActiveMap, most_pixels: int = MOST_PIXELS) -> dict[str, Any]:
    """Describe the picture of a map.

    Parameters
    ----------
    active_map : ActiveMap
        The map.
    most_pixels : int
        The longer side, pixels.

    Returns
    -------
    dict
        ``width``, ``height`` (pixels), ``resolution`` (metres a pixel), ``url``. Its lower-left
        corner is that of the map; at the other sides it may go on for part of a pixel.
    """
    step = cells_per_pixel(active_map, most_pixels)
    return {
        "width": math.ceil(active_map.grid.width / step),
        "height": math.ceil(active_map.grid.height / step),
        "resolution": step * active_map.grid.resolution,
        "url": f"/v1/map.png?v={active_map.key[:12]}",
    }


class MapPngCache:
    """Draws maps as PNG, each size once; any thread may ask."""

    def __init__(self) -> None:
        self._drawing = threading.Lock()
        self._drawn: OrderedDict[tuple[str, int], bytes] = OrderedDict()

    def png(self, active_map: ActiveMap, most_pixels: int = MOST_PIXELS) -> bytes:
        """Draw a map: walls dark, unknown in between, free white.

        Parameters
        ----------
        active_map : ActiveMap
            The map.
        most_pixels : int
            The longer side, pixels. Where cells share a pixel the darkest is seen, so that thin
            walls stay.

        Returns
        -------
        bytes
            An 8-bit grey PNG, its top row that of the greatest y of the grid.
        """
        step = cells_per_pixel(active_map, most_pixels)
        with self._drawing:
            picture = self._drawn.pop((active_map.key, step), None) or _png(active_map, step)
            self._drawn[active_map.key, step] = picture
            while len(self._drawn) > _KEPT:
                self._drawn.popitem(last=False)
        return picture


def _png(active_map: ActiveMap, step: int) -> bytes:
    from PIL import Image

    packed = io.BytesIO()
    Image.fromarray(np.flipud(greys_of_blocks(active_map.grid, step))).save(packed, "PNG")
    return packed.getvalue()
