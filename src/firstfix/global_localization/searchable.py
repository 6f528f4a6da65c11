"""Checks that a map can be searched at all."""

from __future__ import annotations

import numpy as np

from firstfix.core.errors import MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.fields.map_fields import MapFields
from firstfix.fields.search_grid import SPACING_M


def check_searchable(grid: OccupancyGrid) -> None:
    """Raise MapError if a map has nothing to compare with, or nowhere to be."""
    for kind, cells in (("occupied", grid.occupied), ("free", grid.seen_free)):
        if not cells.any():
            raise MapError(
                expected="a map with walls and free space",
                received=f"a map of {grid.width} x {grid.height} cells, none of them {kind}",
                remedy="check its thresholds, negate and image with `firstfix map check`",
            )


def check_positions(fields: MapFields) -> None:
    """Raise MapError if free space is too narrow for any position of the search."""
    if len(fields.positions) == 0:
        raise MapError(
            expected=f"free space {SPACING_M} m wide, for a robot to be in",
            received=f"{np.count_nonzero(fields.grid.seen_free)} free cells of "
            f"{fields.grid.resolution} m, nowhere together",
            remedy="check resolution and thresholds with `firstfix map check`",
        )
