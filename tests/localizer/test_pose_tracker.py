"""The tracked pose: particles that have gone astray come back to what the scans have shown."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.amcl.filter import start
from firstfix.amcl.initial import around_pose
from firstfix.amcl.tracker import Track
from firstfix.belief.view import View
from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.pose_monitor import Fit
from firstfix.localizer.pose_tracker import PoseTracker

HERE, THERE = SE2(4.0, 3.0, 1.0), SE2(7.5, 5.0, -1.0)
ODOM = SE2(-3.0, 7.0, 2.0)


class Tracking:
    """A tracker that has followed a robot at rest for one scan."""

    def __init__(self, locator) -> None:
        self.locator, self.rng = locator, np.random.default_rng(1)
        self.tracker = PoseTracker(locator, LocalizerConfig(), np.random.default_rng(2))
        (place,) = locator.score_poses(self.view(HERE, 0.0).scans, [HERE])
        self.tracker.start(0.0, ODOM, place)
        self.follow(HERE, 0.1)

    def view(self, pose, stamp):
        scan = Lidar(beams=180).scan(self.locator.fields.grid, pose, self.rng, stamp)
        return View((scan,), ODOM)

    def follow(self, pose, stamp):
        return self.tracker.follow(self.view(pose, stamp), force_update=False)

    def lead_away(self, off):
        """Put the particles around another pose, and the robot does not move."""
        particles = around_pose(HERE @ off, np.diag([1e-4, 1e-4, 1e-4]), 500, self.rng)
        self.tracker._track = Track(start(particles), ODOM)

    @property
    def mean(self):
        return self.tracker.T_map_odom @ ODOM


@pytest.fixture
def tracking(hall_locator):
    return Tracking(hall_locator)


@pytest.mark.parametrize("off", [SE2(0.35, 0.0, 0.2), SE2(-0.2, 0.3, -0.3)])
def test_particles_that_were_led_away_come_back(tracking, off):
    tracking.lead_away(off)
    tracked = tracking.follow(HERE, 0.2)
    assert tracked.judgement.fit is Fit.CONSISTENT
    assert tracked.pose.T_map_base.distance_to(HERE) < 0.02
    assert tracking.mean.distance_to(HERE) < 0.02
    assert angle_error(tracking.mean.yaw, HERE.yaw) < math.radians(1.0)


def test_particles_that_have_found_the_robot_stay_there(tracking):
    slipped = SE2(0.3, 0.1, 0.2)  # the wheels have not noticed
    tracking.lead_away(slipped)
    tracked = tracking.follow(HERE @ slipped, 0.2)
    assert tracked.judgement.fit is Fit.CONSISTENT
    assert tracked.pose.T_map_base.distance_to(HERE @ slipped) < 0.02
    assert tracking.mean.distance_to(HERE @ slipped) < 0.05


def test_particles_on_their_way_to_the_robot_are_not_called_back(tracking):
    halfway, slipped = SE2(0.25, 0.0, 0.2), SE2(0.4, 0.0, 0.4)
    tracking.lead_away(halfway)
    tracked = tracking.follow(HERE @ slipped, 0.2)
    assert tracked.judgement.fit is not Fit.CONSISTENT
    assert tracking.mean.distance_to(HERE @ halfway) < 0.05


def test_a_robot_that_was_carried_away_does_not_fit_the_sharp_pose(tracking):
    tracked = tracking.follow(THERE, 0.2)
    assert tracked.judgement.fit is not Fit.CONSISTENT
