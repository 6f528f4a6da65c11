"""Time the straightening of scans, and print how much of the skew of motion it removes.

    python benchmarks/deskew.py [--runs 1000]

The goal is 0.2 ms a scan, and an error within 20 % of that at rest.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace
from itertools import product

import numpy as np

from firstfix.core.deskew import deskew, straighten
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.sweep import sweep
from firstfix.lab.worlds.catalog import random_free_pose
from firstfix.lab.worlds.office import office

PERIOD_S = 0.1
PLACES = 60


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=1000)
    runs = parser.parse_args().runs
    for beams in (360, 1081):
        print(f"{beams} beams: median {median_ms(beams, runs):.3f} ms of processor time")
    print("| m/s | °/s | at rest m | skewed m | straightened m |\n|---|---|---|---|---|")
    matcher = ScanMatcher(office())
    for speed, turn in product((0.5, 1.0, 2.0), (45.0, 90.0)):
        errors = " | ".join(f"{error:.4f}" for error in rms_errors(matcher, speed, turn))
        print(f"| {speed:g} | {turn:g} | {errors} |")


def median_ms(beams: int, runs: int) -> float:
    """Return the time of one scan."""
    stamps = np.arange(0.0, 60.0, 0.02)
    odometry = Trajectory(stamps, np.column_stack([stamps, 0.0 * stamps, 0.5 * stamps]))
    scan = LaserScan(np.full(beams, 3.0), -2.3, 4.6 / beams, 0.1, 30.0, stamp=30.001)
    scan = replace(scan, time_increment=0.05 / beams)
    times = []
    for _ in range(runs):
        began = time.process_time()
        deskew(scan, odometry)
        times.append(1e3 * (time.process_time() - began))
    return float(np.median(times))


def rms_errors(matcher: ScanMatcher, speed: float, turn_deg: float) -> list[float]:
    """Return the errors at rest, skewed and straightened, m, over the places that are UNIQUE."""
    lidar, grid = Lidar(sigma_m=0.01, T_base_laser=SE2(0.2, 0.0, 0.0)), matcher.fields.grid
    floor, drawn = Floor(grid), np.random.default_rng(0)
    full = SE2(speed * PERIOD_S, 0.0, math.radians(turn_deg) * PERIOD_S)
    last = (lidar.beams - 1) / lidar.beams
    motion = SE2(last * full.x, 0.0, last * full.yaw)
    errors = []
    for seed in range(PLACES):
        truth = random_free_pose(grid, drawn)
        at_rest = sweep(lidar, floor, truth, np.random.default_rng(seed))
        skewed = sweep(
            lidar, floor, truth, np.random.default_rng(seed), T_map_base_after=truth @ full
        )
        found = [
            matcher.locate(scan).best for scan in (at_rest, skewed, straighten(skewed, motion))
        ]
        if all(place is not None for place in found):
            errors.append([place.pose.distance_to(truth) for place in found if place is not None])
    near = np.array([row for row in errors if max(row) < 0.5])
    return [float(error) for error in np.sqrt(np.mean(near**2, axis=0))]


if __name__ == "__main__":
    main()
