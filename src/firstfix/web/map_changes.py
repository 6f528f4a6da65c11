"""What has changed in the map in use: as a message and as a PNG over the map."""

from __future__ import annotations

import io
import threading
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray
from starlette.exceptions import HTTPException

from firstfix.changes.counts import ChangeCounter
from firstfix.changes.survey import Change, MapChanges, find_changes
from firstfix.plots.changes_picture import CHANGE_COLOURS
from firstfix.web.map_png import cells_per_pixel
from firstfix.web.messages import Count, Share
from firstfix.web.snapshot import ActiveMap

NOT_KEPT = (
    "This robot does not keep changes of the map. Restart it with --keep-changes 7, or with the "
    "parameter changes.days_kept."
)
_OPACITY = 200
# Floor that was not mapped is large and harmless.
_FAINT = 60
# Of the cells of a pixel, the change that matters most is shown.
_IMPORTANCE = (Change.NEW, Change.GONE, Change.FOUND_WALL, Change.FOUND_FREE)


class ChangedArea(Struct, frozen=True):
    """Connected cells that differ from the map in one way."""

    change: Annotated[str, Meta(description="gone, new, found_wall or found_free")]
    area: Annotated[float, Meta(description="m²")]
    position: Annotated[tuple[float, float], Meta(description="in the map frame, m")]
    size: Annotated[tuple[float, float], Meta(description="box along the grid's axes, m")]
    views: Count
    days: Count


class Changes(Struct, frozen=True):
    """What scans of the localized robot contradict in the map."""

    days: Annotated[tuple[str, ...], Meta(description="YYYY-MM-DD, UTC, oldest first")]
    views: Count
    explained: Annotated[Share, Meta(description="share of the beams that end at walls")]
    areas: Annotated[list[ChangedArea], Meta(description="largest first")]

    @classmethod
    def of(cls, changes: MapChanges, explained: float) -> Changes:
        """Describe changes."""
        areas = [
            ChangedArea(
                area.change.name.lower(),
                area.area_m2,
                (area.x, area.y),
                (area.width_m, area.height_m),
                area.views,
                area.days,
            )
            for area in changes.areas
        ]
        return cls(changes.dates, changes.views, explained, areas)


class ChangesCache:
    """Compares counts with the map, once for all viewers. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._found: tuple[ChangeCounter, int, MapChanges] | None = None

    def find(self, active_map: ActiveMap) -> MapChanges:
        """Return the changes so far; those of the last call if no view was added since.

        Raises
        ------
        HTTPException
            404 if the robot does not keep them.
        """
        counter = counter_of(active_map)
        with self._lock:
            views = counter.views
            if self._found is None or self._found[:2] != (counter, views):
                changes = find_changes(active_map.grid, counter.days)
                self._found = counter, views, changes
            return self._found[2]

    def png(self, active_map: ActiveMap, most_pixels: int) -> bytes:
        """Encode the changes as a PNG with alpha; pixels are those of the map's PNG."""
        from PIL import Image

        step = cells_per_pixel(active_map, most_pixels)
        file = io.BytesIO()
        pixels = coloured(self.find(active_map).kinds, step)
        Image.fromarray(np.flipud(pixels)).save(file, "PNG")
        return file.getvalue()


def counter_of(active_map: ActiveMap) -> ChangeCounter:
    """Return the counts of a map.

    Raises
    ------
    HTTPException
        404 if the robot does not keep them.
    """
    if active_map.changes is None:
        raise HTTPException(404, NOT_KEPT)
    return active_map.changes


def coloured(kinds: NDArray[np.uint8], step: int) -> NDArray[np.uint8]:
    """Return RGBA pixels of ``step`` x ``step`` cells, shape (rows, columns, 4)."""
    padded = np.pad(kinds, [(0, -side % step) for side in kinds.shape])
    rows, columns = (side // step for side in padded.shape)
    blocks = padded.reshape(rows, step, columns, step)
    pixels: NDArray[Any] = np.zeros((rows, columns, 4), np.uint8)
    for change in reversed(_IMPORTANCE):
        colour = bytes.fromhex(CHANGE_COLOURS[change].removeprefix("#"))
        opacity = _FAINT if change is Change.FOUND_FREE else _OPACITY
        pixels[(blocks == change).any(axis=(1, 3))] = (*colour, opacity)
    return pixels
