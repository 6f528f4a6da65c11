"""Everything a search needs to know of a map, computed once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

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
    """A map, prepared.

    Parameters
    ----------
    grid : OccupancyGrid
        The map itself.
    squares : ndarray of uint16, shape (height, width)
        Squared Euclidean distance to the nearest wall, cells², up to ``near`` squared.
    clearance : ndarray of uint8, shape (height, width)
        Distance to the nearest wall as a king walks, cells; rays leap by it.
    near : int
        Distance from which on ``squares`` no longer grows, cells.
    positions : SearchGrid
        The positions that a search looks at.
    endpoints : PhasedField
        Truncated distances, by phases.
    ranges : ndarray of uint8, shape (n_positions, 2 * DIRECTIONS)
        Expected ranges at the positions.
    """

    grid: OccupancyGrid
    squares: NDArray[np.uint16]
    clearance: NDArray[np.uint8]
    near: int
    positions: SearchGrid
    endpoints: PhasedField
    ranges: NDArray[np.uint8]

    @cached_property
    def layouts(self) -> dict[int, PhasedField]:
        """The widest layout of ``pointscore`` made so far, by its stride."""
        return {}

    @cached_property
    def distances(self) -> NDArray[np.float32]:
        """Distance for every value of ``squares``, shape (near² + 1,), cells."""
        return np.sqrt(np.arange(self.near**2 + 1)).astype(np.float32)

    @cached_property
    def pointscore(self) -> NDArray[np.uint16]:
        """Manhattan distance to the nearest wall, shape (height, width), cells (paper, Fig. 10)."""
        return manhattan_distance(self.grid.occupied)


def build_fields(grid: OccupancyGrid, cache_dir: Path | None) -> MapFields:
    """Prepare a map, or fetch what an earlier run prepared.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    cache_dir : Path or None
        Folder of prepared maps; None prepares in memory.

    Returns
    -------
    MapFields
        The prepared map.
    """
    near = min(MAX_LIMIT, math.ceil(NEAR_M / grid.resolution) + 1)
    positions = build_search_grid(grid)
    squares = truncated_squares(grid.occupied, near)
    clearance = chessboard_clearance(grid.occupied)
    # Read-only throughout: shared between threads, and one type for the kernels, cached or not.
    clearance.flags.writeable = False

    ranges = _cached_range_table(clearance, grid, positions, cache_dir)
    endpoints = build_endpoint_field(squares, grid.resolution, positions.stride, REACH_M)
    for array in (squares, endpoints.values, ranges):
        array.flags.writeable = False
    return MapFields(
        grid=grid,
        squares=squares,
        clearance=clearance,
        near=near,
        positions=positions,
        endpoints=endpoints,
        ranges=ranges,
    )


def _cached_range_table(
    clearance: NDArray[np.uint8],
    grid: OccupancyGrid,
    positions: SearchGrid,
    cache_dir: Path | None,
) -> NDArray[np.uint8]:
    # The only field that takes longer to build than to read.
    def build() -> dict[str, NDArray[np.uint8]]:
        return {"ranges": build_range_table(clearance, grid.resolution, positions)}

    if cache_dir is None:
        return build()["ranges"]
    settings = repr((grid.resolution, SPACING_M, MAX_POSITIONS, DIRECTIONS, UNIT_M, REACH_M))
    key = cache.content_key("range table 1", grid.occupied, grid.seen_free, settings)
    return cache.load_or_build(key, build, cache_dir)["ranges"]
