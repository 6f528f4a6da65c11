"""Everything that the map alone determines: computed on first use, then kept."""

from __future__ import annotations

import math
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


@dataclass(frozen=True, eq=False)
class MapFields:
    """A map, and the fields derived from it, each computed when it is first read.

    Threads may share it: two that read a field for the first time at once both compute the same.

    Parameters
    ----------
    grid : OccupancyGrid
        The map itself.
    cache_dir : Path or None
        Folder of range tables from earlier runs; None computes in memory.
    """

    grid: OccupancyGrid
    cache_dir: Path | None = None

    def compute(self, *names: str) -> None:
        """Compute these fields now, so that no scan waits for them."""
        for name in names:
            getattr(self, name)

    @property
    def near(self) -> int:
        """Distance at which ``squares`` saturates, cells."""
        return min(MAX_LIMIT, math.ceil(NEAR_M / self.grid.resolution) + 1)

    @cached_property
    def squares(self) -> NDArray[np.uint16]:
        """Squared Euclidean distance to the nearest wall, cells², at most ``near²``.

        Shape (height, width).
        """
        return _read_only(truncated_squares(self.grid.occupied, self.near))

    @cached_property
    def distances(self) -> NDArray[np.float32]:
        """Distance for every value of ``squares``, shape (near² + 1,), cells."""
        return np.sqrt(np.arange(self.near**2 + 1)).astype(np.float32)

    @cached_property
    def clearance(self) -> NDArray[np.uint8]:
        """Chessboard distance to the nearest wall, cells, by which rays leap; (height, width)."""
        return _read_only(chessboard_clearance(self.grid.occupied))

    @cached_property
    def pointscore(self) -> NDArray[np.uint16]:
        """Manhattan distance to the nearest wall, shape (height, width), cells (paper, Fig. 10)."""
        return manhattan_distance(self.grid.occupied)

    @cached_property
    def positions(self) -> SearchGrid:
        """The positions of the search."""
        return build_search_grid(self.grid)

    @cached_property
    def endpoints(self) -> PhasedField:
        """Truncated distances, by phases."""
        field = build_endpoint_field(
            self.squares, self.grid.resolution, self.positions.stride, REACH_M
        )
        _read_only(field.values)
        return field

    @cached_property
    def ranges(self) -> NDArray[np.uint8]:
        """Expected ranges at the positions, shape (n_positions, 2 * DIRECTIONS)."""
        # The only field that takes longer to build than to read from disk.
        if self.cache_dir is None:
            return _read_only(self._build_ranges())
        settings = repr(
            (self.grid.resolution, SPACING_M, MAX_POSITIONS, DIRECTIONS, UNIT_M, REACH_M)
        )
        key = cache.content_key("range table 1", self.grid.occupied, self.grid.seen_free, settings)
        return _read_only(cache.load_or_build(key, self._build_ranges, self.cache_dir))

    def _build_ranges(self) -> NDArray[np.uint8]:
        return build_range_table(self.clearance, self.grid.resolution, self.positions)


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Make an array read-only: threads share it, and to numba it is another type otherwise."""
    array.flags.writeable = False
    return array
