"""``firstfix bench --suite scaling``: time and memory against area, beams and threads."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from firstfix.cli.progress import progress
from firstfix.cli.targets import check_targets, write_json

if TYPE_CHECKING:
    import numpy as np

    from firstfix.core.grid import OccupancyGrid
    from firstfix.lab.experiments.scaling import Cost, Sighting, Throughput

# Offices of 42 x 27 m: 1 134 to 113 400 m².
OFFICES = (1, 3, 10, 32, 100)
BEAMS = (100, 200, 360, 720, 1000, 2000)
THREADS = (1, 2)

# Maps whose beams and threads are varied.
_VARIED = (1, 10)
_SCANS = 12
_USUAL_BEAMS = 360


def bench_scaling(
    *,
    seed: int,
    json_file: Path | None,
    report: Path | None,
    offices: tuple[int, ...] = OFFICES,
    beams: tuple[int, ...] = BEAMS,
) -> None:
    """Locate simulated scans in ever larger maps, with ever more beams, by one thread and two.

    Parameters
    ----------
    seed : int
        Of furniture, places and noise.
    json_file : Path or None
        Where all figures go.
    report : Path or None
        Folder of a report.
    offices : tuple of int
        Sizes of the maps, in offices.
    beams : tuple of int
        Numbers of beams that are tried in the smaller maps.
    """
    check_targets(json_file, report)
    from firstfix.lab.experiments.machine import this_machine
    from firstfix.lab.experiments.scaling import cost_table, scaling_document, threads_table

    by_area: list[Cost] = []
    by_beams: list[Cost] = []
    by_threads: list[Throughput] = []
    with progress(len(offices), "bench") as done:
        for count in offices:
            _measure(count, seed, beams if count in _VARIED else (), by_area, by_beams, by_threads)
            done(f"{count} office(s)")
    document = scaling_document(by_area, by_beams, by_threads, seed) | {"machine": this_machine()}
    typer.echo(cost_table(document["area"]))
    typer.echo(cost_table(document["beams"]))
    typer.echo(threads_table(document["threads"]), nl=False)
    if json_file is not None:
        write_json(document, json_file)
    if report is not None:
        from firstfix.lab.reports.suite_reports import write_scaling_report

        typer.echo(f"report: {write_scaling_report(document, report)}", err=True)


def _measure(
    count: int,
    seed: int,
    beams: tuple[int, ...],
    by_area: list[Cost],
    by_beams: list[Cost],
    by_threads: list[Throughput],
) -> None:
    """Measure one map; each task in a new process, so that memory is its own."""
    import numpy as np

    from firstfix.global_localization.config import Method
    from firstfix.lab.experiments.process_pool import run_in_processes
    from firstfix.lab.experiments.scaling import CostTask, ThroughputTask
    from firstfix.lab.worlds.many_offices import many_offices

    rng = np.random.default_rng(seed)
    grid = many_offices(count, rng)
    usual = _sightings(grid, _USUAL_BEAMS, rng)
    for method in (Method.FAST, Method.PAPER):
        (costs,) = run_in_processes([CostTask(grid, method, (usual,))], 1, lambda *_: None)
        by_area += costs
    if not beams:
        return
    groups = tuple(_sightings(grid, n, rng) for n in beams)
    for method in (Method.FAST, Method.PAPER):
        (costs,) = run_in_processes([CostTask(grid, method, groups)], 1, lambda *_: None)
        by_beams += costs
    (throughputs,) = run_in_processes([ThroughputTask(grid, usual, THREADS)], 1, lambda *_: None)
    by_threads += throughputs


def _sightings(grid: OccupancyGrid, beams: int, rng: np.random.Generator) -> tuple[Sighting, ...]:
    from firstfix.lab.experiments.scaling import Sighting
    from firstfix.lab.simulation.lidar import Lidar
    from firstfix.lab.worlds.catalog import random_free_poses

    lidar = Lidar(beams=beams)
    poses = random_free_poses(grid, rng, _SCANS)
    return tuple(Sighting(lidar.scan(grid, pose, rng), pose) for pose in poses)
