"""Time what is computed once per map: distance transforms, fields of the search, rays, cache.

Prints one line a measurement: the median over the runs (and the fastest run), in ms; of the rays,
in ns each. Rays start at random free positions and go in 120 directions, up to 25 m.

    python benchmarks/fields.py ../shared/cases/willow_a [--runs 9]
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid
from firstfix.fields.cache import content_key, load_or_build
from firstfix.fields.clearance import chessboard_clearance
from firstfix.fields.distance import (
    euclidean_distance,
    manhattan_distance,
    truncated_squares,
)
from firstfix.fields.endpoint_field import build_endpoint_field
from firstfix.fields.map_fields import build_fields
from firstfix.fields.range_table import build_range_table
from firstfix.fields.raycast import cast_ray, cast_ray_leaping
from firstfix.fields.search_grid import build_search_grid
from firstfix.formats.map_server import load_map

POSITIONS = 5000
DIRECTIONS = 120
REACH_M = 25.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder with a map.yaml, or a map's YAML file")
    parser.add_argument("--runs", type=int, default=9)
    arguments = parser.parse_args()
    path = arguments.folder
    grid = load_map(path / "map.yaml" if path.is_dir() else path)
    print(f"{path}: {grid.width} x {grid.height} cells, {arguments.runs} runs, median (fastest)")
    time_transforms(grid, arguments.runs)
    time_search_fields(grid, arguments.runs)
    time_rays(grid, arguments.runs)
    time_cache(grid, arguments.runs)


def time_transforms(grid: OccupancyGrid, runs: int) -> None:
    occupied = grid.occupied
    show("manhattan distance", runs, lambda: manhattan_distance(occupied))
    show("euclidean distance", runs, lambda: euclidean_distance(occupied))
    show("truncated squares, 20 cells", runs, lambda: truncated_squares(occupied, 20))
    show("truncated squares, 63 cells", runs, lambda: truncated_squares(occupied, 63))
    show("chessboard clearance", runs, lambda: chessboard_clearance(occupied))


def time_search_fields(grid: OccupancyGrid, runs: int) -> None:
    fields = build_fields(grid, None)
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
        lambda: build_range_table(fields.clearance, resolution, positions),
    )
    show("all fields of a map", runs, lambda: build_fields(grid, None))


def time_rays(grid: OccupancyGrid, runs: int) -> None:
    rng = np.random.default_rng(0)
    free = np.argwhere(grid.free)
    starts = rng.choice(free, POSITIONS) + rng.random((POSITIONS, 2))
    lengths = {name: np.empty((POSITIONS, DIRECTIONS)) for name in ("walking", "leaping")}
    reach = REACH_M / grid.resolution
    clearance = chessboard_clearance(grid.occupied)
    rays = POSITIONS * DIRECTIONS
    show(
        "ray, walking", runs, lambda: _walk(grid.occupied, starts, reach, lengths["walking"]), rays
    )
    show("ray, leaping", runs, lambda: _leap(clearance, starts, reach, lengths["leaping"]), rays)
    if not np.array_equal(lengths["walking"], lengths["leaping"]):
        raise SystemExit("leaping and walking differ")


def time_cache(grid: OccupancyGrid, runs: int) -> None:
    arrays = {"field": np.resize(grid.cells, 15_000_000)}
    show("content key of the map", runs, lambda: content_key(grid.cells))
    with tempfile.TemporaryDirectory() as folder:
        show("load 15 MB", runs, lambda: load_or_build("key", lambda: arrays, Path(folder)))


def show(what: str, runs: int, function: Callable[[], object], rays: int = 0) -> None:
    function()  # compiles, warms the memory
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        function()
        seconds.append(time.perf_counter() - start)
    unit, scale = ("ns", 1e9 / rays) if rays else ("ms", 1e3)
    print(f"{what:30} {np.median(seconds) * scale:8.2f} {unit} ({min(seconds) * scale:.2f})")


@njit(cache=True)
def _walk(
    occupied: NDArray[np.bool_],
    starts: NDArray[np.float64],
    reach: float,
    lengths: NDArray[np.float64],
) -> None:
    for k in range(lengths.shape[0]):
        for i in range(lengths.shape[1]):
            heading = 2 * math.pi * i / lengths.shape[1]
            lengths[k, i] = cast_ray(occupied, starts[k, 1], starts[k, 0], heading, reach)


@njit(cache=True)
def _leap(
    clearance: NDArray[np.uint8],
    starts: NDArray[np.float64],
    reach: float,
    lengths: NDArray[np.float64],
) -> None:
    headings = 2 * math.pi * np.arange(lengths.shape[1]) / lengths.shape[1]
    dx, dy = np.cos(headings), np.sin(headings)
    for k in range(lengths.shape[0]):
        for i in range(lengths.shape[1]):
            lengths[k, i] = cast_ray_leaping(
                clearance, starts[k, 1], starts[k, 0], dx[i], dy[i], reach
            )


if __name__ == "__main__":
    main()
