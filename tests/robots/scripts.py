"""What the simulated robots of the tests do."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.scenarios.phases import CarryTo, DriveTo, Phase, Stand
from firstfix.lab.scenarios.scenario import Scenario
from firstfix.lab.simulation.rigs import RIGS, Rig
from firstfix.lab.simulation.simulation import Moment, Simulation
from firstfix.lab.worlds.catalog import WORLDS, identical_rooms

Script = Callable[[], tuple[OccupancyGrid, Scenario, int]]

TOLD = threading.Event()
"""Set by a test to let its robot continue."""


@dataclass(frozen=True, slots=True)
class StandUntilTold(Phase):
    """Stand still until the test lets the robot continue."""

    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Stand."""
        while not TOLD.is_set():
            yield simulation.step("stand")


def stand() -> tuple[OccupancyGrid, Scenario, int]:
    """Stand still in an office."""
    return WORLDS["office"](), Scenario((Stand(900.0),)), 1


def drive() -> tuple[OccupancyGrid, Scenario, int]:
    """Drive for a minute or more."""
    return WORLDS["office"](), Scenario((Stand(1.0), *[DriveTo()] * 6)), 2


def kidnapped() -> tuple[OccupancyGrid, Scenario, int]:
    """Be carried away, with all that a Kobuki notices of that."""
    phases = (Stand(4.0), CarryTo(seconds=3.0), Stand(30.0))
    return WORLDS["office"](), Scenario(phases), 3


def carried() -> tuple[OccupancyGrid, Scenario, int]:
    """Be carried away on the command of the test, with the signals of a Kobuki."""
    phases = (StandUntilTold(), CarryTo(seconds=3.0), Stand(900.0))
    return WORLDS["office"](), Scenario(phases), 3


def twins() -> tuple[OccupancyGrid, Scenario, int]:
    """Stand in one of four equal rooms."""
    return identical_rooms(4), Scenario((Stand(900.0),)), 4


def sensors() -> tuple[OccupancyGrid, Scenario, int]:
    """Stand, with two lasers, one of which is not enough at rest, and a LIDAR of 3D points."""
    corners = RIGS["two-lasers"].lidars
    lasers = (replace(corner, beams=301, fov=math.radians(150.0)) for corner in corners)
    rig = Rig((*lasers, *RIGS["3d-lidar"].lidars))
    return WORLDS["office"](), Scenario((Stand(900.0),), rig=rig), 2


SCRIPTS: dict[str, Script] = {
    "stand": stand,
    "drive": drive,
    "kidnapped": kidnapped,
    "carried": carried,
    "twins": twins,
    "sensors": sensors,
}
