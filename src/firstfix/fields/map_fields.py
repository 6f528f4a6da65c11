"""Everything that the map alone determines: computed on first use, then kept."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid
from firstfix.fields import cache
from firstfix.fields.clearance import chessboard_clearance
from firstfix.fields.distance import MAX_LIMIT, manhattan_distance, truncated_squares
from firstfix.fields.endpoint_field import build_endpoint_field
from firstfix.fields.look_table import BLOCKS, LookTable, build_look_table
from firstfix.fields.phased_field import PhasedField
from firstfix.fields.range_table import DIRECTIONS, REACH_M, UNIT_M, build_range_table
from firstfix.fields.search_grid import (
    MAX_POSITIONS,
    SPACING_M,
    SearchGrid,
    build_search_grid,
)

# Farther than any refinement reaches for a wall.
NEAR_M = 1.0

# Noise and error of the pose put the end of a beam this far from what it hit.
_CHANGE_M = 0.1

# Of the arrays in the folder of fields.
_VERSION = "fields 4"
_SETTINGS = repr((SPACING_M, BLOCKS, DIRECTIONS, UNIT_M, REACH_M, NEAR_M, MAX_LIMIT))


@dataclass(frozen=True, eq=False)
class MapFields:
    """A map, and the fields derived from it, each computed when it is first read.

    Threads may share it: two that read a field for the first time at once both compute the same.

    Parameters
    ----------
    grid : OccupancyGrid
        The map itself.
    cache_dir : Path or None
        Folder of fields from earlier runs; None computes in memory.
    key : str
        Name of the map's content in that folder; by default a hash of its cells.
    cache_limit : int or None
        Size of the folder above which the least recently used files are removed, bytes; None for
        no limit.
    most_positions : int
        A map with more positions is searched where a first look finds it promising.
    """

    grid: OccupancyGrid
    cache_dir: Path | None = None
    key: str = ""
    cache_limit: int | None = cache.MAX_TOTAL_BYTES
    most_positions: int = MAX_POSITIONS

    def compute(self, *names: str) -> None:
        """Compute these fields now, so that no scan waits for them."""
        for name in names:
            getattr(self, name)

    @property
    def is_looked_at(self) -> bool:
        """Whether a first look chooses where to search."""
        return len(self.positions) > self.most_positions

    def compute_for_search(self) -> None:
        """Compute what the search of the whole map reads."""
        self.compute("clearance", "endpoints", "look" if self.is_looked_at else "ranges")

    @property
    def near(self) -> int:
        """Distance at which ``squares`` saturates, cells."""
        return min(MAX_LIMIT, math.ceil(NEAR_M / self.grid.resolution) + 1)

    @cached_property
    def squares(self) -> NDArray[np.uint16]:
        """Squared Euclidean distance to the nearest wall, cells², at most ``near²``.

        Shape (height, width).
        """
        return self._kept("squares", lambda: truncated_squares(self.grid.occupied, self.near))

    @cached_property
    def distances(self) -> NDArray[np.float32]:
        """Distance for every value of ``squares``, shape (near² + 1,), cells."""
        return np.sqrt(np.arange(self.near**2 + 1)).astype(np.float32)

    @cached_property
    def clearance(self) -> NDArray[np.uint8]:
        """Chessboard distance to the nearest wall, cells, by which rays leap; (height, width)."""
        return self._kept("clearance", lambda: chessboard_clearance(self.grid.occupied))

    @cached_property
    def pointscore(self) -> NDArray[np.uint16]:
        """Manhattan distance to the nearest wall, shape (height, width), cells (paper, Fig. 10)."""
        return manhattan_distance(self.grid.occupied)

    @cached_property
    def unknown(self) -> NDArray[np.bool_]:
        """Unknown cells as `OccupancyGrid.unknown`, from the folder if the content has a name."""
        if not self.key:  # a hash of walls and free cells does not tell them
            return self.grid.unknown
        return self._kept("unknown", lambda: self.grid.unknown)

    @cached_property
    def positions(self) -> SearchGrid:
        """The positions of the search."""
        return SearchGrid.unpacked(
            self._kept("positions", lambda: build_search_grid(self.grid).packed())
        )

    @cached_property
    def endpoints(self) -> PhasedField:
        """Truncated distances, by phases."""
        return PhasedField.unpacked(self._kept("endpoints", self._build_endpoints))

    @cached_property
    def ranges(self) -> NDArray[np.uint8]:
        """Expected ranges at the positions, shape (n_positions, 2 * DIRECTIONS)."""
        return self._kept("ranges", self._build_ranges)

    @cached_property
    def look(self) -> LookTable:
        """Shortest and longest ranges of every block of 2 x 2 positions."""
        return LookTable.unpacked(self._kept("look", self._build_look))

    @cached_property
    def _content(self) -> str:
        return self.key or cache.content_key(
            self.grid.occupied, self.grid.seen_free, repr(self.grid.resolution)
        )

    def _kept(self, name: str, build: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        """Return an array from the folder of fields, or build it; read-only."""
        if self.cache_dir is None:
            return _read_only(build())
        key = cache.content_key(_VERSION, self._content, name, _SETTINGS)
        return _read_only(cache.load_or_build(key, build, self.cache_dir, self.cache_limit))

    @cached_property
    def changed(self) -> NDArray[np.bool_]:
        """Cells that are known to have changed, or next to one; shape (0, 0) if none are known."""
        if self.grid.changed is None:
            return _read_only(np.zeros((0, 0), np.bool_))
        reach = max(1, round(_CHANGE_M / self.grid.resolution))
        return _read_only(truncated_squares(self.grid.changed, reach + 1) <= reach**2)

    @property
    def nbytes(self) -> int:
        """Size of the map and of the fields that have been computed, bytes."""
        held = [*vars(self).values(), *vars(self.grid).values()]
        arrays = [getattr(value, "values", value) for value in held]
        return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))

    def _build_endpoints(self) -> NDArray[np.uint8]:
        return build_endpoint_field(
            self.squares, self.grid.resolution, self.positions.stride, REACH_M
        ).packed()

    def _build_look(self) -> NDArray[np.uint8]:
        grid, stride = self.grid, BLOCKS * self.positions.stride
        return build_look_table(
            grid.occupied, grid.seen_free, self.clearance, grid.resolution, stride
        ).packed()

    def _build_ranges(self) -> NDArray[np.uint8]:
        return build_range_table(
            self.grid.occupied, self.clearance, self.grid.resolution, self.positions
        )


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Make an array read-only: threads share it, and to numba it is another type otherwise."""
    array.flags.writeable = False
    return array
