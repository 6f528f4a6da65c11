"""Right and wrong priors in buildings with places that look alike.

    python benchmarks/priors.py --buildings office hotel floor-7 --scans 50

Each scan is located without a prior, with a right one of 10 m, with a wrong one of 3 m at a random
place, and with a wrong one at the place that fits best elsewhere. Printed is how often an answer is
not UNIQUE, and how often a UNIQUE answer is wrong.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from pathlib import Path

import numpy as np

from firstfix.belief.prior import Near
from firstfix.core.errors import InputError
from firstfix.core.estimate import LocateResult, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.io.maps.map_server import load_map
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import WORLDS, random_free_poses
from firstfix.lab.worlds.floors import RandomFloor
from firstfix.lab.worlds.many_offices import many_offices

RIGHT_M, WRONG_M = 10.0, 3.0
KINDS = ("none", "right", "wrong", "look-alike")


def building(name: str) -> tuple[OccupancyGrid, OccupancyGrid]:
    """Return a map and the world that it is the map of."""
    kind, _, seed = name.partition("-")
    if kind == "floor":  # of the same building, with other furniture
        floor = RandomFloor(int(seed), 800.0)
        return floor.map(), floor.world()
    if kind == "offices":
        grid = many_offices(3, np.random.default_rng(int(seed)))
    else:
        grid = load_map(Path(name)) if Path(name).exists() else WORLDS[name]()
    return grid, grid


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--buildings", nargs="+", default=["office", "offices-1"])
    parser.add_argument("--scans", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    lidar = Lidar(beams=180, fov=math.pi, range_max=6.0)
    print(f"{'building':24s}" + "".join(f"{kind:>22s}" for kind in KINDS))
    total: Counter[tuple[str, str]] = Counter()
    for name in arguments.buildings:
        rng = np.random.default_rng(arguments.seed)
        grid, world = building(name)
        matcher, counts = ScanMatcher(grid), Counter[tuple[str, str]]()
        for truth in random_free_poses(world, rng, arguments.scans, 0.4):
            counts.update(outcomes(matcher, lidar, truth, world, rng))
        total.update(counts)
        print(f"{name[-24:]:24s}" + row(counts, arguments.scans), flush=True)
    print(f"{'all':24s}" + row(total, arguments.scans * len(arguments.buildings)))


def outcomes(
    matcher: ScanMatcher, lidar: Lidar, truth: SE2, world: OccupancyGrid, rng: np.random.Generator
) -> list[tuple[str, str]]:
    grid = matcher.fields.grid
    scan = lidar.scan(world, truth, rng)
    off = rng.uniform(-0.5, 0.5, 2) * RIGHT_M
    priors = {"right": Near(SE2(truth.x + off[0], truth.y + off[1], 0.0), RIGHT_M)}
    elsewhere = [p for p in random_free_poses(grid, rng, 20, 0.4) if p.distance_to(truth) > 8.0]
    if elsewhere:
        priors["wrong"] = Near(elsewhere[0], WRONG_M)
    alone = matcher.locate(scan)
    rival = [h.pose for h in alone.hypotheses if h.pose.distance_to(truth) > 8.0]
    if rival:
        priors["look-alike"] = Near(rival[0], WRONG_M)
    found = [("none", outcome(alone, truth))]
    located = {kind: locate(matcher, scan, prior) for kind, prior in priors.items()}
    return found + [(kind, outcome(result, truth)) for kind, result in located.items() if result]


def locate(matcher: ScanMatcher, scan: LaserScan, prior: Near) -> LocateResult | None:
    """Return the answer; None for a prior whose centre is outside the map."""
    try:
        return matcher.locate(scan, prior=prior)
    except InputError:
        return None


def outcome(result: LocateResult, truth: SE2) -> str:
    if result.verdict is not Verdict.UNIQUE or result.best is None:
        return "open"
    return "right" if is_same_place(result.best.pose, truth) else "WRONG"


def row(counts: Counter[tuple[str, str]], scans: int) -> str:
    cells = [
        f"{counts[kind, 'right']} right {counts[kind, 'open']} open {counts[kind, 'WRONG']} wrong"
        for kind in KINDS
    ]
    return "".join(f"{cell:>26s}" for cell in cells) + f"  of {scans}"


if __name__ == "__main__":
    main()
