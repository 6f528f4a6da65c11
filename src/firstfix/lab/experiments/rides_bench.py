"""Many rides in the lift of a drawn building: poses on wrong floors, and rides that found theirs.

The JSON document::

    {"suite": "rides", "machine": {...from `machine.this_machine`...}, "seed", "floors", "area_m2",
     "total": {...}, "kinds": {"distinct": {...}, "alike": {...}, "twin": {...}}}

    {"rides", "poses", "wrong_map", "wrong_map_rides", "wrong_place", "found", "found_later",
     "found_s", "found_m", "cpu_s"}: ``kinds`` by the floor where the robot comes out
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from firstfix.lab.experiments.lift_bench import Ride, ride_lifts
from firstfix.lab.experiments.machine import this_machine
from firstfix.lab.reports.text import columns_table
from firstfix.lab.worlds.towers import Likeness, tower, write_tower
from firstfix.site.site import Site

FLOORS, AREA_M2 = 10, 700.0
"""The building of `ride_tasks`."""

_RIDES_A_TASK = 20

COLUMNS = (
    ("number", "rides", ".0f"),
    ("poses", "poses", ".0f"),
    ("on a wrong map", "wrong_map", ".0f"),
    ("more than 0.5 m off", "wrong_place", ".0f"),
    ("found", "found", ".1%"),
    ("found later, too", "found_later", ".1%"),
    ("median s", "found_s", ".1f"),
    ("median m", "found_m", ".2f"),
    ("CPU s a ride", "cpu_s", ".1f"),
)


@dataclass(frozen=True, slots=True)
class BuildTask:
    """Draw a building and prepare its maps, as far as they are not in the folder.

    Parameters
    ----------
    folder : Path
        Gets the folders ``maps`` and ``prepared``.
    seed : int
        Of the building.
    """

    folder: Path
    seed: int

    def __call__(self) -> None:
        """Run in this process."""
        folder = write_tower(self.folder / "maps", tower(self.seed, FLOORS, AREA_M2))
        Site.load(folder, self.folder / "prepared").prepare()


@dataclass(frozen=True, slots=True)
class RideTask:
    """Let one robot ride the lift of a prepared building.

    Parameters
    ----------
    folder, seed : Path, int
        As for `BuildTask`.
    robot : int
        Number of the robot.
    rides : int
        How often it rides.
    """

    folder: Path
    seed: int
    robot: int
    rides: int

    def __call__(self) -> tuple[Ride, ...]:
        """Run in this process."""
        floors = tower(self.seed, FLOORS, AREA_M2)
        seeds, prepared = (self.seed, self.robot), self.folder / "prepared"
        return tuple(ride_lifts(floors, self.folder / "maps", self.rides, seeds, prepared))


def ride_tasks(folder: Path, seed: int, rides: int) -> tuple[list[BuildTask], list[RideTask]]:
    """Return what prepares a building of 10 floors, and the robots that ride its lift.

    Nobody tells them their floor. Two floors are twins and two are alike (`towers.tower`).

    Parameters
    ----------
    folder : Path
        For the maps; what is there already is used.
    seed : int
        Of the building and the robots.
    rides : int
        Number of rides of all robots.
    """
    folder = folder / f"building_{seed}"
    starts = range(0, rides, _RIDES_A_TASK)
    robots = [
        RideTask(folder, seed, robot, min(_RIDES_A_TASK, rides - first))
        for robot, first in enumerate(starts)
    ]
    return [BuildTask(folder, seed)], robots


def rides_document(seed: int, rides: Sequence[Ride]) -> dict[str, Any]:
    """Put the rides in a building into the document described above."""
    by_kind = {
        kind.value: [ride for ride in rides if ride.likeness is kind]
        for kind in Likeness
        if any(ride.likeness is kind for ride in rides)
    }
    return {
        "suite": "rides",
        "machine": this_machine(),
        "seed": seed,
        "floors": FLOORS,
        "area_m2": AREA_M2,
        "total": asdict(_figures(rides)),
        "kinds": {kind: asdict(_figures(some)) for kind, some in by_kind.items()},
    }


def rides_table(document: dict[str, Any]) -> str:
    """Lay out the document in Markdown."""
    rows = [{"name": f"to {kind} floors", **of} for kind, of in document["kinds"].items()]
    total = {"name": "all", **document["total"]}
    return columns_table([*rows, total], {"rides": "name"}, COLUMNS)


@dataclass(frozen=True, slots=True)
class RideFigures:
    """What happened on some rides.

    Parameters
    ----------
    rides, poses : int
        Numbers of them.
    wrong_map, wrong_map_rides, wrong_place : int
        Poses on a wrong map, rides with such poses, and poses that are off on the right map.
    found, found_later : float
        Shares of rides whose floor was found in time, and in time or before the end of the drive.
    found_s, found_m : float or None
        Medians of time and way to the first right pose; None if that is never.
    cpu_s : float
        Mean processor time of the localizer on a ride.
    """

    rides: int
    poses: int
    wrong_map: int
    wrong_map_rides: int
    wrong_place: int
    found: float
    found_later: float
    found_s: float | None
    found_m: float | None
    cpu_s: float


def _figures(rides: Sequence[Ride]) -> RideFigures:
    seconds, metres = (
        float(np.median([getattr(ride, name) for ride in rides])) for name in ("found_s", "found_m")
    )
    return RideFigures(
        rides=len(rides),
        poses=sum(ride.poses for ride in rides),
        wrong_map=sum(ride.wrong_map for ride in rides),
        wrong_map_rides=sum(ride.wrong_map > 0 for ride in rides),
        wrong_place=sum(ride.wrong_place for ride in rides),
        found=float(np.mean([ride.is_found for ride in rides])),
        found_later=float(np.mean([math.isfinite(ride.found_s) for ride in rides])),
        found_s=seconds if math.isfinite(seconds) else None,
        found_m=metres if math.isfinite(metres) else None,
        cpu_s=float(np.mean([ride.cpu_s for ride in rides])),
    )
