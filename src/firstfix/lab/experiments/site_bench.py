"""Sites of random floors: which map and where, by one scan, and what it takes.

First the floors are drawn and prepared (`PrepareTask`), then scans are located (`AskTask`), in
processes of their own. What is in the folder already is used: a run that was stopped goes on.

The JSON document::

    {"suite": "site", "machine": {...from `machine.this_machine`...}, "floors", "area_m2",
     "queries", "right_map", "right_place", "unique", "wrong_unique", "first_look_best_20",
     "look_cpu_s", "cpu_s", "cpu_s_max", "wall_s", "drawn", "prepare_cpu_s", "open_cpu_s",
     "rss_mb", "extrapolated": {"area_m2", "cpu_s", "wall_s_16_cores", "wall_s_64_cores"}}
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from firstfix.core.estimate import Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.maps.site_yaml import read_site
from firstfix.lab.experiments.machine import this_machine
from firstfix.lab.experiments.process_pool import peak_rss_mb
from firstfix.lab.reports.text import columns_table
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.people import Manner, People
from firstfix.lab.simulation.sweep import sweep
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.lab.worlds.floors import RandomFloor, floor_id, write_site
from firstfix.site.site import Site

QUERIES = 100
"""Scans of a site where the user does not say how many."""

# All round and partial views, m and degrees.
_SENSORS = ((360, 12.0), (270, 20.0), (360, 25.0), (240, 12.0))

# Mean number of people in sight. With it, scans fit their maps at the true pose as well as those of
# ten recorded drives; among up to six people, each time, clearly worse (docs/decisions/0022).
_PEOPLE = 1.5

_ROOM_M = 0.3
_RIGHT_M, _RIGHT_RAD = 0.5, math.radians(10.0)
_BEST = 20
_GOAL_M2 = 1e7

# Prepared maps are mapped into memory: the system drops what is not used.
_MAPPED_BYTES = 1 << 40

# Of a task: enough to pay for its start, few enough to show progress.
_FLOORS_A_TASK, _QUERIES_A_TASK = 25, 25

COLUMNS = (
    ("floors", "floors", ".0f"),
    ("m²", "area_m2", ".0f"),
    ("scans", "queries", ".0f"),
    ("right map", "right_map", ".1%"),
    ("right place", "right_place", ".1%"),
    ("unique", "unique", ".1%"),
    ("wrong", "wrong_unique", ".0f"),
    ("in best 20", "first_look_best_20", ".1%"),
    ("look CPU s", "look_cpu_s", ".3f"),
    ("CPU s", "cpu_s", ".3f"),
    ("most CPU s", "cpu_s_max", ".3f"),
    ("wall s", "wall_s", ".3f"),
    ("drawn", "drawn", ".0f"),
    ("prepare CPU s", "prepare_cpu_s", ".1f"),
    ("open CPU s", "open_cpu_s", ".1f"),
    ("RSS MB", "rss_mb", ".0f"),
)


@dataclass(frozen=True, slots=True)
class Prepared:
    """What the preparation of some floors took.

    Parameters
    ----------
    floors : int
        Number of floors.
    area_m2 : float
        Of all of them.
    drawn : int
        Number of floors that were not in the folder.
    cpu_s : float
        Processor time of the preparation, s; little for floors that were prepared before.
    """

    floors: int
    area_m2: float
    drawn: int
    cpu_s: float


@dataclass(frozen=True, slots=True)
class Answer:
    """What became of one scan.

    Parameters
    ----------
    in_best : bool
        Whether the right map is among the 20 best of the first look.
    right_map, right_place : bool
        Whether the best place is in the right map, and is the right one.
    unique : bool
        Whether the verdict is UNIQUE.
    look_cpu_s, cpu_s, wall_s : float
        Processor time of the ranking by the first look; processor time and time of `Site.locate`.
    """

    in_best: bool
    right_map: bool
    right_place: bool
    unique: bool
    look_cpu_s: float
    cpu_s: float
    wall_s: float


@dataclass(frozen=True, slots=True)
class Asked:
    """Some scans, and what their process used.

    Parameters
    ----------
    answers : tuple of Answer
        Of each.
    open_cpu_s : float
        Processor time to open the prepared site, s.
    rss_mb : float or None
        Peak memory of the process, with the files that it has mapped and used.
    """

    answers: tuple[Answer, ...]
    open_cpu_s: float
    rss_mb: float | None


@dataclass(frozen=True, slots=True)
class PrepareTask:
    """Draw some floors and prepare their maps, as far as they are not in the folder.

    Parameters
    ----------
    folder : Path
        Gets the folders ``maps`` and ``prepared``.
    seeds : tuple of int
        Of the floors.
    """

    folder: Path
    seeds: tuple[int, ...]

    def __call__(self) -> Prepared:
        """Run in this process."""
        floors = [RandomFloor(seed) for seed in self.seeds]
        maps = self.folder / "maps"
        drawn = sum(not (maps / f"{floor_id(floor)}.yaml").exists() for floor in floors)
        write_site(maps, floors, lambda _: None)
        start = time.process_time()
        for floor in floors:
            _open(self.folder, (floor.seed,)).prepare_map(floor_id(floor))
        cpu_s = time.process_time() - start
        area_m2 = sum(floor.plan().outline.area_m2 for floor in floors)
        return Prepared(len(floors), area_m2, drawn, cpu_s)


@dataclass(frozen=True, slots=True)
class AskTask:
    """Ask a prepared site where some scans were taken.

    Parameters
    ----------
    folder : Path
        As for `PrepareTask`.
    seeds : tuple of int
        Of all floors of the site.
    scans : range
        Numbers of these scans.
    queries : int
        Number of scans of all tasks, spread evenly over the floors.
    """

    folder: Path
    seeds: tuple[int, ...]
    scans: range
    queries: int

    def __call__(self) -> Asked:
        """Run in this process."""
        site = _open(self.folder, self.seeds)
        start = time.process_time()
        for map_id in site.map_ids:
            _ = site.fields(map_id).look.spreads
        open_cpu_s = time.process_time() - start
        answers = tuple(_ask(site, *query) for query in self._queries())
        return Asked(answers, open_cpu_s, peak_rss_mb())

    def _queries(self) -> Iterator[tuple[str, LaserScan, SE2]]:
        """Yield the map, a scan in the true world among people, and the true pose."""
        places = np.linspace(0, len(self.seeds) - 1, self.queries).round().astype(int).tolist()
        for i in self.scans:
            floor = RandomFloor(self.seeds[places[i]])
            world = Floor(floor.world())
            rng = np.random.default_rng([floor.seed, i])
            poses = random_free_poses(floor.map(), rng, 50)
            pose = next((p for p in poses if world.room_at(p.x, p.y) > _ROOM_M), poses[0])
            people = People(world, rng)
            people.come(int(rng.poisson(_PEOPLE)), Manner.WALK, pose)
            fov, range_max = _SENSORS[i % len(_SENSORS)]
            lidar = Lidar(fov=math.radians(fov), range_max=range_max, dropout=0.02)
            yield floor_id(floor), sweep(lidar, world, pose, rng, circles=people.circles), pose


def site_tasks(
    folder: Path, seeds: Sequence[int], queries: int
) -> tuple[list[PrepareTask], list[AskTask]]:
    """Return what prepares a site, and what asks it after that.

    Parameters
    ----------
    folder : Path
        For the maps; what is there already is used.
    seeds : sequence of int
        Of the floors.
    queries : int
        Number of scans.
    """
    every = tuple(seeds)
    parts = [every[i : i + _FLOORS_A_TASK] for i in range(0, len(every), _FLOORS_A_TASK)]
    scans = range(queries)
    asked = [scans[i : i + _QUERIES_A_TASK] for i in range(0, queries, _QUERIES_A_TASK)]
    return (
        [PrepareTask(folder, part) for part in parts],
        [AskTask(folder, every, part, queries) for part in asked],
    )


def _open(folder: Path, seeds: Sequence[int]) -> Site:
    """Open the site of some floors of a folder."""
    wanted = {floor_id(RandomFloor(seed)) for seed in seeds}
    found = read_site(folder / "maps")
    chosen = replace(found, maps=tuple(entry for entry in found.maps if entry.id in wanted))
    return Site(chosen, folder / "prepared", _MAPPED_BYTES)


def _ask(site: Site, map_id: str, scan: LaserScan, truth: SE2) -> Answer:
    start = time.process_time()
    looked = site.first_look(site.query(scan), site.map_ids)
    look = time.process_time() - start
    ranked = [looked.map_ids[i] for i in np.argsort(looked.scores, kind="stable")]
    cpu, wall = time.process_time(), time.perf_counter()
    result = site.locate(scan)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    is_right = (
        result.best is not None
        and result.map_id == map_id
        and result.best.pose.distance_to(truth) < _RIGHT_M
        and abs((result.best.pose.inverse() @ truth).yaw) < _RIGHT_RAD
    )
    return Answer(
        in_best=map_id in ranked[:_BEST],
        right_map=result.map_id == map_id,
        right_place=is_right,
        unique=result.verdict is Verdict.UNIQUE,
        look_cpu_s=look,
        cpu_s=cpu,
        wall_s=wall,
    )


def site_document(prepared: Sequence[Prepared], asked: Sequence[Asked]) -> dict[str, Any]:
    """Put what was measured into the document described above."""
    answers = [answer for part in asked for answer in part.answers]
    columns = [asdict(answer) for answer in answers]
    area_m2 = sum(part.area_m2 for part in prepared)
    look_s, cpu_s, wall_s = (
        float(np.median([answer[name] for answer in columns]))
        for name in ("look_cpu_s", "cpu_s", "wall_s")
    )
    # The look grows with the area, at most; the pool that follows it does not.
    far_s = look_s * max(1.0, _GOAL_M2 / area_m2) + max(0.0, cpu_s - look_s)
    rss = [part.rss_mb for part in asked if part.rss_mb is not None]
    return {
        "suite": "site",
        "machine": this_machine(),
        "floors": sum(part.floors for part in prepared),
        "area_m2": area_m2,
        "queries": len(answers),
        **{
            name: float(np.mean([answer[field] for answer in columns]))
            for name, field in (
                ("right_map", "right_map"),
                ("right_place", "right_place"),
                ("unique", "unique"),
                ("first_look_best_20", "in_best"),
            )
        },
        "wrong_unique": sum(answer.unique and not answer.right_place for answer in answers),
        "look_cpu_s": look_s,
        "cpu_s": cpu_s,
        "cpu_s_max": max(answer.cpu_s for answer in answers),
        "wall_s": wall_s,
        "drawn": sum(part.drawn for part in prepared),
        "prepare_cpu_s": sum(part.cpu_s for part in prepared),
        "open_cpu_s": float(np.median([part.open_cpu_s for part in asked])),
        "rss_mb": max(rss) if rss else None,
        # Spread evenly over the cores: stated, not measured.
        "extrapolated": {
            "area_m2": _GOAL_M2,
            "cpu_s": far_s,
            "wall_s_16_cores": far_s / 16,
            "wall_s_64_cores": far_s / 64,
        },
    }


def site_table(document: dict[str, Any]) -> str:
    """Lay out the document in Markdown."""
    return columns_table([document], {}, COLUMNS)
