"""Drawn worlds and drives that the tests of the belief share."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from firstfix.belief.view import View
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import identical_rooms
from firstfix.lab.worlds.drawing import Drawing

# A depth camera: one scan of it never decides.
NARROW = Lidar(beams=61, fov=math.radians(60.0), range_max=5.0, sigma_m=0.01)

ODOMETRY = SE2(-4.0, 2.0, 0.7)

Drive = Callable[..., list[View]]


@pytest.fixture(scope="session")
def halls() -> MapFields:
    """Two halls of 6 x 4 m; in the right one a block stands in the far corner."""
    plan = Drawing(15.0, 6.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 6.0, 4.0)
    plan.room(7.0, 0.0, 13.0, 4.0)
    for x in (0.0, 7.0):
        plan.solid(x + 2.0, 3.2, x + 2.6, 3.9)
    plan.solid(12.0, 0.1, 12.9, 0.8)
    return MapFields(plan.grid())


@pytest.fixture(scope="session")
def four_rooms() -> MapFields:
    """Four rooms that no scan can distinguish."""
    return MapFields(identical_rooms(4))


@pytest.fixture(scope="session")
def room() -> MapFields:
    """One room that looks the same from no two places."""
    plan = Drawing(8.0, 6.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 8.0, 6.0)
    plan.solid(0.1, 4.0, 2.0, 5.9)
    plan.solid(4.5, 2.5, 5.0, 3.0)
    plan.solid(6.5, 0.1, 7.9, 0.5)
    return MapFields(plan.grid())


@pytest.fixture(scope="session")
def drive() -> Drive:
    """Give a function that takes views along a path: start, then steps of the base."""

    def drive(
        grid: OccupancyGrid,
        start: SE2,
        steps: list[SE2],
        lidar: Lidar = NARROW,
        odometry: SE2 = ODOMETRY,
        slip: float = 1.0,
    ) -> list[View]:
        rng, pose = np.random.default_rng(3), start
        views = [View.of(lidar.scan(grid, pose, rng), odometry)]
        for step in steps:
            pose = pose @ step
            odometry = odometry @ SE2(slip * step.x, slip * step.y, step.yaw)
            views.append(View.of(lidar.scan(grid, pose, rng), odometry))
        return views

    return drive
