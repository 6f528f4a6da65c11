"""Drawn worlds, scans of them, and what several tests hand to the filter."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import FilterState, Injection
from firstfix.amcl.initial import free_poses
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.drawing import Drawing

LIDAR = Lidar(beams=60)


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


@pytest.fixture(scope="session")
def observe() -> Callable[..., LaserScan]:
    """Give a function that looks around somewhere."""

    def observe(grid: OccupancyGrid, pose: SE2, seed: int = 0) -> LaserScan:
        return LIDAR.scan(grid, pose, np.random.default_rng(seed))

    return observe


@pytest.fixture(scope="session")
def fixed() -> Callable[..., AmclConfig]:
    """Give a function that makes settings with a fixed number of particles."""

    def fixed(n: int, **settings: object) -> AmclConfig:
        return AmclConfig(min_particles=n, max_particles=n, **settings)

    return fixed


@pytest.fixture(scope="session")
def never() -> Injection:
    """Fail if particles are injected."""

    def never(scan: LaserScan, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
        raise AssertionError("nothing is to be injected")

    return never


@pytest.fixture(scope="session")
def inject_free() -> Callable[[OccupancyGrid], Injection]:
    """Give a function that makes an injection of poses in free space, as AMCL does."""

    def inject_free(grid: OccupancyGrid) -> Injection:
        return lambda scan, n, rng: free_poses(grid, n, rng)

    return inject_free


@pytest.fixture(scope="session")
def assert_is_belief() -> Callable[[FilterState, AmclConfig], None]:
    """Give a function that checks what must hold after every step."""

    def assert_is_belief(state: FilterState, config: AmclConfig) -> None:
        assert state.particles.weight.sum() == pytest.approx(1.0, abs=1e-12)
        assert state.particles.weight.min() >= 0.0
        assert config.min_particles <= len(state.particles) <= config.max_particles
        assert np.isfinite(state.particles.poses()).all()
        assert (np.abs(state.particles.yaw) <= math.pi).all()
        assert sum(c.mass for c in state.clusters) <= 1.0 + 1e-12
        for cluster in state.clusters:
            assert np.isfinite(cluster.covariance).all()

    return assert_is_belief
