"""Drawn worlds that several tests look at."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.fields.map_fields import MapFields, build_fields


@pytest.fixture(scope="session")
def draw_room() -> Callable[[float], OccupancyGrid]:
    """Give a function that draws one room of 8 x 6 m with cells of any size.

    Its walls begin and end on multiples of 0.5 m, so that every size of cell draws them exactly; no
    turn of it looks the same.
    """

    def draw(resolution: float) -> OccupancyGrid:
        def span(low: float, high: float) -> slice:
            return slice(round(low / resolution), round(high / resolution))

        cells = np.full((round(8.0 / resolution), round(10.0 / resolution)), UNKNOWN, np.int8)
        cells[span(0.5, 7.5), span(0.5, 9.5)] = OCCUPIED
        cells[span(1.0, 7.0), span(1.0, 9.0)] = FREE
        for x0, y0, x1, y1 in (
            (1.0, 5.0, 3.0, 7.0),  # a corner cut out
            (5.5, 3.5, 6.0, 4.0),  # a pillar
            (7.5, 1.0, 9.0, 1.5),  # a shelf
            (3.5, 1.0, 4.0, 2.5),  # a stub of wall
        ):
            cells[span(y0, y1), span(x0, x1)] = OCCUPIED
        return OccupancyGrid(cells, resolution)

    return draw


@pytest.fixture(scope="session")
def room(draw_room: Callable[[float], OccupancyGrid]) -> MapFields:
    return build_fields(draw_room(0.05), None)
