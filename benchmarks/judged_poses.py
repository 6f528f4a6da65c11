"""How well does the cost of a pose separate right from wrong? Cost of true and random poses.

For each case, scans evenly chosen: the cost of the true pose, of a random pose, and of the best
pose within a metre of the random one (where a filter that was kidnapped might settle); percentiles
5, 50, 97. Then the share of slips (0.58 m and 20 degrees off the truth) that the search nearby
undoes to 0.3 m, and processor times of judging a pose and of searching nearby, ms, median.

    python benchmarks/judged_poses.py ../shared/cases/*/ [--scans 60]
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map
from firstfix.lab.worlds.catalog import random_free_poses

SLIP = SE2(0.5, 0.3, np.radians(20.0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", help="folders with map.yaml, scans.npz")
    parser.add_argument("--scans", type=int, default=60)
    arguments = parser.parse_args()
    names = ("true", "random", "near random", "slips", "judge", "near")
    print(f"{'case':24s}" + "".join(f"{name:>18s}" for name in names))
    for folder in arguments.folders:
        print(f"{folder.name:24s}" + "".join(f"{cell:>18s}" for cell in judged(folder, arguments)))


def judged(folder: Path, arguments: argparse.Namespace) -> list[str]:
    recording, grid = load_recording(folder / "scans.npz"), load_map(folder / "map.yaml")
    if recording.truth is None:
        return ["no truth"]
    matcher, rng = ScanMatcher(grid), np.random.default_rng(0)
    chosen = np.linspace(0, len(recording) - 1, min(arguments.scans, len(recording))).astype(int)
    wrong = random_free_poses(grid, rng, len(chosen))
    costs: list[list[float]] = [[], [], []]
    slips, judging, searching = [], [], []
    for i, elsewhere in zip(chosen.tolist(), wrong, strict=True):
        scan, truth = recording.scans[i], SE2.from_array(recording.truth[i])
        began = time.process_time()
        costs[0].append(matcher.score_poses(scan, [truth])[0].score)
        judging.append(time.process_time() - began)
        costs[1].append(matcher.score_poses(scan, [elsewhere])[0].score)
        began = time.process_time()
        costs[2].append(matcher.search_locally(scan, elsewhere).score)
        searching.append(time.process_time() - began)
        slips.append(matcher.search_locally(scan, truth @ SLIP).pose.distance_to(truth) < 0.3)
    return [
        *(" ".join(f"{x:.2f}" for x in np.percentile(cost, [5, 50, 97])) for cost in costs),
        f"{np.mean(slips):.0%}",
        f"{1e3 * np.median(judging):.2f}",
        f"{1e3 * np.median(searching):.1f}",
    ]


if __name__ == "__main__":
    main()
