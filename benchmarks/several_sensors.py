"""The localizer with a depth camera that turns, two lasers at 40 Hz, and scans that are skewed.

    python benchmarks/several_sensors.py turn --buildings office floor-40 hall --places 8
    python benchmarks/several_sensors.py turn --cases ../shared/cases/fr079
    python benchmarks/several_sensors.py rate
    python benchmarks/several_sensors.py skew

`turn`: how often a depth camera, 60 degrees x 5 m, is found within one turn in place, and how often
at a wrong place; with --cases, where the robot of a recorded drive turns 180 degrees within 3 m.
`rate`: processor time of two lasers of 270 degrees at 40 Hz, as a share of one
core, and the 99th percentile from scan to pose. `skew`: median error of the tracked pose.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from priors import building

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.global_localization.places import is_same_place
from firstfix.lab.experiments.case import Case, SensorCut, find_cases, truth_at
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.furniture import furnished
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.rigs import RIGS
from firstfix.lab.simulation.sweep import sweep
from firstfix.lab.worlds.catalog import random_free_poses, world_or_map
from firstfix.lab.worlds.drawing import Drawing
from firstfix.localizer.config import LocalizerConfig, ScansConfig
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, TrackedPose

HZ = 10.0
TURN_RAD_S = math.radians(45.0)
# Robots seldom turn in place: half a turn within this way.
REAL_TURN_RAD, REAL_WAY_M = math.radians(180.0), 3.0
# Wheels turn this much more than the robot.
ODOMETRY_TURN = 1.02


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("turn", "rate", "skew"))
    parser.add_argument("--buildings", nargs="+", default=["office"])
    parser.add_argument("--places", type=int, default=20)
    parser.add_argument("--cases", nargs="*", type=Path, default=[])
    arguments = parser.parse_args()
    if arguments.cases:
        for case in find_cases(arguments.cases):
            print(case.name, recorded_turns(case), flush=True)
        return
    for name in arguments.buildings:
        if arguments.what == "turn":
            grid, world = hall() if name == "hall" else building(name)
            print(name, turning(grid, world, arguments.places), flush=True)
            continue
        grid = world_or_map(name)
        if arguments.what == "rate":
            print(name, two_lasers(grid), flush=True)
        else:
            print(name, flush=True)
            skewed(grid)


def hall() -> tuple[OccupancyGrid, OccupancyGrid]:
    """Return the map of a hall, and the hall with three new boxes."""
    plan = Drawing(9.0, 7.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 9.0, 7.0)
    plan.solid(0.1, 5.0, 2.0, 6.9)
    plan.solid(6.0, 2.0, 6.5, 3.5)
    return plan.grid(), furnished(plan.grid(), 3, np.random.default_rng(0))


def turning(grid: OccupancyGrid, world: OccupancyGrid, places: int) -> str:
    """Turn a depth camera once in place."""
    rng, rig = np.random.default_rng(1), RIGS["depth-camera"]
    found = wrong = 0
    for truth in random_free_poses(world, rng, places, 0.4):
        localizer = Localizer()
        localizer.handle(NewMap(0.0, grid))
        for k in range(round(2.0 * math.pi / TURN_RAD_S * HZ) + 1):
            stamp, turned = k / HZ, TURN_RAD_S * k / HZ
            pose = truth @ SE2(0.0, 0.0, turned)
            localizer.handle(Odometry(stamp, SE2(0.0, 0.0, ODOMETRY_TURN * turned)))
            outputs = [
                o for scan in rig.scans(world, pose, rng, stamp) for o in localizer.handle(scan)
            ]
            first = next((o for o in outputs if isinstance(o, InitialPose)), None)
            if first is not None:
                is_right = is_same_place(first.T_map_base, pose)
                found, wrong = found + is_right, wrong + (not is_right)
                break
    return f"found {found}, wrong {wrong}, open {places - found - wrong} of {places}"


def recorded_turns(case: Case) -> str:
    """Let a depth camera start where the robot of a drive begins to turn."""
    recording, grid = case.seen_by(SensorCut(math.radians(60.0), 5.0)).recording(), case.grid()
    if recording.odometry is None:
        return "no odometry"
    ends: Counter[str] = Counter()
    for first, last in turns(recording, recording.odometry):
        localizer, end = Localizer(), "open"
        localizer.handle(NewMap(recording.scans[first].stamp, grid))
        for i in range(first, last + 1):
            scan = recording.scans[i]
            pose = recording.odometry.at(scan.stamp)
            before = [] if pose is None else localizer.handle(Odometry(scan.stamp, pose))
            outputs = before + localizer.handle(scan)
            found = next((o for o in outputs if isinstance(o, InitialPose)), None)
            truth = truth_at(recording, i)
            if found is not None and truth is not None:
                end = "right" if is_same_place(found.T_map_base, truth) else "wrong"
                break
        ends[end] += 1
    return f"found {ends['right']}, wrong {ends['wrong']}, open {ends['open']} of {ends.total()}"


def turns(recording: Recording, odometry: Trajectory) -> Iterator[tuple[int, int]]:
    """Yield the first and the last scan of each turn, one after another."""
    poses = [odometry.at(scan.stamp) for scan in recording.scans]
    first = 0
    while first < len(poses) - 1:
        turned = way = 0.0
        last = first
        while last + 1 < len(poses) and abs(turned) < REAL_TURN_RAD and way < REAL_WAY_M:
            a, b = poses[last], poses[last + 1]
            if a is None or b is None or not is_one_run(recording, first, last + 1):
                break
            turned, way = turned + (a.inverse() @ b).yaw, way + a.distance_to(b)
            last += 1
        if abs(turned) >= REAL_TURN_RAD:
            yield first, last
            first = last
        else:
            first += 1


def is_one_run(recording: Recording, a: int, b: int) -> bool:
    return recording.runs is None or bool(recording.runs[a] == recording.runs[b])


def two_lasers(grid: OccupancyGrid, seconds: float = 20.0) -> str:
    """Drive two lasers at 40 Hz, 5 ms apart."""
    rng, rig = np.random.default_rng(2), RIGS["two-lasers"]
    (start,) = random_free_poses(grid, rng, 1, 1.0)
    localizer = Localizer()
    localizer.handle(NewMap(0.0, grid))
    spent, poses = [], 0
    for k in range(round(seconds * 40.0)):
        stamp = k / 40.0
        pose = (
            start
            @ SE2(0.0, 0.0, 0.5 * math.sin(stamp))
            @ SE2(0.3 * math.sin(0.7 * stamp), 0.0, 0.0)
        )
        T_odom_base = start.inverse() @ pose
        scans = rig.scans(grid, pose, rng, stamp)
        given: list[LaserScan | Odometry] = [Odometry(stamp, T_odom_base), scans[0]]
        later = stamp + 0.005
        given += [Odometry(later, T_odom_base), replace(scans[1], stamp=later)]
        began = time.process_time()
        outputs = [output for each in given for output in localizer.handle(each)]
        spent.append(time.process_time() - began)
        poses += sum(isinstance(output, TrackedPose) for output in outputs)
    settled = np.array(spent[80:])
    share = settled.sum() / (len(settled) / 40.0)
    p99 = 1e3 * float(np.percentile(settled, 99))
    return f"{share:.1%} of a core, p99 {p99:.1f} ms, {poses} poses of {len(spent)} instants"


def skewed(grid: OccupancyGrid) -> None:
    """Track a robot whose laser turns ten times a second."""
    print("| m/s | °/s | unskewed m | straightened m | skewed m |\n|---|---|---|---|---|")
    for speed in (0.5, 1.0, 2.0):
        for turn in (45.0, 90.0):
            errors = [error(grid, speed, math.radians(turn), how) for how in ("none", "on", "off")]
            print(f"| {speed:g} | {turn:g} | " + " | ".join(f"{e:.4f}" for e in errors) + " |")


def error(grid: OccupancyGrid, speed: float, turn: float, how: str) -> float:
    """Return the median error of tracked poses on circles, m."""
    rng, floor = np.random.default_rng(3), Floor(grid)
    lidar = Lidar(beams=360, range_max=12.0)
    off: list[float] = []
    for start in random_free_poses(grid, rng, 6, 0.8):
        config = LocalizerConfig(scans=ScansConfig(deskew=how == "on"))
        localizer = Localizer(config)
        localizer.handle(NewMap(0.0, grid))
        # It goes back and forth on an arc, so that it stays in its room.
        for k in range(-20, 60):
            stamp = 10.0 + k / HZ
            at = [arc(start, speed, turn, stamp + part / HZ) for part in (0.0, 1.0)]
            for part in (0.0, 0.5, 1.0):
                now = arc(start, speed, turn, stamp + part / HZ)
                localizer.handle(Odometry(stamp + part / HZ, start.inverse() @ now))
            after = None if how == "none" else at[1]
            scan = sweep(lidar, floor, at[0], rng, stamp=stamp, T_map_base_after=after)
            scan = scan if how == "none" else timed(scan)
            poses = [o for o in localizer.handle(scan) if isinstance(o, TrackedPose)]
            off += [pose.T_map_base.distance_to(at[0]) for pose in poses if k > 0]
    return float(np.median(off)) if off else math.nan


def arc(start: SE2, speed: float, turn: float, stamp: float) -> SE2:
    """Return the pose of a robot that swings along an arc with about these velocities."""
    phase = math.sin(2.0 * math.pi * 0.5 * stamp) / (math.pi)
    return start @ SE2(speed * phase, 0.0, turn * phase)


def timed(scan: LaserScan) -> LaserScan:
    return replace(scan, time_increment=1.0 / HZ / len(scan))


if __name__ == "__main__":
    main()
