"""Office after office, to see what a large map costs."""

from __future__ import annotations

import numpy as np

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.lab.simulation.furniture import furnished
from firstfix.lab.worlds.office import office

_BOXES = 12


def many_offices(count: int, rng: np.random.Generator) -> OccupancyGrid:
    """Draw floors of one plan side by side, 42 x 27 m each, with different furniture.

    The floors form a rectangle that is as square as possible; no path leads from floor to floor.

    Raises
    ------
    InputError
        If ``count`` is less than 1.
    """
    if count < 1:
        raise InputError(
            expected="at least 1 office", received=f"{count}", remedy="ask for one office or more"
        )
    plan = office()
    rows = max(n for n in range(1, int(count**0.5) + 1) if count % n == 0)
    floors = [furnished(plan, _BOXES, rng).cells for _ in range(count)]
    columns = count // rows
    cells = np.block([floors[i * columns : (i + 1) * columns] for i in range(rows)])
    return OccupancyGrid(cells, plan.resolution, plan.T_map_grid)
