"""Sites of random floors: which map and where, by one scan, and what it takes.

The JSON document::

    {"suite": "site", "machine": {...from `machine.this_machine`...}, "floors", "area_m2",
     "queries", "right_map", "right_place", "unique", "wrong_unique",
     "first_look_best_20", "look_cpu_s", "cpu_s", "cpu_s_max", "wall_s", "prepare_cpu_s", "rss_mb",
     "extrapolated": {"floors": 1000, "cpu_s", "wall_s_16_cores", "wall_s_64_cores"}}
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from firstfix.core.estimate import Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
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
_MOST_PEOPLE = 6
_ROOM_M = 0.3
_RIGHT_M, _RIGHT_RAD = 0.5, math.radians(10.0)
_BEST = 20
_GOAL_FLOORS = 1000

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
    ("prepare CPU s", "prepare_cpu_s", ".1f"),
    ("RSS MB", "rss_mb", ".0f"),
)


@dataclass(frozen=True, slots=True)
class SiteFigures:
    """What was measured on one site; see the document above."""

    floors: int
    area_m2: float
    queries: int
    right_map: float
    right_place: float
    unique: float
    wrong_unique: int
    first_look_best_20: float
    look_cpu_s: float
    cpu_s: float
    cpu_s_max: float
    wall_s: float
    prepare_cpu_s: float
    rss_mb: float | None


@dataclass(frozen=True, slots=True)
class SiteTask:
    """Write a site of random floors, prepare it, and ask where scans were taken.

    Parameters
    ----------
    seeds : tuple of int
        Of the floors.
    queries : int
        Number of scans, spread evenly over the floors.
    """

    seeds: tuple[int, ...]
    queries: int

    def __call__(self) -> SiteFigures:
        """Run in this process."""
        floors = [RandomFloor(seed) for seed in self.seeds]
        with tempfile.TemporaryDirectory(prefix="firstfix-site-") as folder:
            write_site(Path(folder) / "maps", floors, lambda _: None)
            site = Site.load(Path(folder) / "maps", Path(folder) / "prepared")
            start = time.process_time()
            site.prepare()
            prepare_s = time.process_time() - start
            answers = [_ask(site, *query) for query in _queries(floors, self.queries)]
        in_best, right_map, right, unique, look, cpu, wall = zip(*answers, strict=True)
        return SiteFigures(
            floors=len(floors),
            area_m2=sum(floor.plan().outline.area_m2 for floor in floors),
            queries=len(answers),
            right_map=float(np.mean(right_map)),
            right_place=float(np.mean(right)),
            unique=float(np.mean(unique)),
            wrong_unique=int(np.sum(np.array(unique) & ~np.array(right))),
            first_look_best_20=float(np.mean(in_best)),
            look_cpu_s=float(np.median(look)),
            cpu_s=float(np.median(cpu)),
            cpu_s_max=float(np.max(cpu)),
            wall_s=float(np.median(wall)),
            prepare_cpu_s=prepare_s,
            rss_mb=peak_rss_mb(),
        )


def _queries(floors: Sequence[RandomFloor], count: int) -> Iterator[tuple[str, LaserScan, SE2]]:
    """Yield the map, a scan in the true world among people, and the true pose."""
    for i, floor_index in enumerate(np.linspace(0, len(floors) - 1, count).round().astype(int)):
        floor = floors[floor_index]
        world = Floor(floor.world())
        rng = np.random.default_rng([floor.seed, i])
        poses = random_free_poses(floor.map(), rng, 50)
        pose = next((p for p in poses if world.room_at(p.x, p.y) > _ROOM_M), poses[0])
        people = People(world, rng)
        people.come(int(rng.integers(_MOST_PEOPLE + 1)), Manner.WALK, pose)
        fov, range_max = _SENSORS[i % len(_SENSORS)]
        lidar = Lidar(fov=math.radians(fov), range_max=range_max, dropout=0.02)
        yield floor_id(floor), sweep(lidar, world, pose, rng, circles=people.circles), pose


def _ask(
    site: Site, map_id: str, scan: LaserScan, truth: SE2
) -> tuple[bool, bool, bool, bool, float, float, float]:
    """Return whether the map is in the best, first, right, UNIQUE; s of look, CPU, wall."""
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
    unique = result.verdict is Verdict.UNIQUE
    in_best = map_id in ranked[:_BEST]
    return in_best, result.map_id == map_id, is_right, unique, look, cpu, wall


def site_document(figures: SiteFigures) -> dict[str, Any]:
    """Put the figures of a site into the document described above."""
    # The look grows with the floors, at most; the pool that follows it does not.
    after_s = max(0.0, figures.cpu_s - figures.look_cpu_s)
    cpu_s = figures.look_cpu_s * _GOAL_FLOORS / figures.floors + after_s
    return {
        "suite": "site",
        "machine": this_machine(),
        **asdict(figures),
        # Spread evenly over the cores: stated, not measured.
        "extrapolated": {
            "floors": _GOAL_FLOORS,
            "cpu_s": cpu_s,
            "wall_s_16_cores": cpu_s / 16,
            "wall_s_64_cores": cpu_s / 64,
        },
    }


def site_table(document: dict[str, Any]) -> str:
    """Lay out the document in Markdown."""
    return columns_table([document], {}, COLUMNS)
