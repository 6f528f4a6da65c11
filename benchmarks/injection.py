"""Where should new particles come from after a loss? Recovery from kidnaps on drives.

Each drive is tracked for 15 s. Then the robot is teleported to the pose of the drive 20 s later and
tracked to the end, at most 30 s. Recovery is on (recovery_alpha_slow 0.001,
recovery_alpha_fast 0.1). Injected are poses from free space (as AMCL does), or of the static
stage's hypotheses for the scan. A line has, for each and for no injection at all: the share of
drives that end within 0.5 m and 10 degrees of the truth, and the median time until they are, for
good, s.

    python benchmarks/injection.py ../shared/cases/*_track_* [--seeds 5]
"""

from __future__ import annotations

import argparse
import statistics
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import Injection
from firstfix.amcl.initial import around_pose, free_poses, hypothesis_poses
from firstfix.amcl.sensor import Sensor, build_sensor
from firstfix.amcl.tracker import Tracker
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map
from firstfix.lab.experiments.drive import Sight, plan_drive
from firstfix.lab.experiments.drive_tracking import TRUE_START
from firstfix.lab.metrics.outcome import is_found

OFF = AmclConfig()
ON = AmclConfig(recovery_alpha_slow=0.001, recovery_alpha_fast=0.1)
BEFORE_S, CARRIED_S, AFTER_S = 15.0, 20.0, 30.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", help="folders with map.yaml, scans.npz")
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    print(f"{'case':20s}{'none':>16s}{'free space':>16s}{'hypotheses':>16s}")
    for folder in arguments.folders:
        recording = load_recording(folder / "scans.npz")
        grid = load_map(folder / "map.yaml")
        matcher, sensor = ScanMatcher(grid), build_sensor(grid, OFF)

        def anywhere(
            _: tuple[LaserScan, ...], n: int, rng: np.random.Generator, grid: OccupancyGrid = grid
        ) -> NDArray[np.float64]:
            return free_poses(grid, n, rng)

        def likely(
            scans: tuple[LaserScan, ...],
            n: int,
            rng: np.random.Generator,
            matcher: ScanMatcher = matcher,
        ) -> NDArray[np.float64]:
            return hypothesis_poses(matcher.locate(scans).hypotheses, n, rng)

        sights = plan_drive(recording, None).sights
        cells = []
        for config, inject in ((OFF, anywhere), (ON, anywhere), (ON, likely)):
            times = [
                time_to_recover(sights, sensor, config, inject, seed)
                for seed in range(arguments.seeds)
            ]
            found = [seconds for seconds in times if seconds is not None]
            middle = f"{statistics.median(found):.1f}" if found else "-"
            cells.append(f"{len(found)}/{len(times)} {middle}")
        print(f"{folder.name:20s}" + "".join(f"{cell:>16s}" for cell in cells), flush=True)


def time_to_recover(
    sights: tuple[Sight, ...], sensor: Sensor, config: AmclConfig, inject: Injection, seed: int
) -> float | None:
    rng = np.random.default_rng(seed)
    tracker = Tracker(sensor, config, inject)
    first = sights[0]
    belief = around_pose(first.truth or SE2.identity(), TRUE_START, config.max_particles, rng)
    track = tracker.begin(belief, first.T_odom_base, first.scan, rng)
    began = first.scan.stamp
    before = [sight for sight in sights[1:] if sight.scan.stamp < began + BEFORE_S]
    landed = began + BEFORE_S + CARRIED_S
    after = [sight for sight in sights if landed <= sight.scan.stamp < landed + AFTER_S]
    for sight in before:
        track = tracker.follow(track, sight.T_odom_base, sight.scan, rng)
    # Odometry has not noticed: it goes on from where it was.
    carried = before[-1].T_odom_base @ after[0].T_odom_base.inverse()
    since = None
    for sight in after:
        T_odom_base = carried @ sight.T_odom_base
        track = tracker.follow(track, T_odom_base, sight.scan, rng)
        if not is_found(track.T_map_odom @ T_odom_base, sight.truth):
            since = None
        elif since is None:
            since = sight.scan.stamp - landed
    return since


if __name__ == "__main__":
    main()
