"""Time what is computed once per map: the fields of the search, and the cache of them.

Prints one line a measurement: the median over the runs (and the fastest run), in ms. The kernels
that they are made of are measured by `benchmarks/kernels`.

    python benchmarks/fields.py ../shared/cases/willow_a [--runs 9]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.fields.cache import content_key, load_or_build
from firstfix.fields.endpoint_field import build_endpoint_field
from firstfix.fields.map_fields import MapFields
from firstfix.fields.range_table import build_range_table
from firstfix.fields.search_grid import build_search_grid
from firstfix.io.maps.map_server import load_map

REACH_M = 25.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder with a map.yaml, or a map's YAML file")
    parser.add_argument("--runs", type=int, default=9)
    arguments = parser.parse_args()
    path = arguments.folder
    grid = load_map(path / "map.yaml" if path.is_dir() else path)
    print(f"{path}: {grid.width} x {grid.height} cells, {arguments.runs} runs, median (fastest)")
    time_search_fields(grid, arguments.runs)
    time_cache(grid, arguments.runs)


def time_search_fields(grid: OccupancyGrid, runs: int) -> None:
    fields = MapFields(grid)
    positions, resolution = fields.positions, grid.resolution
    show("positions of the search", runs, lambda: build_search_grid(grid))
    show(
        "end-point field",
        runs,
        lambda: build_endpoint_field(fields.squares, resolution, positions.stride, REACH_M),
    )
    show(
        "table of expected ranges",
        runs,
        lambda: build_range_table(grid.occupied, fields.clearance, resolution, positions),
    )
    show("all fields of a map", runs, lambda: prepared(grid))


def prepared(grid: OccupancyGrid) -> tuple[object, ...]:
    fields = MapFields(grid)
    return fields.endpoints, fields.ranges


def time_cache(grid: OccupancyGrid, runs: int) -> None:
    array = np.resize(grid.cells, 15_000_000)
    show("content key of the map", runs, lambda: content_key(grid.cells))
    with tempfile.TemporaryDirectory() as folder:
        show("load 15 MB", runs, lambda: load_or_build("key", lambda: array, Path(folder)))


def show(what: str, runs: int, function: Callable[[], object]) -> None:
    function()  # compiles, warms the memory
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        function()
        seconds.append(time.perf_counter() - start)
    print(f"{what:30} {np.median(seconds) * 1e3:8.2f} ms ({min(seconds) * 1e3:.2f})")


if __name__ == "__main__":
    main()
