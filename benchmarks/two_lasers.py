"""Two lasers, 270 degrees x 8 m at opposite corners, against the better one alone among people.

    python benchmarks/two_lasers.py --buildings floor-20 floor-21 --places 40
    python benchmarks/two_lasers.py --cases CASE... --places 40

People hide 30 % of the beams: circles of 0.2 m around a simulated robot; in a recorded scan of
360 degrees, which is cut in two, blocks of beams that end short. The better laser is the one with
more right answers in the building, which favours it.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from priors import building

from firstfix.core.estimate import LocateResult, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.experiments.case import find_cases, known_truth
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.rigs import RIGS
from firstfix.lab.worlds.catalog import random_free_poses

HIDDEN, FOV, RANGE_M = 0.3, math.radians(270.0), 8.0
PERSON_M, NEAREST_M, FARTHEST_M = 0.2, 0.5, 4.0
FRONT, REAR = math.radians(45.0), math.radians(-135.0)

Instant = tuple[tuple[LaserScan, LaserScan], SE2]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--buildings", nargs="*", default=[])
    parser.add_argument("--cases", nargs="*", type=Path, default=[])
    parser.add_argument("--places", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    total: Counter[str] = Counter()
    print("| building | n | both UNIQUE and right, wrong | better one |\n|---|---|---|---|")
    for name in [*given.buildings, *given.cases]:
        rng = np.random.default_rng(given.seed)
        if isinstance(name, Path):
            matcher, instants = cut_in_two(name, given.places, rng)
        else:
            grid, world = building(name)
            matcher, instants = ScanMatcher(grid), simulated(world, given.places, rng)
        counts = compared(matcher, instants)
        total.update(counts)
        print(row(getattr(name, "name", name), counts), flush=True)
    print(row("all", total))


def simulated(world: OccupancyGrid, places: int, rng: np.random.Generator) -> Iterator[Instant]:
    """Stand among people, at random places."""
    rig, floor = RIGS["two-lasers"], Floor(world)
    for pose in random_free_poses(world, rng, places, 0.4):
        circles = people(floor, pose, rng)
        front, rear = rig.sweeps(floor, pose, pose, rng, circles=circles)
        yield (front, rear), pose


def people(floor: Floor, pose: SE2, rng: np.random.Generator) -> NDArray[np.float64]:
    """Place people around until they hide their share of all directions."""
    hidden, circles = np.zeros(720, np.bool_), []
    directions = np.linspace(-math.pi, math.pi, 720, endpoint=False)
    while hidden.mean() < HIDDEN:
        away, bearing = rng.uniform(NEAREST_M, FARTHEST_M), rng.uniform(-math.pi, math.pi)
        x, y = pose.apply(away * np.array([math.cos(bearing), math.sin(bearing)])).tolist()
        if floor.has_room((pose.x, pose.y), (x, y), 0.05):
            circles.append((x, y, PERSON_M))
            off = np.abs(np.remainder(directions - bearing + math.pi, 2.0 * math.pi) - math.pi)
            hidden |= off <= math.asin(PERSON_M / away)
        elif len(circles) == 0 and rng.random() < 0.01:
            break  # a niche without room for anybody
    return np.array(circles).reshape(-1, 3)


def cut_in_two(
    case: Path, places: int, rng: np.random.Generator
) -> tuple[ScanMatcher, Iterator[Instant]]:
    """Cut recorded scans of 360 degrees into those of two lasers, with people."""
    (known,) = find_cases([case])
    recording = known.recording()
    truth = known_truth(known, recording)
    index = rng.choice(len(recording), min(places, len(recording)), replace=False)

    def instants() -> Iterator[Instant]:
        for i in sorted(index.tolist()):
            scan = with_people(recording.scans[i], rng)
            yield (cut(scan, FRONT), cut(scan, REAR)), SE2.from_array(truth[i])

    return ScanMatcher(known.grid()), instants()


def with_people(scan: LaserScan, rng: np.random.Generator) -> LaserScan:
    ranges, short = scan.ranges.copy(), np.zeros(len(scan), np.bool_)
    while short.mean() < HIDDEN:
        away, bearing = rng.uniform(NEAREST_M, FARTHEST_M), rng.uniform(-math.pi, math.pi)
        off = np.abs(np.remainder(scan.bearings - bearing + math.pi, 2.0 * math.pi) - math.pi)
        block = off <= math.asin(PERSON_M / away)
        ranges[block & ~(ranges < away)] = away
        short |= block
    return replace(scan, ranges=ranges)


def cut(scan: LaserScan, middle: float) -> LaserScan:
    off = np.abs(np.remainder(scan.bearings - middle + math.pi, 2.0 * math.pi) - math.pi)
    ranges = np.where(scan.ranges > RANGE_M, np.inf, scan.ranges)
    ranges = np.where(off > FOV / 2.0, np.nan, ranges).astype(np.float32)
    return replace(scan, ranges=ranges, range_max=RANGE_M, sensor=f"{middle:.1f}")


def compared(matcher: ScanMatcher, instants: Iterator[Instant]) -> Counter[str]:
    counts: Counter[str] = Counter()
    for (front, rear), truth in instants:
        counts["n"] += 1
        for who, scans in (("both", [front, rear]), ("front", front), ("rear", rear)):
            counts.update(outcome(who, matcher.locate(scans), truth))
    better = max(("front", "rear"), key=lambda who: counts[f"{who} right"])
    for word in ("right", "wrong"):
        counts[f"better {word}"] = counts[f"{better} {word}"]
    return counts


def outcome(who: str, result: LocateResult, truth: SE2) -> list[str]:
    best = result.best
    if best is None or result.verdict is not Verdict.UNIQUE:
        return []
    return [f"{who} {'right' if is_same_place(best.pose, truth) else 'wrong'}"]


def row(name: str, counts: Counter[str]) -> str:
    n = max(1, counts["n"])
    cells = [
        f"{counts[f'{who} right'] / n:.0%}, {counts[f'{who} wrong']}" for who in ("both", "better")
    ]
    return f"| {name} | {counts['n']} | " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
