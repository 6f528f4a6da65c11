"""Scenarios: scripts of phases, and the reports of the robot meanwhile."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.phases import Phase
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.furniture import furnished
from firstfix.lab.simulation.rigs import RIGS, Rig
from firstfix.lab.simulation.robot import Kobuki
from firstfix.lab.simulation.simulation import Moment, Simulation
from firstfix.lab.worlds.catalog import random_free_pose


@dataclass(frozen=True, slots=True)
class Scenario:
    """A script; with a map and a seed it is deterministic.

    Parameters
    ----------
    phases : sequence of Phase
        What happens, in order.
    start : SE2 or None
        First ``T_map_base``; None for a random free pose.
    kobuki : Kobuki
        The robot.
    rig : Rig
        Its sensors, by default one LIDAR a few centimetres before its centre.
    furniture : int
        Boxes in the building that are not in the map.
    """

    phases: Sequence[Phase]
    start: SE2 | None = None
    kobuki: Kobuki = field(default_factory=Kobuki)
    rig: Rig = RIGS["lidar"]
    furniture: int = 0


def run(scenario: Scenario, grid: OccupancyGrid, seed: int) -> Iterator[Moment]:
    """Run a scenario in a building and yield one `Moment` for every scan, 10 a second.

    Raises
    ------
    InputError
        If the robot does not fit where the script puts it, or no path leads to a goal.
    """
    simulation = start_simulation(scenario, grid, seed)
    for phase in scenario.phases:
        yield from phase.run(simulation)


def start_simulation(scenario: Scenario, grid: OccupancyGrid, seed: int) -> Simulation:
    """Prepare a scenario: the robot stands at its start, and no phase has run yet.

    Raises
    ------
    InputError
        If the robot does not fit where the script puts it.
    """
    for_building, for_simulation = np.random.SeedSequence(seed).spawn(2)
    rng = np.random.default_rng(for_building)
    start = scenario.start if scenario.start is not None else random_free_pose(grid, rng)
    if scenario.furniture:
        keep_free = [start, *(place for phase in scenario.phases for place in phase.places)]
        grid = furnished(grid, scenario.furniture, rng, keep_free)
    floor = Floor(grid)
    for place in (start, *(place for phase in scenario.phases for place in phase.places)):
        check_room(floor, place, scenario.kobuki.radius_m)
    return Simulation(floor, scenario.kobuki, scenario.rig, start, for_simulation)


def check_room(floor: Floor, place: SE2, radius_m: float) -> None:
    """Refuse a place in the map frame that has less room (m) around it than the robot needs.

    Raises
    ------
    InputError
        If it has.
    """
    room = floor.room_at(place.x, place.y)
    if room < radius_m:
        raise InputError(
            f"({place.x:.2f}, {place.y:.2f}) m is too close to a wall. Pick a point in free space, "
            f"at least {radius_m:.1f} m from walls."
        )
