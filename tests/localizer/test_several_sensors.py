"""Two lasers at opposite corners of one robot."""

import dataclasses
import math

import numpy as np
import pytest

from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.map_localization import MapLocalization
from firstfix.localizer.outputs import InitialPose, Status, TrackedPose
from firstfix.localizer.states import State

REACH = 8.0
PLACES = {"front": SE2(0.3, 0.2, math.radians(45.0)), "rear": SE2(-0.3, -0.2, math.radians(-135.0))}
START = SE2(4.0, 3.0, 1.0)
REST = SE2(0.0, 0.0, 0.0)


def seen(grid, T_map_base: SE2, sensor: str, stamp: float) -> LaserScan:
    bearings = np.radians(np.arange(-135.0, 135.1, 3.0))
    T_map_laser = T_map_base @ PLACES[sensor]
    ranges = expected_ranges(grid, T_map_laser, bearings, REACH)
    ranges = np.where(ranges >= REACH, np.inf, ranges)
    place = PLACES[sensor]
    step = bearings[1] - bearings[0]
    return LaserScan(ranges, bearings[0], step, 0.05, REACH, stamp, place, sensor=sensor)


class TwoLasers:
    """A robot in the hall; each tick is 0.1 s, and the rear laser is `later` than the front one."""

    def __init__(self, grid, later=0.0, clock=0.0):
        self.grid, self.later, self.clock = grid, later, clock
        self.localizer = Localizer()
        self.localizer.handle(NewMap(0.0, grid))
        self.outputs, self._ticks = [], 0

    @property
    def stamp(self):
        return self._ticks / 10

    def pose_at(self, stamp, step) -> SE2:
        return START @ SE2(10 * stamp * step.x, 0.0, 0.0) if step.yaw == 0.0 else START

    def send(self, given):
        outputs = self.localizer.handle(given)
        self.outputs += outputs
        return outputs

    def tick(self, step=REST, sensors=("front", "rear"), damage=None):
        self._ticks += 1
        outputs = []
        for sensor in sensors:
            at = self.stamp + (self.later if sensor == "rear" else 0.0)
            pose = self.pose_at(at, step)
            outputs += self.send(Odometry(at, START.inverse() @ pose))
            stamp = at - (self.clock if sensor == "rear" else 0.0)
            scan = seen(self.grid, pose, sensor, stamp)
            outputs += self.send(damage(scan) if damage else scan)
        return outputs


def of(kind: type, outputs: list) -> list:
    return [output for output in outputs if isinstance(output, kind)]


@pytest.fixture
def used(monkeypatch) -> list[tuple[str, ...]]:
    """Note the sensors of each view that the localizer uses."""
    views: list[tuple[str, ...]] = []
    for name in ("_find", "_follow", "_verify_hint"):
        original = getattr(MapLocalization, name)

        def spy(self, view, original=original):
            views.append(tuple(scan.sensor for scan in view.scans))
            return original(self, view)

        monkeypatch.setattr(MapLocalization, name, spy)
    return views


def test_scans_of_one_instant_are_one_view(hall_plan, used):
    robot = TwoLasers(hall_plan, later=0.02)
    for _ in range(6):
        robot.tick()
    # The rates are known from the second scan of each on.
    assert used[-3:] == [("front", "rear")] * 3
    assert robot.localizer.state is State.LOCALIZED


def test_the_pose_of_both_is_true_while_the_robot_drives(hall_plan, used):
    robot = TwoLasers(hall_plan, later=0.03)
    step = SE2(0.05, 0.0, 0.0)
    for _ in range(20):
        robot.tick(step)
    poses = of(TrackedPose, robot.outputs)
    assert used[-1] == ("front", "rear")
    for pose in poses[5:]:
        # At the stamp of the newest scan; the other one is moved there by odometry.
        assert pose.T_map_base.distance_to(robot.pose_at(pose.stamp, step)) < 0.03
    stamps = [pose.stamp for pose in poses]
    assert stamps == sorted(stamps)


def test_a_sensor_that_falls_silent_stops_nothing(hall_plan, used):
    robot = TwoLasers(hall_plan, later=0.02)
    for _ in range(6):
        robot.tick()
    silent = [of(TrackedPose, robot.tick(sensors=("front",))) for _ in range(8)]
    assert sum(map(bool, silent[:4])) >= 3  # at most one period late
    assert all(silent[4:])
    assert used[-1] == ("front",)
    robot.tick()
    robot.tick()
    assert used[-1] == ("front", "rear")


def test_a_slow_sensor_delays_no_fast_one(hall_plan, used):
    robot = TwoLasers(hall_plan)
    found = []
    for k in range(24):
        sensors = ("front", "rear") if k % 4 == 0 else ("front",)
        found.append(bool(of(TrackedPose, robot.tick(sensors=sensors))))
    assert all(found[9:])
    assert used[-4:] == [("front", "rear"), ("front",), ("front",), ("front",)]


def test_lasers_whose_clocks_differ_are_said_once_and_used_apart(hall_plan, used):
    robot = TwoLasers(hall_plan, clock=0.7)
    for _ in range(40):
        robot.tick()
    said = [status.reason for status in of(Status, robot.outputs) if "clock" in status.reason]
    (complaint,) = said
    assert complaint == (
        "the clock of rear is 0.70 s behind that of front: its scans are used apart, while the "
        "robot rests; synchronise the clocks"
    )
    assert set(used[-10:]) == {("front",), ("rear",)}
    stamps = [pose.stamp for pose in of(TrackedPose, robot.outputs)]
    assert stamps[-20:] == sorted(stamps[-20:])


def test_a_laser_with_another_clock_does_not_pull_a_robot_that_drives(hall_plan, used):
    robot = TwoLasers(hall_plan, clock=0.7)
    for _ in range(12):
        robot.tick()
    step = SE2(0.05, 0.0, 0.0)
    robot._ticks = 0
    robot.localizer = Localizer()
    robot.localizer.handle(NewMap(0.0, hall_plan))
    robot.outputs.clear()
    for _ in range(40):
        robot.tick(step)
    assert used[-10:] == [("front",)] * 10
    last = of(TrackedPose, robot.outputs)[-1]
    assert last.T_map_base.distance_to(robot.pose_at(last.stamp, step)) < 0.05


def test_one_covered_laser_leaves_the_other(hall_plan):
    def cover(scan: LaserScan) -> LaserScan:
        if scan.sensor == "front":
            return scan
        return dataclasses.replace(scan, ranges=np.full(len(scan), np.nan))

    robot = TwoLasers(hall_plan, later=0.02)
    for _ in range(8):
        robot.tick(damage=cover)
    assert robot.localizer.state is State.LOCALIZED
    assert of(InitialPose, robot.outputs)[0].T_map_base.distance_to(START) < 0.05


def test_beams_are_judged_from_their_own_origins(hall_plan):
    """Each laser stands where it is: in one place, they fit nowhere as well."""

    def merged(scan: LaserScan) -> LaserScan:
        yaw = PLACES[scan.sensor].yaw
        return dataclasses.replace(scan, T_base_laser=SE2(0.0, 0.0, yaw))

    right, wrong = (TwoLasers(hall_plan, later=0.01) for _ in range(2))
    for _ in range(5):
        right.tick()
        wrong.tick(damage=merged)
    explained = [of(Status, robot.outputs)[-1].evidence.explained for robot in (right, wrong)]
    assert explained[0] > 0.98 > explained[1]
