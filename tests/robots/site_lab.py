"""Drawn maps of a small site, and scans in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.lab.simulation.lidar import Lidar

# Boxes of wall (x0, y0, x1, y1), m, in a room of 8 x 6 m: no two rooms look alike.
ROOMS = {
    "ground": [(0.0, 4.5, 2.0, 6.0), (4.5, 2.5, 5.0, 3.0), (6.5, 0.0, 8.0, 0.5)],
    "first": [(3.0, 0.0, 3.5, 3.5), (6.0, 4.0, 8.0, 4.4), (1.0, 1.0, 1.6, 1.6)],
    "second": [(0.0, 0.0, 1.5, 1.0), (5.0, 3.0, 5.4, 6.0), (2.0, 4.0, 3.0, 4.3)],
}


def draw(
    boxes: list[tuple[float, float, float, float]],
    resolution: float = 0.05,
    frame: SE2 | None = None,
) -> OccupancyGrid:
    """Draw a room with a margin of 0.5 m and walls of 0.2 m around it."""

    def span(low: float, high: float) -> slice:
        return slice(round((low + 0.7) / resolution), round((high + 0.7) / resolution))

    cells = np.full((round(7.4 / resolution), round(9.4 / resolution)), UNKNOWN, np.int8)
    cells[span(-0.2, 6.2), span(-0.2, 8.2)] = OCCUPIED
    cells[span(0.0, 6.0), span(0.0, 8.0)] = FREE
    for x0, y0, x1, y1 in boxes:
        cells[span(y0, y1), span(x0, x1)] = OCCUPIED
    origin = SE2(-0.7, -0.7, 0.0)
    return OccupancyGrid(cells, resolution, origin if frame is None else frame @ origin)


def save_rooms(folder: Path) -> Path:
    for name, boxes in ROOMS.items():
        (folder / name).mkdir(parents=True)
        save_map(draw(boxes), folder / name / "map.yaml")
    return folder


def scan_in(room: str, pose: SE2, seed: int = 0, stamp: float = 0.0, **sensor: float) -> LaserScan:
    """Simulate a scan, of the whole turn unless the sensor is another."""
    lidar = Lidar(**{"beams": 360, "range_max": 12.0, **sensor})
    return lidar.scan(draw(ROOMS[room]), pose, np.random.default_rng(seed), stamp=stamp)
