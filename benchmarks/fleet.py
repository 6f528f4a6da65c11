"""A fleet service under load: throughput of its engines, many robots at once, and its memory.

    python benchmarks/fleet.py throughput local ray --floors 12 --queries 40
    python benchmarks/fleet.py robots --floors 12 --robots 50
    python benchmarks/fleet.py memory --floors 2 --requests 10000

Floors are drawn at random, and scans are taken in their true worlds. Errors and answers in a wrong
map are counted. The load of the machine is printed, because it changes all times.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from firstfix.core.scan import LaserScan
from firstfix.fields.cache import cache_folder
from firstfix.fleet.engine import Engine
from firstfix.fleet.fleet import Fleet
from firstfix.fleet.jobs import ShardedSite, parts_for, spread
from firstfix.fleet.local_engine import LocalEngine
from firstfix.io.maps.site_yaml import read_site
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.lab.worlds.floors import RandomFloor, floor_id, write_site
from firstfix.site.query import SiteQuery

CONCURRENT = 8
ROUNDS = 2


def scans_in(floors: Sequence[RandomFloor], count: int) -> list[LaserScan]:
    """Take scans in the true worlds of floors, one after the other."""
    rng = np.random.default_rng(0)
    worlds = [floor.world() for floor in floors]
    lidar = Lidar(beams=360, range_max=25.0)
    return [
        lidar.scan(world, random_free_poses(world, rng, 1)[0], rng)
        for world in (worlds[i % len(worlds)] for i in range(count))
    ]


def engine_of(name: str, sharded: ShardedSite) -> Engine:
    if name == "local":
        return LocalEngine(sharded)
    from firstfix.fleet.ray_engine import RayEngine

    return RayEngine(sharded, None)


async def rate(fleet: Fleet, scans: Sequence[LaserScan]) -> float:
    """Return the answers in a second, with some queries at a time."""
    waiting = iter(scans)

    async def robot() -> None:
        for scan in waiting:
            await fleet.locate(SiteQuery.of(scan))

    started = time.perf_counter()
    await asyncio.gather(*(robot() for _ in range(CONCURRENT)))
    return len(scans) / (time.perf_counter() - started)


async def measure(
    name: str, site: Path, scans: Sequence[LaserScan], workers: int
) -> tuple[float, float]:
    """Return answers in a second, and processor time of the busiest worker for an answer."""
    maps = read_site(site).maps
    shards = spread(maps, parts_for(len(maps), workers))
    copies = workers // len(shards)
    sharded = ShardedSite(site, shards * copies, cache_folder() / "sites", 2 * 10**9)
    engine = engine_of(name, sharded)
    try:
        fleet = Fleet(engine, shards, copies)
        await fleet.prepare()
        await rate(fleet, [*scans[:CONCURRENT]] * workers)
        before = dict(fleet.cpu_s)
        measured = await rate(fleet, scans)
        busiest = max(used - before[worker] for worker, used in fleet.cpu_s.items())
        return measured, busiest / len(scans)
    finally:
        engine.close()


def throughput(names: Sequence[str], site: Path, scans: Sequence[LaserScan]) -> None:
    for name in names:
        ones, twos = [], []
        for _ in range(ROUNDS):  # in turns, because the load of the machine changes
            ones.append(asyncio.run(measure(name, site, scans, 1)))
            twos.append(asyncio.run(measure(name, site, scans, 2)))
            print(f"{name}: {ones} {twos}; {load()}", file=sys.stderr, flush=True)
        (rate_1, cpu_1), (rate_2, cpu_2) = np.median(ones, axis=0), np.median(twos, axis=0)
        print(
            f"{name}: 1 worker {rate_1:.2f} answers/s, {cpu_1:.3f} s of its processor time each; "
            f"2 workers {rate_2:.2f} answers/s, {cpu_2:.3f} s; ratio {rate_2 / rate_1:.2f} by "
            f"time, {cpu_1 / cpu_2:.2f} by processor time; {load()}",
            flush=True,
        )


@contextmanager
def service(site: Path, workers: int) -> Iterator[tuple[str, int]]:
    """Start a service; give its address and process."""
    command = [sys.executable, "-m", "firstfix", "fleet", "serve", f"{site}"]
    options = ["--workers", f"{workers}", "--port", "0"]
    with subprocess.Popen([*command, *options], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None  # noqa: S101 - for mypy
        try:
            found = re.search(r"http://[^\s/]+", process.stdout.readline())
            if found is None:
                raise SystemExit("the service did not start")
            while httpx.get(f"{found.group()}/readyz").status_code != 200:
                time.sleep(0.2)
            yield found.group(), process.pid
        finally:
            process.send_signal(signal.SIGINT)


def body_of(scan: LaserScan) -> dict[str, Any]:
    ranges = [r if math.isfinite(r) else None for r in scan.ranges.tolist()]
    fields = ("angle_min", "angle_increment", "range_min", "range_max")
    return {"ranges": ranges, **{name: getattr(scan, name) for name in fields}}


def ask(http: httpx.Client, body: dict[str, Any], truth: str, counts: Counter[str]) -> float:
    started = time.perf_counter()
    response = http.post("/v1/locate", json=body)
    took = time.perf_counter() - started
    if response.status_code != 200:
        counts[f"error {response.status_code}"] += 1
    else:
        answer = response.json()
        is_right = answer["map_id"] == truth
        counts[f"{answer['verdict']} {'right' if is_right else 'wrong'}"] += 1
    return took


def robots(site: Path, bodies: Sequence[dict[str, Any]], truths: Sequence[str], count: int) -> None:
    counts: Counter[str] = Counter()
    with (
        service(site, os.cpu_count() or 1) as (url, _),
        httpx.Client(
            base_url=url, timeout=120.0, limits=httpx.Limits(max_connections=count)
        ) as http,
        ThreadPoolExecutor(count) as pool,
    ):
        asked = [
            pool.submit(ask, http, bodies[i % len(bodies)], truths[i % len(bodies)], counts)
            for i in range(2 * count)
        ]
        times = sorted(each.result() for each in asked)
    p99 = times[math.ceil(0.99 * len(times)) - 1]
    print(
        f"{count} robots at once, two scans each: {dict(counts)}; "
        f"median {statistics.median(times):.2f} s, p99 {p99:.2f} s; {load()}"
    )


def memory(site: Path, bodies: Sequence[dict[str, Any]], truths: Sequence[str], most: int) -> None:
    counts: Counter[str] = Counter()
    with (
        service(site, 2) as (url, pid),
        httpx.Client(base_url=url, timeout=120.0) as http,
        ThreadPoolExecutor(4) as pool,
    ):
        for part in range(11):
            if part:
                asked = [
                    pool.submit(ask, http, bodies[i % len(bodies)], truths[i % len(bodies)], counts)
                    for i in range(most // 10)
                ]
                for each in asked:
                    each.result()
            text = http.get("/metrics").text
            workers = re.findall(r"^firstfix_worker_memory_bytes\S* (\S+)$", text, re.MULTILINE)
            sizes = ", ".join(f"{float(size) / 1e6:.1f}" for size in workers)
            front = resident(pid) / 1e6
            print(f"{sum(counts.values()):6d} requests: front {front:.1f}, workers {sizes} MB")
    print(f"{dict(counts)}; {load()}")


def resident(pid: int) -> int:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def load() -> str:
    one, _, _ = os.getloadavg()
    return f"load {one:.1f} on {os.cpu_count()} cores"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", choices=("throughput", "robots", "memory"))
    parser.add_argument("engines", nargs="*", default=["local"])
    parser.add_argument("--floors", type=int, default=12)
    parser.add_argument("--area", type=float, default=1000.0, help="of each floor, m²")
    parser.add_argument("--queries", type=int, default=40)
    parser.add_argument("--robots", type=int, default=50)
    parser.add_argument("--requests", type=int, default=10_000)
    options = parser.parse_args()
    floors = [RandomFloor(seed, options.area) for seed in range(options.floors)]
    with tempfile.TemporaryDirectory() as folder:
        site = write_site(Path(folder) / "site", floors, lambda _: None)
        names = [floor_id(floor) for floor in floors]
        scans = scans_in(floors, options.queries)
        truths = [names[i % len(names)] for i in range(options.queries)]
        bodies = [body_of(scan) for scan in scans]
        if options.what == "throughput":
            throughput(options.engines, site, scans)
        elif options.what == "robots":
            robots(site, bodies, truths, options.robots)
        else:
            memory(site, bodies, truths, options.requests)


if __name__ == "__main__":
    main()
