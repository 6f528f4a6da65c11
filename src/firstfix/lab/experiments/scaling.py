"""What a search costs: time and memory against area, beams and threads.

The JSON document::

    {"suite": "scaling", "seed", "machine": {...from `machine.this_machine`...},
     "area": [{"method", "cells", "map_area_m2", "free_area_m2", "beams", "scans", "success",
               "unique", "wrong_unique", "prepare_s", "cpu_s", "cpu_s_max", "rss_before_mb",
               "rss_mb"}, ...],
     "beams": [...the same keys...],
     "threads": [{"free_area_m2", "threads", "scans", "scans_per_s", "speedup",
                  "cpu_s_per_scan"}, ...]}
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from firstfix.core.estimate import LocateResult
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.experiments.locate_bench import try_scan
from firstfix.lab.experiments.machine import this_machine
from firstfix.lab.experiments.process_pool import peak_rss_mb
from firstfix.lab.metrics.metrics import summarize
from firstfix.lab.metrics.outcome import Answer
from firstfix.lab.reports.text import Row, columns_table
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.lab.worlds.many_offices import many_offices
from firstfix.localizer.precompile import precompile

# Title, key in the document, format.
COST_COLUMNS = (
    ("map m²", "map_area_m2", ".0f"),
    ("free m²", "free_area_m2", ".0f"),
    ("Mcells", "mcells", ".2f"),
    ("beams", "beams", ".0f"),
    ("scans", "scans", ".0f"),
    ("success", "success", ".0%"),
    ("unique", "unique", ".0%"),
    ("wrong", "wrong_unique", ".0f"),
    ("prepare s", "prepare_s", ".2f"),
    ("CPU s", "cpu_s", ".3f"),
    ("most CPU s", "cpu_s_max", ".3f"),
    ("RSS MB", "rss_mb", ".0f"),
    ("before MB", "rss_before_mb", ".0f"),
)
THREAD_COLUMNS = (
    ("free m²", "free_area_m2", ".0f"),
    ("threads", "threads", ".0f"),
    ("scans", "scans", ".0f"),
    ("scans a second", "scans_per_s", ".1f"),
    ("speed-up", "speedup", ".2f"),
    ("CPU s a scan", "cpu_s_per_scan", ".3f"),
)

# Offices of 42 x 27 m: 1 134 to 113 400 m².
OFFICES = (1, 3, 10, 32, 100)
BEAMS = (100, 200, 360, 720, 1000, 2000)
THREADS = (1, 2)

# Maps in which beams and threads are varied, in offices.
_VARIED = (1, 10)
_SCANS = 12
_USUAL_BEAMS = 360

# Of so many runs the fastest counts: what else a machine does only makes it slower.
_REPEATS = 7


@dataclass(frozen=True, eq=False, slots=True)
class Sighting:
    """A scan, and where it was taken.

    Parameters
    ----------
    scan : LaserScan
        The scan.
    truth : SE2
        ``T_map_base``.
    """

    scan: LaserScan
    truth: SE2


@dataclass(frozen=True, slots=True)
class Cost:
    """What locating costs in one map with one number of beams; see the document above."""

    method: str
    cells: int
    map_area_m2: float
    free_area_m2: float
    beams: int
    scans: int
    success: float | None
    unique: float | None
    wrong_unique: int
    prepare_s: float
    cpu_s: float | None
    cpu_s_max: float
    rss_before_mb: float | None
    rss_mb: float | None


@dataclass(frozen=True, slots=True)
class Throughput:
    """How many scans are located in a second by so many threads; see the document above."""

    free_area_m2: float
    threads: int
    scans: int
    scans_per_s: float
    speedup: float
    cpu_s_per_scan: float


@dataclass(frozen=True, eq=False, slots=True)
class CostTask:
    """Prepare a map and locate scans in it; all scans of a group have equally many beams."""

    grid: OccupancyGrid
    method: Method
    groups: tuple[tuple[Sighting, ...], ...]

    def __call__(self) -> tuple[Cost, ...]:
        """Run in this process, one group after another."""
        precompile(methods=[self.method])
        grid = _fresh(self.grid)
        before_mb = peak_rss_mb()
        start = time.process_time()
        matcher = ScanMatcher(grid, method=self.method, cache_dir=None)
        prepare_s = time.process_time() - start
        return tuple(self._cost(matcher, group, prepare_s, before_mb) for group in self.groups)

    def _cost(
        self,
        matcher: ScanMatcher,
        group: Sequence[Sighting],
        prepare_s: float,
        before_mb: float | None,
    ) -> Cost:
        # The first scan of a sensor may make a layout that the others share.
        matcher.locate(group[0].scan)
        outcomes = [
            try_scan(lambda scan: Answer.of(matcher.locate(scan)), sighting.scan, sighting.truth, i)
            for i, sighting in enumerate(group)
        ]
        figures = summarize(outcomes)
        return Cost(
            method=self.method.value,
            cells=self.grid.cells.size,
            map_area_m2=self.grid.cells.size * self.grid.resolution**2,
            free_area_m2=self.grid.free_area,
            beams=len(group[0].scan),
            scans=len(group),
            success=figures.success,
            unique=figures.unique,
            wrong_unique=figures.wrong_unique,
            prepare_s=prepare_s,
            cpu_s=figures.cpu_s,
            cpu_s_max=max(outcome.cpu_s for outcome in outcomes),
            rss_before_mb=before_mb,
            rss_mb=peak_rss_mb(),
        )


@dataclass(frozen=True, eq=False, slots=True)
class ThroughputTask:
    """Locate the same scans by one thread and by several, with one prepared map."""

    grid: OccupancyGrid
    sightings: tuple[Sighting, ...]
    threads: tuple[int, ...]

    def __call__(self) -> tuple[Throughput, ...]:
        """Run in this process; numbers of threads take turns, so that all see the same load."""
        precompile()
        matcher = ScanMatcher(_fresh(self.grid), cache_dir=None)
        scans = [sighting.scan for sighting in self.sightings]
        walls: dict[int, list[float]] = {n: [] for n in self.threads}
        cpus: dict[int, list[float]] = {n: [] for n in self.threads}
        for _ in range(_REPEATS):
            for n in self.threads:
                wall_s, cpu_s = _timed(matcher, scans, n)
                walls[n].append(wall_s)
                cpus[n].append(cpu_s)
        alone = min(walls[self.threads[0]])
        return tuple(
            Throughput(
                free_area_m2=self.grid.free_area,
                threads=n,
                scans=len(scans),
                scans_per_s=len(scans) / min(walls[n]),
                speedup=alone / min(walls[n]),
                cpu_s_per_scan=min(cpus[n]) / len(scans),
            )
            for n in self.threads
        )


def locate_in_threads(
    matcher: ScanMatcher, scans: Sequence[LaserScan], threads: int
) -> list[LocateResult]:
    """Locate scans by several threads that share one prepared map; results keep the order."""
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(matcher.locate, scans))


def scaling_tasks(
    seed: int, offices: Sequence[int] = OFFICES, beams: Sequence[int] = BEAMS
) -> list[tuple[str, CostTask | ThroughputTask]]:
    """List what to measure, each with the list of the document that its result belongs to.

    ``offices`` are the sizes of the maps; ``beams`` are varied in some of the maps.
    """
    tasks: list[tuple[str, CostTask | ThroughputTask]] = []
    for count in offices:
        rng = np.random.default_rng(seed)
        grid = many_offices(count, rng)
        usual = _sightings(grid, _USUAL_BEAMS, rng)
        methods = (Method.FAST, Method.PAPER)
        tasks += [("area", CostTask(grid, method, (usual,))) for method in methods]
        if count in _VARIED and beams:
            groups = tuple(_sightings(grid, n, rng) for n in beams)
            tasks += [("beams", CostTask(grid, method, groups)) for method in methods]
            tasks.append(("threads", ThroughputTask(grid, usual, THREADS)))
    return tasks


def scaling_document(
    measured: Sequence[tuple[str, Sequence[Cost | Throughput]]], seed: int
) -> dict[str, Any]:
    """Put the results of `scaling_tasks`, each with its list, into the document described above."""
    lists = {
        name: [asdict(row) for part, rows in measured if part == name for row in rows]
        for name in ("area", "beams", "threads")
    }
    return {"suite": "scaling", "seed": seed, **lists, "machine": this_machine()}


def cost_table(rows: Sequence[Row]) -> str:
    """Lay out rows of ``area`` or ``beams`` in Markdown."""
    shown = [{**row, "mcells": row["cells"] / 1e6} for row in rows]
    return columns_table(shown, {"method": "method"}, COST_COLUMNS)


def threads_table(rows: Sequence[Row]) -> str:
    """Lay out rows of ``threads`` in Markdown."""
    return columns_table(rows, {}, THREAD_COLUMNS)


def _sightings(grid: OccupancyGrid, beams: int, rng: np.random.Generator) -> tuple[Sighting, ...]:
    lidar = Lidar(beams=beams)
    poses = random_free_poses(grid, rng, _SCANS)
    return tuple(Sighting(lidar.scan(grid, pose, rng), pose) for pose in poses)


def _fresh(grid: OccupancyGrid) -> OccupancyGrid:
    # Arrays that came from another process are no longer read-only: another type for the kernels,
    # which would be compiled anew while the clock runs.
    return replace(grid)


def _timed(matcher: ScanMatcher, scans: Sequence[LaserScan], threads: int) -> tuple[float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    locate_in_threads(matcher, scans, threads)
    return time.perf_counter() - wall, time.process_time() - cpu
