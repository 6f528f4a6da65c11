"""Drawn worlds that several tests look at."""

from __future__ import annotations

import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.sim.drawing import Drawing


@pytest.fixture(scope="session")
def room() -> OccupancyGrid:
    """Draw one room of 8 x 6 m at 5 cm, no turn of which looks the same; nothing known around."""
    plan = Drawing(8.0, 6.0, 0.05, 1.0)
    plan.room(0.1, 0.1, 7.9, 5.9)
    plan.solid(0.2, 4.0, 2.0, 5.8)  # a corner cut out
    plan.solid(5.5, 3.5, 5.9, 3.9)  # a pillar
    plan.solid(6.0, 0.2, 7.8, 0.6)  # a shelf
    plan.solid(2.8, 0.2, 3.0, 1.4)  # a stub of wall
    return plan.grid()
