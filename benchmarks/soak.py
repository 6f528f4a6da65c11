"""Run the whole system for half an hour while faults of every kind occur.

A real roscore; a simulated robot in a process of its own, which drives about in a built-in
building; the node with its live page, as users start it; a viewer of the page; and an observer that
records what the node publishes. A seeded script adds people, drops, holds and delays scans and
odometry, sets clocks, kidnaps the robot and suspends the node; it also kills and restarts each of
the processes, or all of them. In the first half the node is not killed, so that growth of its
memory is visible. Afterwards each published pose is compared with the ground truth, see
`soak_judged`.

    python benchmarks/soak.py [--minutes 30] [--seed 1] [--world office] [--mode full]
        [--report benchmarks/reports/DATE/soak]

Needs the Python that has rospy, roscore in the PATH, and the package websockets.
"""

from __future__ import annotations

import argparse
import contextlib
import heapq
import itertools
import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "robots"))

from ros1_lab import why_missing
from soak_judged import judge
from soak_report import write_report
from soak_system import System, whole_lines

from firstfix.lab.experiments.machine import this_machine
from firstfix.lab.worlds.catalog import WORLDS

SENSORS = ["scan", "/tf"]
HOUR_S = 3600.0
# Includes compilation.
PATIENCE_S = 300.0
# Time from the end of a fault to the next one: mostly calm, sometimes none.
CALM_S, CALM_AFTER_A_KILL_S, HASTE_S, HASTE = (6.0, 10.0), (10.0, 15.0), 0.3, 0.15
# The node is not killed during this share of the time, so its memory can be judged.
FIRST_LIFE = 0.5
_TICK_S = 0.05


class Soak:
    """The script: what happens when."""

    def __init__(self, system: System, seed: int) -> None:
        self._system = system
        self._rng = np.random.default_rng(seed)
        self._due: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = itertools.count()
        self._lives: dict[str, int] = {}
        self.faults: list[dict[str, Any]] = []
        self.samples: list[dict[str, Any]] = []
        self.deaths: list[dict[str, Any]] = []
        self.began = self.ended = 0.0

    def run(self, minutes: float) -> None:
        """Run the script against the system."""
        self._begin()
        self.began, end = time.time(), time.time() + 60.0 * minutes
        script = self._script(end)
        next_fault, next_sample = self.began + 5.0, self.began
        while (now := time.time()) < end:
            while self._due and self._due[0][0] <= now:
                heapq.heappop(self._due)[2]()
            if now >= next_sample:
                next_sample = now + 1.0
                self._sample(now)
            if now >= next_fault and end - now > 20.0:
                next_fault = self._inject(next(script))
            time.sleep(_TICK_S)
        while self._due:
            heapq.heappop(self._due)[2]()
        self.ended = time.time()

    def _begin(self) -> None:
        self._system.core.start()
        for start in ("observer", "robot", "node", "viewer"):
            getattr(self._system, f"start_{start}")()
        deadline = time.monotonic() + PATIENCE_S
        while not any(line["topic"] != "localization_status" for line in self._heard()):
            if time.monotonic() > deadline:
                sys.exit(f"the robot was not found: {dict(self._system.logs())}")
            time.sleep(1.0)

    def _heard(self) -> list[dict[str, Any]]:
        return whole_lines(self._system.said)

    def _script(self, end: float) -> Iterator[Callable[[], tuple[str, float]]]:
        """Yield every fault equally often, in another order each time."""
        quiet_until = self.began + FIRST_LIFE * (end - self.began)
        while True:
            for i in self._rng.permutation(len(HAPPENINGS)):
                happening = HAPPENINGS[i]
                if time.time() > quiet_until or happening not in KILLS_NODE:
                    yield partial(happening, self)

    def _inject(self, happening: Callable[[], tuple[str, float]]) -> float:
        """Cause a fault; return the time of the next one."""
        begin = time.time()
        kind, seconds = happening()
        self.faults.append({"kind": kind, "begin": begin, "end": begin + seconds})
        print(f"{begin - self.began:7.1f} s  {kind}, {seconds:.1f} s", flush=True)
        calm = self._rng.uniform(*(CALM_AFTER_A_KILL_S if "kill" in kind else CALM_S))
        return begin + seconds + (HASTE_S if self._rng.random() < HASTE else calm)

    def _sample(self, now: float) -> None:
        for name, part in list(self._system.parts.items()):
            if not part.is_running:
                self.deaths.append({"who": name, "at": now, "said": part.output[-2000:]})
                self._system.parts.pop(name).end()
                getattr(self._system, f"start_{name}")()
                print(f"{now - self.began:7.1f} s  {name} DIED BY ITSELF", flush=True)
            elif (figures := part.figures()) is not None:
                self.samples.append({"who": name, "at": now, "pid": part.pid, **figures})

    def _later(self, seconds: float, act: Callable[[], None]) -> None:
        heapq.heappush(self._due, (time.time() + seconds, next(self._numbers), act))

    def _between(self, least: float, most: float) -> float:
        return float(self._rng.uniform(least, most))

    # ---- faults: each returns its name and duration

    def people_walk(self) -> tuple[str, float]:
        """Replace the people by some who walk."""
        self._system.command(do="people", count=int(self._rng.integers(3, 10)), manner="walk")
        return "people walk", 0.0

    def people_crowd(self) -> tuple[str, float]:
        """Surround the robot by people who move with it."""
        self._system.command(do="people", count=int(self._rng.integers(2, 6)), manner="surround")
        seconds = self._between(4.0, 10.0)
        self._later(seconds, lambda: self._system.command(do="people", count=2, manner="walk"))
        return "a crowd", seconds

    def scans_dropped(self) -> tuple[str, float]:
        """Drop all scans."""
        return "scans dropped", self._wire("drop", ["scan"], self._between(1.0, 6.0))

    def odometry_dropped(self) -> tuple[str, float]:
        """Drop all odometry."""
        return "odometry dropped", self._wire("drop", ["/tf"], self._between(1.0, 6.0))

    def silence(self) -> tuple[str, float]:
        """Drop all messages of the robot."""
        return "all dropped", self._wire("drop", SENSORS, self._between(1.0, 6.0))

    def burst(self) -> tuple[str, float]:
        """Hold scans and odometry for a second, then deliver them at once."""
        return "burst of all", self._wire("hold", SENSORS, self._between(0.8, 2.0))

    def burst_of_scans(self) -> tuple[str, float]:
        """Hold scans for a second, then deliver them at once."""
        return "burst of scans", self._wire("hold", ["scan"], self._between(0.8, 2.0))

    def odometry_late(self) -> tuple[str, float]:
        """Delay odometry behind its scans."""
        delay_s = self._between(0.1, 0.8)
        return "odometry late", self._wire("late", ["/tf"], self._between(3.0, 6.0), delay_s)

    def scans_late(self) -> tuple[str, float]:
        """Delay scans behind their odometry."""
        delay_s = self._between(0.1, 0.8)
        return "scans late", self._wire("late", ["scan"], self._between(3.0, 6.0), delay_s)

    def _wire(self, kind: str, topics: list[str], seconds: float, delay_s: float = 0.0) -> float:
        trouble = {"kind": kind, "topics": topics, "seconds": seconds, "delay_s": delay_s}
        self._system.command(do="wire", **trouble)
        return seconds + delay_s

    def clock_ahead(self) -> tuple[str, float]:
        """Set the clock of the robot forward."""
        by = self._rng.choice([self._between(0.1, 2.0), self._between(2.0, 60.0), HOUR_S])
        self._system.command(do="clock", by=float(by))
        return "clock ahead", 0.0

    def clock_back(self) -> tuple[str, float]:
        """Set the clock of the robot back."""
        by = self._rng.choice([self._between(0.1, 2.0), self._between(2.0, 60.0), HOUR_S])
        self._system.command(do="clock", by=-float(by))
        return "clock back", 0.0

    def kidnap(self) -> tuple[str, float]:
        """Teleport the robot; no sensor reports it."""
        self._system.command(do="teleport")
        return "silent kidnap", 0.0

    def carry(self) -> tuple[str, float]:
        """Carry the robot elsewhere; the wheel drop reports it."""
        seconds = self._between(2.0, 5.0)
        self._system.command(do="carry", seconds=seconds)
        return "carried off", seconds

    def push(self) -> tuple[str, float]:
        """Push the robot; odometry does not measure it."""
        degrees = self._between(-40.0, 40.0)
        self._system.command(do="push", metres=self._between(0.2, 0.8), degrees=degrees)
        return "pushed", 0.5

    def wrong_hint(self) -> tuple[str, float]:
        """Publish a wrong hint."""
        self._system.command(do="hint")
        return "wrong hint", 0.0

    def freeze(self) -> tuple[str, float]:
        """Suspend the node for a while."""
        node, seconds = self._system.parts["node"], self._between(1.0, 4.0)
        node.send(signal.SIGSTOP)
        self._later(seconds, lambda: node.send(signal.SIGCONT))
        return "node frozen", seconds

    def kill_node(self) -> tuple[str, float]:
        """Kill and restart the node."""
        return "kill node", self._kill("node", self._system.start_node)

    def kill_node_and_kidnap(self) -> tuple[str, float]:
        """Carry the robot elsewhere while the node is not running."""
        seconds = self._kill("node", self._system.start_node)
        self._system.command(do="teleport")
        return "kill node, kidnap meanwhile", seconds

    def kill_node_and_file(self) -> tuple[str, float]:
        """Kill the node, and damage its saved pose."""
        seconds = self._kill("node", self._system.start_node)
        if self._system.saved_pose.is_file():
            size = self._system.saved_pose.stat().st_size
            os.truncate(self._system.saved_pose, int(self._rng.integers(0, size)))
        return "kill node, saved pose cut", seconds

    def kill_robot(self) -> tuple[str, float]:
        """Restart the robot's computer; odometry starts at zero."""
        return "kill robot", self._kill("robot", self._restart_robot)

    def kill_robot_and_carry(self) -> tuple[str, float]:
        """Carry the robot elsewhere while its computer restarts."""
        return "kill robot, kidnap meanwhile", self._kill("robot", self._restart_robot_elsewhere)

    def kill_viewer(self) -> tuple[str, float]:
        """Kill the viewer."""
        return "kill viewer", self._kill("viewer", self._system.start_viewer)

    def kill_roscore(self) -> tuple[str, float]:
        """Kill and restart the ROS master."""
        seconds = self._between(0.5, 4.0)
        self._system.core.kill()
        self._later(seconds, self._system.core.start)
        return "kill roscore", seconds

    def kill_all(self) -> tuple[str, float]:
        """Kill and restart master, node and robot."""
        self._system.core.kill()
        self._later(0.5, self._system.core.start)
        seconds = self._kill("node", self._system.start_node)
        return "kill roscore, node, robot", max(seconds, self._kill("robot", self._restart_robot))

    def _kill(self, name: str, start: Callable[[], None]) -> float:
        seconds = self._between(0.2, 4.0)
        if name in self._system.parts:
            self._system.kill(name)
            self._later(seconds, start)
        return seconds

    def _restart_robot(self) -> None:
        self._system.start_robot(*self._system.where_the_robot_died())

    def _restart_robot_elsewhere(self) -> None:
        with self._system.truth.open("a", encoding="utf-8") as lines:
            now = time.time()
            moved = {"kind": "moved", "how": "off", "at": now, "until": now}
            lines.write(json.dumps(moved) + "\n")
        self._system.start_robot()


KILLS_NODE = (Soak.kill_node, Soak.kill_node_and_kidnap, Soak.kill_node_and_file, Soak.kill_all)
HAPPENINGS = (
    Soak.people_walk,
    Soak.people_crowd,
    Soak.scans_dropped,
    Soak.odometry_dropped,
    Soak.silence,
    Soak.burst,
    Soak.burst_of_scans,
    Soak.odometry_late,
    Soak.scans_late,
    Soak.clock_ahead,
    Soak.clock_back,
    Soak.kidnap,
    Soak.carry,
    Soak.push,
    Soak.wrong_hint,
    Soak.freeze,
    Soak.kill_robot,
    Soak.kill_robot_and_carry,
    Soak.kill_viewer,
    Soak.kill_roscore,
    *KILLS_NODE,
)


def main() -> None:
    """Run, judge, report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--world", choices=WORLDS, default="office")
    parser.add_argument("--mode", choices=("full", "bootstrap"), default="full")
    parser.add_argument("--report", type=Path, help="folder; without it, print only")
    parser.add_argument("--keep", type=Path, help="folder for all that was written down meanwhile")
    parser.add_argument("--judge", type=Path, help="judge the record.json of an earlier run again")
    options = parser.parse_args()
    if options.judge is not None:
        record = json.loads(options.judge.read_text(encoding="utf-8"))
        print(write_report(judge(record), options.report))
        return
    if (lacking := why_missing()) is not None:
        sys.exit(lacking)
    with contextlib.ExitStack() as stack:
        folder = options.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(parents=True, exist_ok=True)
        system = System(folder, options.world, options.mode, options.seed)
        soak = Soak(system, options.seed)
        try:
            soak.run(options.minutes)
        finally:
            system.end()
        record = {
            "settings": {
                name: getattr(options, name) for name in ("minutes", "seed", "world", "mode")
            },
            "machine": this_machine(),
            "began": soak.began,
            "ended": soak.ended,
            "faults": soak.faults,
            "samples": soak.samples,
            "deaths": soak.deaths,
            "logs": list(system.logs()),
            "truth": whole_lines(system.truth),
            "said": whole_lines(system.said),
            "seen": whole_lines(system.seen),
        }
        (folder / "record.json").write_text(json.dumps(record), encoding="utf-8")
    figures = judge(record)
    print(write_report(figures, options.report))


if __name__ == "__main__":
    main()
