"""Time the way from a point cloud or a depth image to a scan.

    python benchmarks/points.py [--runs 50]

The goal is 3 ms for the 30,000 points of a LIDAR with 16 rings.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from firstfix.core.points import points_from_depth, scan_from_points

RINGS, AROUND = 16, 1875
TILTED = (0.1, 0.0, 0.8, 0.02, 0.05, 0.3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=50)
    runs = parser.parse_args().runs
    cloud = ring_cloud()
    depth = np.full((480, 640), 2.0, np.float32)
    _report(f"{len(cloud)} points", lambda: scan_from_points(cloud, TILTED), runs)
    _report(
        "640 x 480 depth image",
        lambda: scan_from_points(
            points_from_depth(depth, (525.0, 525.0), (319.5, 239.5)), TILTED, view=(-0.6, 0.6)
        ),
        runs,
    )


def ring_cloud() -> NDArray[np.float32]:
    """Points of a LIDAR with 16 rings, 2 degrees apart, in a round room of 5 m."""
    elevation = np.radians(np.arange(RINGS) * 2.0 - 15.0)[:, None]
    turn = np.linspace(-math.pi, math.pi, AROUND, endpoint=False)[None, :]
    x, y = 5.0 * np.cos(turn), 5.0 * np.sin(turn)
    z = np.broadcast_to(5.0 * np.tan(elevation), (RINGS, AROUND))
    xyz = np.stack(np.broadcast_arrays(x, y, z), axis=-1).reshape(-1, 3)
    return xyz.astype(np.float32)


def _report(name: str, call: Callable[[], object], runs: int) -> None:
    times = []
    for _ in range(runs):
        began = time.process_time()
        call()
        times.append(1e3 * (time.process_time() - began))
    print(
        f"{name}: median {np.median(times):.2f} ms, fastest {min(times):.2f} ms of processor time"
    )


if __name__ == "__main__":
    main()
