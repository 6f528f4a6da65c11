"""Scripts of what happens to a robot, and what it reports meanwhile."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.sim.floor import Floor
from firstfix.sim.lidar import Lidar
from firstfix.sim.phases import Phase
from firstfix.sim.robot import Kobuki
from firstfix.sim.stage import Moment, Stage
from firstfix.sim.world import random_free_pose


def _usual_lidar() -> Lidar:
    return Lidar(dropout=0.01, T_base_laser=SE2(0.07, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class Scenario:
    """A script; with a map and a seed it always plays the same.

    Parameters
    ----------
    phases : sequence of Phase
        What happens, one after another.
    start : SE2 or None
        ``T_map_base`` at first; None for a random free place.
    kobuki : Kobuki
        The robot.
    lidar : Lidar
        Its sensor, a few centimetres before its middle by default.
    """

    phases: Sequence[Phase]
    start: SE2 | None = None
    kobuki: Kobuki = field(default_factory=Kobuki)
    lidar: Lidar = field(default_factory=_usual_lidar)


def run(scenario: Scenario, grid: OccupancyGrid, seed: int) -> Iterator[Moment]:
    """Play a scenario.

    Parameters
    ----------
    scenario : Scenario
        The script.
    grid : OccupancyGrid
        The map of the building.
    seed : int
        Where chance begins.

    Yields
    ------
    Moment
        One for every scan, 10 a second.
    """
    for_start, for_stage = np.random.SeedSequence(seed).spawn(2)
    start = scenario.start
    if start is None:
        start = random_free_pose(grid, np.random.default_rng(for_start))
    stage = Stage(Floor(grid), scenario.kobuki, scenario.lidar, start, for_stage)
    for phase in scenario.phases:
        yield from phase.play(stage)
