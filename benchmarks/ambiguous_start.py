"""Start the filter on all hypotheses of the static stage, drive 5 m, and count right poses.

Starts are scans of drives whose verdict is AMBIGUOUS and whose hypotheses contain the truth; with
--all those of any verdict. The filter begins on the hypotheses in proportion to their
probabilities, on all of them alike, at the truth, or all over free space (the same settings, Nav2's
defaults, and random numbers). A line has the number of starts, and of those that are within 0.5 m
and 10 degrees of the truth after 5 m.

    python benchmarks/ambiguous_start.py ../shared/cases/*/ [--all] [--every 5] [--reach 5]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.filter import start
from firstfix.amcl.initial import around_hypotheses, around_pose, over_free_space
from firstfix.amcl.particles import Particles
from firstfix.amcl.sensor import build_sensor
from firstfix.amcl.tracker import Track, Tracker
from firstfix.core.estimate import Hypothesis, Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map
from firstfix.lab.experiments.drive import Sight, plan_drive
from firstfix.lab.experiments.drive_tracking import TRUE_START
from firstfix.lab.metrics.outcome import is_found

WAY_M = 5.0
CONFIG = AmclConfig()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", help="folders with map.yaml, scans.npz")
    parser.add_argument("--all", action="store_true", help="starts of any verdict")
    parser.add_argument("--every", type=int, default=1, help="try every n-th scan as a start")
    parser.add_argument("--reach", type=float, default=np.inf, help="cut ranges to this, m")
    arguments = parser.parse_args()
    names = ("starts", "hypotheses", "alike", "truth", "free space")
    print(f"{'case':24s}" + "".join(f"{name:>12s}" for name in names))
    total = np.zeros(len(names), int)
    for folder in arguments.folders:
        recording = load_recording(folder / "scans.npz")
        if recording.odometry is None or recording.truth is None:
            continue
        counts = tried(folder, arguments)
        total += counts
        print(f"{folder.name:24s}" + "".join(f"{count:12d}" for count in counts), flush=True)
    print(f"{'total':24s}" + "".join(f"{count:12d}" for count in total))


def tried(folder: Path, arguments: argparse.Namespace) -> list[int]:
    grid = load_map(folder / "map.yaml")
    sights = plan_drive(load_recording(folder / "scans.npz"), None).sights
    sights = tuple(replace(s, scan=shortened(s.scan, arguments.reach)) for s in sights)
    matcher = ScanMatcher(grid)
    tracker = Tracker(build_sensor(grid, CONFIG), CONFIG, lambda _, n, __: np.empty((n, 3)))
    counts = [0, 0, 0, 0, 0]
    for i in range(0, len(sights), arguments.every):
        drive = next_metres(sights[i:])
        if not drive:
            continue
        result = matcher.locate(drive[0].scan)
        wanted = arguments.all or result.verdict is Verdict.AMBIGUOUS
        if not wanted or not any(
            is_found(place.pose, drive[0].truth) for place in result.hypotheses
        ):
            continue
        counts[0] += 1
        for k, belief in enumerate(beginnings(result.hypotheses, drive[0]), 1):
            counts[k] += won(tracker, drive, belief, i)
        rng = np.random.default_rng(i)
        counts[4] += won(tracker, drive, lambda _: over_free_space(grid, 2000, rng), i)  # noqa: B023
    return counts


def beginnings(
    hypotheses: tuple[Hypothesis, ...], first: Sight
) -> list[Callable[[np.random.Generator], Particles]]:
    alike = [replace(place, probability=1.0) for place in hypotheses]
    n = CONFIG.max_particles
    return [
        lambda rng: around_hypotheses(hypotheses, n, rng),
        lambda rng: around_hypotheses(alike, n, rng),
        lambda rng: around_pose(first.truth or SE2.identity(), TRUE_START, n, rng),
    ]


def won(
    tracker: Tracker,
    drive: tuple[Sight, ...],
    begin: Callable[[np.random.Generator], Particles],
    seed: int,
) -> bool:
    rng = np.random.default_rng(seed)
    # The first scan made the hypotheses: it is not counted again.
    track = Track(start(begin(rng)), drive[0].T_odom_base)
    for sight in drive[1:]:
        track = tracker.follow(track, sight.T_odom_base, sight.scan, rng)
    return is_found(track.T_map_odom @ drive[-1].T_odom_base, drive[-1].truth)


def next_metres(sights: tuple[Sight, ...]) -> tuple[Sight, ...]:
    """Return the sights of the next 5 m of one run; none if it ends before."""
    way, n = 0.0, 1
    while way < WAY_M:
        if n == len(sights) or not sights[n].same_run:
            return ()
        before, after = sights[n - 1].truth, sights[n].truth
        if before is None or after is None:
            return ()
        way, n = way + before.distance_to(after), n + 1
    return sights[:n]


def shortened(scan: LaserScan, reach: float) -> LaserScan:
    if reach >= scan.range_max:
        return scan
    ranges = np.where(scan.ranges >= reach, np.float32(np.inf), scan.ranges)
    return replace(scan, ranges=ranges, range_max=reach)


if __name__ == "__main__":
    main()
