"""Time what is computed for every scan: the steps of `locate`, whole, and the paper's search.

Prints one line a measurement: the median over the runs (and the fastest run), in ms of one core,
and where it is counted the rate in G/s: thousand millions of byte operations a second. One byte
operation is one beam at one pose, whatever it takes: an end point looked up and added, or a
measured range compared with the expected one. The rate of the whole search counts both kinds of
beams at every free position, but the work is done for whole tiles, so it is lower where tiles are
half empty. The kernels within are measured by `benchmarks/kernels`.

The scan is one of the case; for a map without scans one is simulated at a random place. Refinement
and verification start from the places that the search finds, as `locate` does.

    python benchmarks/search.py ../shared/cases/willow_a [--index 0] [--runs 15]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.fields.map_fields import MapFields
from firstfix.fields.range_table import DIRECTIONS
from firstfix.global_localization import exhaustive
from firstfix.global_localization import search as kernels
from firstfix.global_localization.beams import Beams, usable_beams
from firstfix.global_localization.config import LocateConfig
from firstfix.global_localization.locate import locate
from firstfix.global_localization.refine import refine_on_field, refine_on_rays
from firstfix.global_localization.verify import verify
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_pose

# As many places as `locate` refines on the field, and on rays.
SHORTLIST = LocateConfig().shortlist
ALL_POSES = LocateConfig().max_poses
ON_RAYS = 10


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="case, folder with a map.yaml, or a map's YAML")
    parser.add_argument("--index", type=int, default=0, help="which scan of the case")
    parser.add_argument("--runs", type=int, default=15)
    arguments = parser.parse_args()
    path = arguments.folder
    grid = load_map(path / "map.yaml" if path.is_dir() else path)
    scan = scan_of(path, grid, arguments.index)
    fields = MapFields(grid)
    beams = usable_beams(scan)
    print(
        f"{path}: {len(fields.positions)} positions in {len(fields.positions.tile_rows)} tiles, "
        f"{len(beams)} beams, {arguments.runs} runs, median (fastest)"
    )
    time_steps(beams, fields, arguments.runs)
    show("locate", arguments.runs, lambda: locate([scan], fields, LocateConfig()))
    time_paper(beams, fields, arguments.runs)


def scan_of(path: Path, grid: OccupancyGrid, index: int) -> LaserScan:
    if (path / "scans.npz").exists():
        return load_recording(path / "scans.npz").scans[index]
    rng = np.random.default_rng(index)
    return Lidar().scan(grid, random_free_pose(grid, rng), rng)


def time_steps(beams: Beams, fields: MapFields, runs: int) -> None:
    """Time the steps of `locate`, each with what it gets there."""
    queries = kernels._queries(beams, fields)
    beams_used = queries.offsets.shape[1] + len(queries.directions)
    terms = len(fields.positions) * DIRECTIONS * beams_used
    show(
        "search",
        runs,
        lambda: kernels.search(beams, fields, SHORTLIST, ALL_POSES),
        terms,
    )
    poses = kernels.search(beams, fields, SHORTLIST, ALL_POSES)[0].poses
    n = len(poses)
    show(f"refine_on_field, {n} poses", runs, lambda: refine_on_field(poses, beams, fields))
    refined = refine_on_field(poses, beams, fields)
    show(f"verify, {n} poses", runs, lambda: verify(refined, beams, fields))
    best = refined[np.argsort(verify(refined, beams, fields).scores)[:ON_RAYS]]
    show(f"refine_on_rays, {len(best)} poses", runs, lambda: refine_on_rays(best, beams, fields))


def time_paper(beams: Beams, fields: MapFields, runs: int) -> None:
    hits, grid = beams.hits(), exhaustive.FAST
    search = exhaustive.ExhaustiveSearch(fields, grid)
    tried, _ = search.pose_scores(hits)
    show(
        f"paper, {grid.stride} x {grid.stride} x {grid.headings}",
        runs,
        lambda: search.pose_scores(hits),
        len(tried) * grid.headings * len(hits),
    )


def show(what: str, runs: int, function: Callable[[], object], terms: int = 0) -> None:
    function()  # compiles, warms the memory
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        function()
        seconds.append(time.perf_counter() - start)
    middle = float(np.median(seconds))
    rate = f"{terms / middle * 1e-9:8.1f} G/s" if terms else ""
    print(f"{what:28} {middle * 1e3:8.2f} ms ({min(seconds) * 1e3:.2f}){rate}")


if __name__ == "__main__":
    main()
