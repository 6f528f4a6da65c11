"""A building with a lift, and a robot that rides it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from site_lab import ROOMS, draw

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.outputs import InitialPose, MapSwitched, Output, Status, TrackedPose
from firstfix.site.floors import SiteLocalizer
from firstfix.site.site import Site

Box = tuple[float, float, float, float]

# A cabin of 1.6 x 1.6 m in the corner, whose door leads to +x.
CABIN: list[Box] = [(0.0, 1.6, 1.7, 1.75), (1.6, 0.0, 1.7, 0.3), (1.6, 1.3, 1.7, 1.6)]
DOOR: Box = (1.6, 0.3, 1.7, 1.3)
LIFT = SE2(0.8, 0.8, 0.0)
FLOORS: dict[str, list[Box]] = {
    "ground": ROOMS["ground"],
    "first": [(5.0, 0.0, 5.5, 2.5), (6.0, 4.0, 8.0, 4.4), (3.0, 4.0, 3.6, 4.6)],
    "second": [(4.0, 4.0, 5.4, 6.0), (7.0, 0.0, 8.0, 3.0)],
}
LIDAR = Lidar(beams=180, range_max=12.0)


def world(boxes: list[Box], *, is_open: bool = True) -> OccupancyGrid:
    return draw([*boxes, *CABIN, *([] if is_open else [DOOR])])


def save_site(folder: Path, floors: dict[str, list[Box]], broken: Sequence[str] = ()) -> Path:
    folder.mkdir()
    ends = ", ".join(f"{{map: {name}, pose: [0.8, 0.8, 0.0]}}" for name in (*floors, *broken))
    maps = [f"  {name}: {{map: {name}.yaml, floor: {name}}}" for name in (*floors, *broken)]
    for name, boxes in floors.items():
        save_map(world(boxes), folder / f"{name}.yaml")
    for name in broken:
        (folder / f"{name}.yaml").write_text("image: none.pgm\nresolution: 0.05\n")
    text = ["maps:", *maps, "transitions:", f"  lift: {{kind: lift, ends: [{ends}]}}"]
    (folder / "site.yaml").write_text("\n".join(text))
    return folder


class Ride:
    """A robot with perfect wheels that drives in one world after another."""

    def __init__(self, site: Site, at: SE2) -> None:
        self.localizer = SiteLocalizer(site)
        self.at = at
        self.T_map_odom = at  # odometry begins at the origin
        self.now = 0.0
        self.outputs: list[Output] = []
        self._rng = np.random.default_rng(1)

    def stand(self, grid: OccupancyGrid, seconds: float = 1.0) -> list[Output]:
        return self.drive(grid, [self.at] * round(seconds / 0.2))

    def go(self, grid: OccupancyGrid, x: float, y: float) -> list[Output]:
        bearing = math.atan2(y - self.at.y, x - self.at.x)
        turn = math.remainder(bearing - self.at.yaw, 2.0 * math.pi)
        turns = [SE2(self.at.x, self.at.y, self.at.yaw + turn * f) for f in np.linspace(0, 1, 5)]
        ahead = np.linspace([self.at.x, self.at.y], [x, y], 2 + round(self.away(x, y) / 0.1))
        return self.drive(grid, [*turns, *(SE2(px, py, bearing) for px, py in ahead)])

    def away(self, x: float, y: float) -> float:
        return math.hypot(x - self.at.x, y - self.at.y)

    def drive(self, grid: OccupancyGrid, path: Sequence[SE2]) -> list[Output]:
        said: list[Output] = []
        for pose in path:
            self.at, self.now = pose, self.now + 0.2
            said += self.give(Odometry(self.now, self.T_map_odom.inverse() @ pose))
            said += self.give(LIDAR.scan(grid, pose, self._rng, stamp=self.now))
        return said

    def give(self, given) -> list[Output]:  # type: ignore[no-untyped-def]
        outputs = self.localizer.handle(given)
        self.outputs += outputs
        return outputs


def poses(outputs: Sequence[Output]) -> list[Output]:
    return [o for o in outputs if isinstance(o, (InitialPose, TrackedPose))]


def maps(outputs: Sequence[Output]) -> list[str]:
    return [o.map_id for o in outputs if isinstance(o, MapSwitched)]


def reasons(outputs: Sequence[Output]) -> str:
    return "\n".join(o.reason for o in outputs if isinstance(o, Status))


def into_the_lift(site: Site, boxes: list[Box]) -> Ride:
    """Find the robot on a floor, and drive it into the lift."""
    ride = Ride(site, SE2(3.0, 1.0, 0.0))
    ride.stand(world(boxes))
    ride.go(world(boxes), 0.8, 0.8)
    return ride
