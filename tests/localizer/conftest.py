"""A robot that stands or drives in a drawn world and sends its scans to a localizer."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firstfix.belief.belief import Belief
from firstfix.belief.view import View
from firstfix.core.angles import angle_error
from firstfix.core.estimate import LocateResult
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan, Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import identical_rooms, random_free_poses
from firstfix.lab.worlds.drawing import Drawing
from firstfix.lab.worlds.office import office as draw_office
from firstfix.localizer import place_belief
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Output, Status, TrackedPose
from firstfix.localizer.states import State

Damage = Callable[[LaserScan], LaserScan]
HALF_LIDAR = Lidar(beams=120, fov=math.pi)


class Robot:
    """One robot, its world, its localizer, and all outputs.

    Each `tick` is 0.1 s: the robot moves and sends its odometry, then its scan.
    """

    def __init__(
        self,
        world: OccupancyGrid,
        pose: SE2,
        localizer: Localizer,
        *,
        lidar: Lidar | None = None,
        seed: int = 0,
    ) -> None:
        self.world = world
        self.pose = pose
        self.localizer = localizer
        self.lidar = lidar or Lidar(beams=180)
        self.T_odom_base = SE2(-3.0, 7.0, 2.0)
        self.stamp = 100.0
        self.outputs: list[Output] = []
        self._ticks = 0
        self._rng = np.random.default_rng(seed)

    def send(self, given: Input) -> list[Output]:
        """Hand an input to the localizer."""
        outputs = self.localizer.handle(given)
        self.outputs += outputs
        return outputs

    def scan(self) -> LaserScan:
        """Return a scan at the present pose."""
        return self.lidar.scan(self.world, self.pose, self._rng, self.stamp)

    def tick(self, moved: SE2 | None = None, damage: Damage | None = None) -> list[Output]:
        """Let 0.1 s pass."""
        moved = moved or SE2.identity()
        self.skip(moved)
        scan = self.scan()
        odometry = self.send(Odometry(self.stamp, self.T_odom_base))
        return odometry + self.send(damage(scan) if damage else scan)

    def skip(self, moved: SE2) -> None:
        """Let 0.1 s pass without a message."""
        self.pass_time(0.1)
        self.pose = self.pose @ moved
        self.T_odom_base = self.T_odom_base @ moved

    def pass_time(self, seconds: float) -> None:
        """Let time pass, in tenths of a second."""
        self._ticks += round(10.0 * seconds)
        self.stamp = 100.0 + self._ticks / 10

    def ticks(self, n: int, moved: SE2 | None = None, damage: Damage | None = None) -> list[Output]:
        """Let n times 0.1 s pass."""
        return [output for _ in range(n) for output in self.tick(moved, damage)]


@pytest.fixture(scope="session")
def maps_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("maps")


@pytest.fixture
def robot_in(maps_cache: Path) -> Callable[..., Robot]:
    """Give a function that puts a robot into a world; its map is that of the world."""

    def place(world: OccupancyGrid, pose: SE2, **settings: object) -> Robot:
        localizer = Localizer(cache_dir=maps_cache)
        localizer.handle(NewMap(99.0, world))
        return Robot(world, pose, localizer, **settings)  # type: ignore[arg-type]

    return place


@pytest.fixture(scope="session")
def with_ranges() -> Callable[..., Damage]:
    """Return a function that replaces all ranges of a scan."""

    def make(ranges: Callable[[LaserScan], object]) -> Damage:
        def damage(scan: LaserScan) -> LaserScan:
            values = np.broadcast_to(np.asarray(ranges(scan), np.float32), (len(scan),))
            return dataclasses.replace(scan, ranges=values)

        return damage

    return make


@pytest.fixture(scope="session")
def office() -> OccupancyGrid:
    return draw_office()


@pytest.fixture(scope="session")
def three_rooms() -> OccupancyGrid:
    """Three rooms of one plan, doors closed: x counts from 0, 8 and 16 m."""
    return identical_rooms(3)


@pytest.fixture(scope="session")
def two_rooms() -> OccupancyGrid:
    """Two rooms, 7 m apart, that differ behind a robot which looks along +x: a shelf in one."""
    plan = Drawing(13.0, 5.0, 0.05, 1.0)
    for x in (0.0, 7.0):
        plan.room(x, 0.0, x + 5.0, 4.6)
        plan.solid(x + 4.0, 3.2, x + 4.9, 4.5)
        plan.solid(x + 4.5, 0.1, x + 4.9, 0.8)
    plan.solid(7.1, 1.5, 7.9, 2.5)
    return plan.grid()


@pytest.fixture(scope="session")
def hall_locator(hall_plan: OccupancyGrid) -> ScanMatcher:
    return ScanMatcher(hall_plan)


@pytest.fixture(scope="session")
def office_locator(office: OccupancyGrid) -> ScanMatcher:
    return ScanMatcher(office)


@pytest.fixture(scope="session")
def three_rooms_locator(three_rooms: OccupancyGrid) -> ScanMatcher:
    return ScanMatcher(three_rooms)


@pytest.fixture(scope="session")
def two_rooms_locator(two_rooms: OccupancyGrid) -> ScanMatcher:
    return ScanMatcher(two_rooms)


@pytest.fixture(scope="session")
def half_lidar() -> Lidar:
    """See the half in front only."""
    return HALF_LIDAR


@pytest.fixture(scope="session")
def of() -> Callable[[Any, list[Output]], list[Any]]:
    """Give a function that picks the outputs of some kinds."""

    def of(kind: Any, outputs: list[Output]) -> list[Any]:
        return [output for output in outputs if isinstance(output, kind)]

    return of


@pytest.fixture(scope="session")
def poses(of: Callable[[Any, list[Output]], list[Any]]) -> Callable[[list[Output]], list[Any]]:
    """Give a function that picks all poses that were published."""
    return lambda outputs: of((InitialPose, TrackedPose), outputs)


@pytest.fixture(scope="session")
def kinds() -> Callable[[list[Output]], list[type]]:
    """Return a function for the types of outputs."""
    return lambda outputs: [type(output) for output in outputs]


@pytest.fixture(scope="session")
def is_at() -> Callable[..., bool]:
    """Return a function that compares a pose with the truth."""

    def is_at(pose: SE2, truth: SE2, metres: float = 0.1, degrees: float = 2.0) -> bool:
        near = pose.distance_to(truth) <= metres
        return near and angle_error(pose.yaw, truth.yaw) <= math.radians(degrees)

    return is_at


@pytest.fixture(scope="session")
def office_poses() -> Callable[[OccupancyGrid, int, int], list[SE2]]:
    """Give a function that draws places in an office where a robot can stand."""
    return lambda office, n, seed: random_free_poses(office, np.random.default_rng(seed), n, 0.4)


@pytest.fixture
def in_hall(robot_in: Callable[..., Robot], hall_plan: OccupancyGrid) -> Robot:
    """A robot that has just been found in the hall."""
    robot = robot_in(hall_plan, SE2(4.0, 3.0, 1.0))
    assert [type(output) for output in robot.tick()] == [InitialPose, TrackedPose, Status]
    assert robot.localizer.state is State.LOCALIZED
    return robot


@pytest.fixture
def foreign(
    robot_in: Callable[..., Robot],
    hall_plan: OccupancyGrid,
    office: OccupancyGrid,
    office_poses: Callable[[OccupancyGrid, int, int], list[SE2]],
) -> Robot:
    """A robot that has just found nothing, in the office with the map of the hall."""
    for pose in office_poses(office, 4, 3):
        robot = robot_in(hall_plan, pose)
        robot.world = office
        robot.tick()
        if robot.localizer.state is State.SEARCHING:
            return robot
    raise AssertionError("no pose of the office is foreign to the hall")


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Note the stamps of all scans that a whole map is searched for."""
    stamps, locate, update = [], ScanMatcher.locate, place_belief.update

    def spy_on_locate(self: ScanMatcher, scans: Scans) -> LocateResult:
        stamps.append(as_scans(scans)[0].stamp)
        return locate(self, scans)

    def spy_on_update(belief: Belief, view: View) -> Belief:
        stamps.append(view.scans[0].stamp)
        return update(belief, view)

    monkeypatch.setattr(ScanMatcher, "locate", spy_on_locate)
    monkeypatch.setattr(place_belief, "update", spy_on_update)
    return stamps
