"""Time one update of the dynamic stage, whole and in parts, on a drive.

Every update starts from the same belief around a true pose: odometry of 0.25 m, one scan, all
particles resampled. Prints processor time in ms, median over the runs (and the fastest run), the
sensor model in ns per particle and beam, next to a NumPy version with the same results; and the
memory of the largest filter over that of the process before.

    python benchmarks/amcl.py ../shared/cases/willow_track_00 [--runs 200]
"""

from __future__ import annotations

import argparse
import resource
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.beam_selection import SelectedBeams, select_beams
from firstfix.amcl.clusters import find_clusters
from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import start, step
from firstfix.amcl.initial import around_pose
from firstfix.amcl.kld import adapted_size
from firstfix.amcl.likelihood_field import LikelihoodField, likelihoods
from firstfix.amcl.motion import propagate
from firstfix.amcl.particles import Particles
from firstfix.amcl.resampling import systematic
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map

SIZES = ((500, 60), (2000, 60), (2000, 180), (5000, 60), (5000, 180), (100_000, 60))
INCREMENT = SE2(0.25, 0.0, 0.03)
SPREAD = np.diag([0.1**2, 0.1**2, np.radians(5.0) ** 2])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder with map.yaml and scans.npz")
    parser.add_argument("--runs", type=int, default=200)
    arguments = parser.parse_args()
    grid = load_map(arguments.folder / "map.yaml")
    recording = load_recording(arguments.folder / "scans.npz")
    middle = len(recording) // 2
    pose, scan = SE2.from_array(known_truth(recording)[middle]), recording.scans[middle]
    print(f"{arguments.folder}: {grid.width} x {grid.height} cells, {len(scan)} beams")
    for particles, beams in SIZES:
        runs = max(20, arguments.runs * 2000 // max(2000, particles))
        time_update(grid, pose, scan, particles, beams, runs)


def known_truth(recording: Recording) -> NDArray[np.float64]:
    if recording.truth is None:
        raise SystemExit("the scans need true poses")
    return recording.truth


def time_update(
    grid: OccupancyGrid, pose: SE2, scan: LaserScan, n: int, max_beams: int, runs: int
) -> None:
    config = AmclConfig(min_particles=n, max_particles=n, max_beams=max_beams)
    free = AmclConfig(min_particles=1, max_particles=n, max_beams=max_beams)
    rng = np.random.default_rng(0)
    before = peak_mb()
    sensor = LikelihoodField(grid, config)
    state = start(around_pose(pose, SPREAD, n, rng))
    belief = state.particles
    beams = select_beams(scan, config)
    print(f"\n{n} particles x {max_beams} beams, {len(beams.hits)} of them hit; {runs} runs")
    show("whole update", runs, lambda: step(state, INCREMENT, (scan,), sensor, rng, config, never))
    print(f"  memory over the process before: {peak_mb() - before:.0f} MB")
    show("propagate", runs, lambda: propagate(belief, INCREMENT, config, rng))
    show("choose beams", runs, lambda: select_beams(scan, config))
    kernel = show("likelihood field", runs, lambda: sensor.log_likelihood(belief, beams))
    print(f"  that is {kernel / (n * len(beams.hits)) * 1e6:.2f} ns per particle and beam")
    show("clusters", runs, lambda: find_clusters(belief, belief.weight))
    show("resample", runs, lambda: belief.drawn(systematic(belief.weight, n, rng)))
    show("number of particles", runs, lambda: adapted_size(belief, free, rng))
    twin = show("likelihood field, NumPy twin", 5, lambda: numpy_twin(belief, beams, sensor))
    print(f"  the twin takes {twin / kernel:.0f} times as long")
    off = np.abs(sensor.log_likelihood(belief, beams)[0] - numpy_twin(belief, beams, sensor))
    same = float(np.mean(off < 0.02 * len(beams.hits)))
    print(f"  and agrees for {same:.2%} of the particles (the kernel's end points are float32)")


def numpy_twin(
    particles: Particles, beams: SelectedBeams, sensor: LikelihoodField
) -> NDArray[np.float64]:
    grid = sensor.grid
    by_square = likelihoods(sensor.limit, grid.resolution, beams.range_max, sensor.config)
    logs = np.log(by_square)[sensor.squares]
    height, width = logs.shape
    total = np.zeros(len(particles))
    for x, y in beams.hits:
        cos, sin = np.cos(particles.yaw), np.sin(particles.yaw)
        ends = np.column_stack([particles.x + cos * x - sin * y, particles.y + sin * x + cos * y])
        cells = np.floor(grid.to_cells(ends)).astype(np.int64) + 1
        total += logs[np.clip(cells[:, 1], 0, height - 1), np.clip(cells[:, 0], 0, width - 1)]
    return total


def never(_: tuple[LaserScan, ...], n: int, __: np.random.Generator) -> NDArray[np.float64]:
    raise AssertionError(f"{n} particles asked for although recovery is off")


def show(what: str, runs: int, call: Callable[[], object]) -> float:
    call()
    times = []
    for _ in range(runs):
        began = time.process_time()
        call()
        times.append((time.process_time() - began) * 1e3)
    median = statistics.median(times)
    print(f"  {what:30s} {median:9.3f} ({min(times):.3f})")
    return median


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


if __name__ == "__main__":
    main()
