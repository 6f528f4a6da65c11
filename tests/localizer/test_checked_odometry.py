"""The odometry that is believed, from scan to scan."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.belief.view import View
from firstfix.core.angles import angle_error
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.checked_odometry import CheckedOdometry
from firstfix.localizer.inputs import NewMap, PoseHint
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import TrackedPose

LIDAR = Lidar(beams=180, sigma_m=0.01)
IN_ODOM = SE2(-3.0, 7.0, 2.0)
FORWARDS = [(SE2(0.06, 0.0, 0.02), SE2(0.06, 0.0, 0.02))] * 8
# The robot backs; odometry has no sign.
BACK = [(SE2(-0.06, 0.0, 0.02), SE2(0.06, 0.0, 0.02))] * 12

Moves = list[tuple[SE2, SE2]]


def drive(world: OccupancyGrid, start: SE2, moves: Moves, period_s: float = 0.2):
    """Give views and true poses; each move is the true step and that of the odometry."""
    rng, pose, T_odom_base, stamp = np.random.default_rng(0), start, IN_ODOM, 10.0
    seen = [(View.of(LIDAR.scan(world, pose, rng, stamp), T_odom_base), pose)]
    for true, said in moves:
        pose, T_odom_base, stamp = pose @ true, T_odom_base @ said, stamp + period_s
        seen.append((View.of(LIDAR.scan(world, pose, rng, stamp), T_odom_base), pose))
    return seen


@pytest.fixture
def start(office, office_poses) -> SE2:
    return office_poses(office, 3, 5)[0]


def test_right_odometry_is_believed_to_the_last_bit(office, start):
    odometry = CheckedOdometry()
    for view, _ in drive(office, start, FORWARDS):
        checked = odometry.check(view)
        assert checked.T_odom_base == view.T_odom_base
        assert checked.scans is view.scans
        assert checked.unconfirmed == 0
    assert odometry.T_checked_odom == SE2.identity()


@pytest.mark.parametrize("period_s", [0.05, 0.1, 0.2])
def test_a_robot_that_backs_is_followed(office, start, period_s):
    odometry = CheckedOdometry()
    slow = [
        (SE2(*(period_s / 0.2 * true.as_array())), SE2(*(period_s / 0.2 * said.as_array())))
        for true, said in BACK
    ]
    seen = drive(office, start, slow, period_s)
    checked = [odometry.check(view) for view, _ in seen]
    moved = checked[0].T_odom_base.inverse() @ checked[-1].T_odom_base
    true = start.inverse() @ seen[-1][1]
    wrong = seen[0][0].T_odom_base.inverse() @ seen[-1][0].T_odom_base
    assert moved.distance_to(true) < 0.2 * wrong.distance_to(true)
    assert angle_error(moved.yaw, true.yaw) < math.radians(2.0)
    assert wrong.distance_to(true) > 5.0 * period_s


def test_the_correction_is_the_frame_of_the_odometry_in_the_one_that_is_believed(office, start):
    odometry = CheckedOdometry()
    for view, _ in drive(office, start, FORWARDS + BACK + FORWARDS):
        checked = odometry.check(view)
        raw = odometry.T_checked_odom @ view.T_odom_base
        assert raw.distance_to(checked.T_odom_base) < 1e-9
        assert angle_error(raw.yaw, checked.T_odom_base.yaw) < 1e-9


def test_steps_that_no_scan_confirms_are_counted(office, start):
    odometry, dark = CheckedOdometry(), Lidar(beams=180, range_max=0.2)
    lit = [view for view, _ in drive(office, start, FORWARDS)]
    for view in lit[:3]:
        assert odometry.check(view).unconfirmed == 0
    rng = np.random.default_rng(0)
    blind = View.of(dark.scan(office, start, rng, 20.0), lit[2].T_odom_base)
    assert odometry.check(blind).unconfirmed == 1


def test_after_a_restart_the_odometry_is_believed_as_it_comes(office, start):
    odometry = CheckedOdometry()
    views = [view for view, _ in drive(office, start, BACK)]
    for view in views:
        odometry.check(view)
    assert odometry.T_checked_odom != SE2.identity()
    count = odometry.check(views[-1]).unconfirmed
    odometry.restart()
    fresh = odometry.check(views[0])
    assert fresh.T_odom_base == views[0].T_odom_base
    assert fresh.unconfirmed == count + 1


def test_it_repeats(office, start):
    seen = [view for view, _ in drive(office, start, FORWARDS + BACK)]
    ends = []
    for _ in range(2):
        odometry = CheckedOdometry()
        ends.append([odometry.check(view).T_odom_base for view in seen])
    assert ends[0] == ends[1]


def test_a_localizer_keeps_the_pose_and_reports_the_drift_of_the_odometry_as_it_comes(
    office, start
):
    localizer = Localizer()
    localizer.handle(NewMap(0.0, office))
    localizer.handle(PoseHint(9.0, start))
    published = 0
    for view, true in drive(office, start, FORWARDS + BACK + BACK):
        outputs = localizer.handle(Odometry(view.stamp, view.T_odom_base))
        outputs += localizer.handle(view.scans[0])
        for output in outputs:
            if not isinstance(output, TrackedPose):
                continue
            published += output.stamp == view.stamp
            assert output.T_map_base.distance_to(true) < 0.1
            reached = output.T_map_odom @ view.T_odom_base
            assert reached.distance_to(output.T_map_base) < 1e-6
    assert published > 25


def test_after_a_jump_of_the_odometry_the_pose_goes_on_from_the_believed_one(office, start):
    localizer = Localizer()
    localizer.handle(NewMap(0.0, office))
    localizer.handle(PoseHint(9.0, start))
    seen = drive(office, start, FORWARDS + BACK + FORWARDS)
    jump = len(FORWARDS + BACK)
    for i, (view, true) in enumerate(seen):
        shift = SE2(50.0, 20.0, 1.0) if i > jump else SE2.identity()
        localizer.handle(Odometry(view.stamp - 0.001, shift @ view.T_odom_base))
        outputs = localizer.handle(Odometry(view.stamp, shift @ view.T_odom_base))
        outputs += localizer.handle(view.scans[0])
        poses = [output for output in outputs if isinstance(output, TrackedPose)]
        if i > jump:
            assert all(output.T_map_base.distance_to(true) < 0.1 for output in poses)
            reached = [each.T_map_odom @ (shift @ view.T_odom_base) for each in poses]
            assert all(pose.distance_to(true) < 0.1 for pose in reached)
    assert poses
