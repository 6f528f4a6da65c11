"""What the live page costs a robot: processor, delay, memory, and the way to a search and back.

A server in a process of its own shows 720 beams and 2000 particles 20 times a second to viewers in
another one. The localizer is left out: frames come from scans that were placed before.

    python benchmarks/live.py [--seconds 20] [--viewers 0 1 20]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import os
import resource
import statistics
import threading
import time
import urllib.request
from dataclasses import replace
from multiprocessing.connection import Connection
from types import SimpleNamespace
from typing import Any

import numpy as np

from firstfix.amcl.particles import equal_weights
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.lab.worlds.office import office
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.outputs import Status, TrackedPose
from firstfix.localizer.states import State
from firstfix.web.command_executor import CommandExecutor
from firstfix.web.page import Page
from firstfix.web.server import listen, make_server, url_of
from firstfix.web.snapshot_store import SnapshotStore

BEAMS, PARTICLES, HZ = 720, 2000, 20
LIDAR = Lidar(beams=BEAMS, dropout=0.01)
POSES, SEARCHES = 40, 60
NOWHERE = np.diag([0.01, 0.01, 0.001])


def scans(count: int) -> list[tuple[SE2, LaserScan]]:
    rng = np.random.default_rng(0)
    grid = office()
    poses = random_free_poses(grid, rng, count, 0.4)
    return [(pose, LIDAR.scan(grid, pose, rng)) for pose in poses]


def serve(pipe: Connection) -> None:
    """Show frames until the end; answer each request with CPU time and memory so far."""
    grid, placed = office(), scans(POSES)
    store = SnapshotStore("office")
    localizer: Any = SimpleNamespace(
        matcher=ScanMatcher(grid), particles=None, belief=None, changes=None, view=None
    )
    store(NewMap(0.0, grid), [], localizer)
    is_over = threading.Event()

    def show() -> None:
        rng = np.random.default_rng(0)
        beliefs = [
            equal_weights(pose.as_array() + 0.1 * rng.standard_normal((PARTICLES, 3)))
            for pose, _ in placed
        ]
        evidence = localizer.matcher.score_poses(placed[0][1], [placed[0][0]])[0].evidence
        i = 0
        while not is_over.wait(1.0 / HZ):
            i += 1
            pose, scan = placed[i % POSES]
            stamp = time.monotonic()
            localizer.particles = beliefs[i % POSES]
            tracked = TrackedPose(stamp, pose, NOWHERE, pose)
            status = Status(stamp, State.LOCALIZED, "100% of the beams fit", evidence)
            scan = replace(scan, stamp=stamp)
            localizer.view = SimpleNamespace(scans=(scan,))
            store(scan, [tracked, status], localizer)

    showing = threading.Thread(target=show)
    with listen("127.0.0.1", 0) as listening:
        server = make_server(Page("sim", store, CommandExecutor(store, lambda _: None)))
        serving = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        serving.start()
        showing.start()
        pipe.send(url_of(listening))
        while pipe.recv() != "end":
            used = resource.getrusage(resource.RUSAGE_SELF)
            pipe.send((used.ru_utime + used.ru_stime, rss_mb()))
        is_over.set()
        server.should_exit = True
        serving.join()
        showing.join()


def rss_mb() -> float:
    with open("/proc/self/statm") as file:  # noqa: PTH123 - no file of a project
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def watch(url: str, viewers: int, seconds: float, pipe: Connection) -> None:
    """Connect viewers; return the number of frames and their delays."""
    from websockets.asyncio.client import connect

    late_s: list[float] = []
    frames, size = 0, 0

    async def look() -> None:
        nonlocal frames, size
        async with connect(url.replace("http", "ws") + "v1/live", close_timeout=1) as viewer:
            end = time.monotonic() + seconds
            async for message in viewer:
                frames, size = frames + 1, size + len(message)
                if isinstance(message, str) and message.startswith('{"type":"state"'):
                    late_s.append(time.monotonic() - json.loads(message)["stamp"])
                if time.monotonic() > end:
                    return

    async def all_of_them() -> None:
        await asyncio.gather(*(look() for _ in range(viewers)))

    asyncio.run(all_of_them())
    pipe.send((frames, size, late_s))


def measure(server: Connection, url: str, viewers: int, seconds: float) -> None:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    if viewers:
        watching = context.Process(target=watch, args=(url, viewers, seconds + 4.0, theirs))
        watching.start()
    time.sleep(3.0)
    cpu_s, _ = asked(server)
    began = time.monotonic()
    time.sleep(seconds)
    used, memory = asked(server)
    share = (used - cpu_s) / (time.monotonic() - began)
    line = f"{viewers:7d} {share:11.1%} {memory:11.0f}"
    if viewers:
        frames, size, late_s = ours.recv()
        watching.join()
        each = viewers * (seconds + 4.0)
        late_ms = 1e3 * np.quantile(late_s, [0.5, 0.99])
        line += f" {frames / each:13.1f} {size / each / 1e3:12.0f}"
        line += f" {late_ms[0]:12.1f} {late_ms[1]:10.1f}"
    print(line)


def asked(server: Connection) -> tuple[float, float]:
    server.send("report")
    seconds, megabytes = server.recv()
    return seconds, megabytes


def search(url: str) -> None:
    """Compare the way through the API with the search alone."""
    extra_ms: list[float] = []
    search_ms: list[float] = []
    for _, scan in scans(SEARCHES):
        names = ("angle_min", "angle_increment", "range_min", "range_max")
        ranges = [float(r) if np.isfinite(r) else None for r in scan.ranges]
        body = {"ranges": ranges} | {name: getattr(scan, name) for name in names}
        request = urllib.request.Request(  # noqa: S310 - our own
            url + "v1/locate", json.dumps(body).encode(), {"Content-Type": "application/json"}
        )
        began = time.perf_counter()
        with urllib.request.urlopen(request) as answer:  # noqa: S310
            told = json.load(answer)
        took = time.perf_counter() - began
        search_ms.append(1e3 * told["elapsed_s"])
        extra_ms.append(1e3 * (took - told["elapsed_s"]))
    print(
        f"\nPOST /v1/locate, {BEAMS} beams as JSON: {statistics.median(extra_ms):.1f} ms", end=" "
    )
    print(f"(p95 {np.quantile(extra_ms, 0.95):.1f}) more than the search,", end=" ")
    print(f"which takes {statistics.median(search_ms):.1f} ms (median)")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="of each measurement")
    parser.add_argument("--viewers", type=int, nargs="+", default=[0, 1, 20])
    options = parser.parse_args()
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    server = context.Process(target=serve, args=(theirs,))
    server.start()
    url = ours.recv()
    print(f"{BEAMS} beams, {PARTICLES} particles, {HZ} Hz; server: share of one core, MB")
    print("viewers   processor      memory  frames/s each   kB/s each  delay p50 ms     p99 ms")
    for viewers in options.viewers:
        measure(ours, url, viewers, options.seconds)
    search(url)
    ours.send("end")
    server.join()


if __name__ == "__main__":
    main()
