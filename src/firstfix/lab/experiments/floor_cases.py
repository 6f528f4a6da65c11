"""Cases of random floors: the map of each, and a drive in the world that differs from it."""

from __future__ import annotations

from functools import partial

import numpy as np

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.lab.experiments.case import Case
from firstfix.lab.scenarios.phases import Crowd, Manner, Wander
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.recorder import record
from firstfix.lab.simulation.robot import Kobuki
from firstfix.lab.simulation.wheels import WheelErrors
from firstfix.lab.worlds.floors import RandomFloor, floor_id

# Floors of this size, m²; how long the robot drives, s; and how many people walk about it at most.
_AREA_M2 = (500.0, 5000.0)
_DRIVE_S = 60.0
_MOST_PEOPLE = 6

# A worn robot: it drifts by two degrees a metre, and a wheel slips every twenty metres.
_WORN = WheelErrors(sigma_scale=0.02, sigma_uneven=0.006, sigma_step=0.006, slips_per_m=0.05)


# More floors than this are a mistake of typing.
_MOST_FLOORS = 10_000


def parse_floors(text: str | None) -> range:
    """Read ``FIRST-LAST``, the seeds of floors, or one seed; None is none.

    Raises
    ------
    InputError
        If it is neither, or names more than 10,000.

    Examples
    --------
    >>> parse_floors("1000-1002")
    range(1000, 1003)
    """
    if text is None:
        return range(0)
    first, dash, last = text.partition("-")
    if first.isdecimal() and (last.isdecimal() or not dash) and len(text) <= 20:
        seeds = range(int(first), int(last or first) + 1)
        if 0 < len(seeds) <= _MOST_FLOORS:
            return seeds
    raise InputError(
        expected=f"--floors FIRST-LAST, seeds of at most {_MOST_FLOORS:,} floors",
        received=repr(text),
        remedy="write it like --floors 1000-1023",
    )


def floor_case(seed: int) -> Case:
    """Describe the drive of a robot with a 360° x 12 m LIDAR on a random floor.

    Walls and furniture are not all where the map has them, doors were opened or closed since, and
    people walk about. Nothing is drawn before the case is loaded.

    Parameters
    ----------
    seed : int
        Of the floor and of the drive.
    """
    floor = RandomFloor(seed, float(np.random.default_rng(seed).uniform(*_AREA_M2)))
    name = floor_id(floor)
    return Case(name, name, "drawn", grid=partial(_map, floor), recording=partial(_drive, floor))


def _map(floor: RandomFloor) -> OccupancyGrid:
    return floor.map()


def _drive(floor: RandomFloor) -> Recording:
    people = int(np.random.default_rng([floor.seed, 1]).integers(_MOST_PEOPLE + 1))
    phases = (Crowd(people, manner=Manner.WALK), Wander(_DRIVE_S))
    scenario = Scenario(phases, kobuki=Kobuki(wheels=_WORN))
    return record(run(scenario, floor.world(), floor.seed))
