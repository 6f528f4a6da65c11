"""A fleet service in a process of its own, and scans as its API takes them."""

from __future__ import annotations

import math
import os
import re
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path
from typing import Any

import httpx
from site_lab import scan_in

from firstfix.belief.view import View
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2

READY_S = 120.0


class FleetServer:
    """``firstfix fleet serve`` in a process of its own.

    Parameters
    ----------
    *arguments : str or Path
        After ``serve``.
    """

    def __init__(self, *arguments: str | Path) -> None:
        command = [sys.executable, "-m", "firstfix", "fleet", "serve", *map(str, arguments)]
        self.process = subprocess.Popen(
            [*command, "--port", "0"], stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        found = re.search(r"http://[^\s/]+", line)
        if not found:
            self.process.stdout.close()
            raise AssertionError(f"the service ended with {self.process.wait(20.0)}: {line}")
        self.http = httpx.Client(base_url=found.group(), timeout=240.0)

    def wait_until_ready(self) -> FleetServer:
        until = time.monotonic() + READY_S
        while self.http.get("/readyz").status_code != 200:
            assert time.monotonic() < until, self.http.get("/v1/maps").text
            time.sleep(0.1)
        return self

    def workers(self) -> list[int]:
        """Return the process ids of its workers."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        pids = [int(word) for word in children.read_text().split()]
        spawned = b"spawn_main"
        return [pid for pid in pids if spawned in Path(f"/proc/{pid}/cmdline").read_bytes()]

    def stop(self) -> int:
        self.http.close()
        os.kill(self.process.pid, signal.SIGINT)
        try:
            return self.process.wait(20.0)
        finally:
            self.process.kill()
            assert self.process.stdout is not None
            self.process.stdout.close()


@cache
def scan_of(room: str, pose: SE2, seed: int = 0, **sensor: float) -> LaserScan:
    return scan_in(room, pose, seed, **sensor)


def narrow_views(room: str) -> list[View]:
    """Give views of a robot that turns, whose sensor sees too little from one pose."""
    poses = [SE2(2.3, 2.1, 0.2 + 0.5 * i) for i in range(4)]
    return [View.of(scan_of(room, pose, beams=91, fov=1.2), pose) for pose in poses]


def as_message(scan: LaserScan) -> dict[str, Any]:
    """Write a scan as the API takes it."""
    return {
        "ranges": [r if math.isfinite(r) else None for r in scan.ranges.tolist()],
        "angle_min": scan.angle_min,
        "angle_increment": scan.angle_increment,
        "range_min": scan.range_min,
        "range_max": scan.range_max,
        "T_base_laser": list(scan.T_base_laser),
    }
