"""What a fleet control learns of the pose, in each state of a real localizer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.worlds.drawing import Drawing
from firstfix.localizer.inputs import NewMap, PoseHint, Reset
from firstfix.localizer.outputs import TrackedPose
from firstfix.localizer.states import State
from firstfix.vda5050.localization import Localization, is_driving
from firstfix.vda5050.report import Problem


class Watched:
    """A robot, and what is known of it on a clock that stands."""

    def __init__(self, robot: Any) -> None:
        self.robot = robot
        self.known = Localization()
        self.now = 100.0
        robot.watchers.append(
            lambda given, outputs, _: self.known.observe(given, outputs, self.now)
        )

    @property
    def position(self) -> Any:
        return self.known.position("hall", self.now)


@pytest.fixture
def watched(robot: Any) -> Watched:
    return Watched(robot)


def assert_lost(watched: Watched, *words: str) -> None:
    assert not watched.position.is_localized
    assert watched.position.deviation_m is None
    error = watched.known.error(watched.now)
    assert error is not None
    assert error.problem is Problem.NOT_LOCALIZED
    for word in words:
        assert word in error.text


def test_before_the_map(watched: Watched):
    assert_lost(watched, "NO_MAP")
    assert watched.position.score == 0.0


def test_the_pose_of_each_state(watched: Watched):
    robot = watched.robot
    robot.begin()
    assert_lost(watched, "SEARCHING")
    robot.scan()
    assert robot.localizer.state is State.LOCALIZED
    position = watched.position
    assert position.is_localized
    assert watched.known.error(watched.now) is None
    assert (position.x, position.y) == pytest.approx((3.0, 2.0), abs=0.05)
    assert position.score > 0.9
    assert position.map_id == "hall"
    robot.give(PoseHint(robot.stamp, SE2(3.0, 2.0, 0.5)))
    assert_lost(watched, "VERIFYING_HINT")
    assert position.x == pytest.approx(3.0, abs=0.05)  # the last one
    assert watched.position.score == 0.0
    robot.scan()
    assert watched.position.is_localized
    robot.give(Signal(robot.stamp, SignalKind.PICKED_UP, active=True))
    assert_lost(watched, "LIFTED")
    robot.give(Reset(robot.stamp))
    assert_lost(watched, "SEARCHING")


def test_several_places(watched: Watched):
    """In a room of two equal halves there are two places, so the pose is not initialized."""
    plan = Drawing(8.0, 5.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 8.0, 5.0)
    watched.robot.grid = plan.grid()
    watched.robot.begin()
    watched.robot.scan()
    assert watched.robot.localizer.state is State.DISAMBIGUATING
    assert_lost(watched, "DISAMBIGUATING")
    assert 0.1 < watched.position.score < 0.8


def test_a_new_map_forgets_the_pose(watched: Watched):
    watched.robot.begin()
    watched.robot.scan()
    plan = Drawing(5.0, 4.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 5.0, 4.0)
    watched.robot.give(NewMap(9.0, plan.grid()))
    assert watched.known.T_map_base is None
    assert (watched.position.x, watched.position.y) == (0.0, 0.0)


def test_without_scans_the_pose_is_not_tracked(watched: Watched):
    watched.robot.begin()
    watched.robot.scan()
    watched.now += 1.9
    assert watched.position.is_localized
    watched.now += 0.2
    assert_lost(watched, "STALE", "2 s")
    error = watched.known.error(watched.now)
    assert error is not None
    assert "LIDAR" in error.hint
    watched.robot.scan()
    assert watched.position.is_localized


def test_the_deviation_contains_95_percent():
    """The radius of a circular distribution, counted on draws."""
    known, sigma = Localization(), 0.05
    covariance = np.diag([sigma**2, sigma**2, 0.01])
    known.observe(Reset(0.0), [TrackedPose(0.0, SE2.identity(), covariance, SE2.identity())], 0.0)
    radius = known._deviation()
    assert radius is not None
    draws = np.random.default_rng(0).normal(0.0, sigma, (20_000, 2))
    assert np.mean(np.hypot(*draws.T) <= radius) == pytest.approx(0.95, abs=0.005)


@pytest.mark.parametrize("worst", [math.nan, math.inf])
def test_a_covariance_that_is_not_finite_gives_no_deviation(worst: float):
    known, covariance = Localization(), np.diag([worst, worst, 0.01])
    known.observe(Reset(0.0), [TrackedPose(0.0, SE2.identity(), covariance, SE2.identity())], 0.0)
    assert known._deviation() is None


def drive(known: Localization, step: SE2, count: int, period_s: float = 0.1) -> None:
    pose = SE2(5.0, -3.0, 2.0)
    for number in range(count):
        known.observe(Odometry(7.0 + number * period_s, pose), [], 0.0)
        pose = pose @ step


@pytest.mark.parametrize("count", [2, 3, 5, 40])
def test_the_velocity_of_an_arc(count: int):
    """On an arc of 0.5 m/s and 0.8 rad/s, whatever the heading."""
    v, w, dt = 0.5, 0.8, 0.1
    step = SE2(v / w * math.sin(w * dt), v / w * (1.0 - math.cos(w * dt)), w * dt)
    known = Localization()
    drive(known, step, count)
    velocity = known.velocity()
    assert velocity is not None
    assert velocity.vx == pytest.approx(v, rel=0.01)
    assert velocity.vy == pytest.approx(0.0, abs=1e-9)
    assert velocity.omega == pytest.approx(w)
    assert is_driving(velocity)


def test_no_velocity_without_odometry():
    known = Localization()
    assert known.velocity() is None
    assert not is_driving(None)
    drive(known, SE2.identity(), 1)
    assert known.velocity() is None
    drive(known, SE2.identity(), 4)
    velocity = known.velocity()
    assert velocity is not None
    assert (velocity.vx, velocity.vy, velocity.omega) == pytest.approx((0.0, 0.0, 0.0))
    assert not is_driving(velocity)


def test_only_a_short_time_of_odometry_is_kept():
    known = Localization()
    drive(known, SE2(0.1, 0.0, 0.0), 1000, period_s=0.01)
    assert len(known._odometry) < 40
