"""A map and a drive to try firstfix with, without a robot."""

from __future__ import annotations

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.lab.scenarios.phases import DriveTo, Stand
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.recorder import record
from firstfix.lab.worlds.catalog import WORLDS

_STAND_S = 2.0


def simulate_drive(world: str = "office", seed: int = 0) -> tuple[OccupancyGrid, Recording]:
    """Simulate a robot that drives to a random place of a built-in world.

    Parameters
    ----------
    world : str
        ``"office"``, ``"rooms"``, ``"warehouse"``, ``"house"``, ``"corridor"`` or ``"hotel"``.
    seed : int
        Seed of the places, the noise and the wheel slip, at least 0.

    Returns
    -------
    OccupancyGrid
        The map.
    Recording
        Scans, odometry and ground truth of the drive, about a minute.

    Raises
    ------
    InputError
        If no world has this name.

    Examples
    --------
    >>> building, drive = ff.simulate_drive("rooms", seed=1)
    >>> drive
    <Recording ... scans in ... s, with odometry and ground truth>
    """
    if world not in WORLDS:
        raise InputError(
            expected=f"world as one of {', '.join(WORLDS)}",
            received=f"{world!r:.60}",
            remedy="pass one of these",
        )
    grid = WORLDS[world]()
    return grid, record(run(Scenario((Stand(_STAND_S), DriveTo())), grid, seed))
