"""Scans that wait for their odometry."""

import numpy as np

from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.inputs import NewMap, Reset
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, TrackedPose
from firstfix.localizer.states import State


def poses_of(outputs):
    return [output for output in outputs if isinstance(output, (InitialPose, TrackedPose))]


def test_odometry_that_lags_by_several_scans_blocks_none(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    lag, tracked = [], []
    for _ in range(20):
        robot.stamp += 0.1
        lag.append(Odometry(robot.stamp, robot.T_odom_base))
        robot.send(robot.scan())
        if len(lag) > 3:  # 0.3 s late, three scans
            outputs = robot.send(lag.pop(0))
            tracked += [output.stamp for output in outputs if isinstance(output, TrackedPose)]
    assert len(tracked) == 17


def test_scans_that_wait_when_odometry_is_restarted_are_skipped(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    robot.stamp += 0.1
    robot.send(robot.scan())
    assert robot.send(Odometry(robot.stamp - 50.0, SE2.identity())) == []
    later = robot.send(Odometry(robot.stamp + 1.0, SE2.identity()))
    assert not any(isinstance(output, TrackedPose) for output in later)


def test_of_several_scans_that_odometry_reaches_at_once_the_newest_is_used(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    for _ in range(5):
        robot.stamp += 0.1
        assert robot.send(robot.scan()) == []
    tracked = poses_of(robot.send(Odometry(robot.stamp, robot.T_odom_base)))
    assert [pose.stamp for pose in tracked] == [robot.stamp]
    assert poses_of(robot.send(Odometry(robot.stamp + 1.0, robot.T_odom_base))) == []


def test_scans_do_not_pile_up_where_odometry_has_ended(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    for _ in range(100):
        robot.stamp += 0.1
        robot.send(robot.scan())
    assert len(robot.localizer._scans._instants) == 40
    (pose,) = poses_of(robot.send(Odometry(robot.stamp, robot.T_odom_base)))
    assert pose.stamp == robot.stamp


def test_a_scan_ahead_of_odometry_waits_while_older_ones_are_used(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    early = robot.stamp
    for stamp in (early + 0.1, early + 0.2, early + 5.0):
        robot.stamp = stamp
        robot.send(robot.scan())
    (pose,) = poses_of(robot.send(Odometry(early + 0.3, robot.T_odom_base)))
    assert pose.stamp == early + 0.2
    (pose,) = poses_of(robot.send(Odometry(early + 5.5, robot.T_odom_base)))
    assert pose.stamp == early + 5.0


def test_a_scan_with_a_stamp_from_the_future_holds_up_no_other(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    now, robot.stamp = robot.stamp, 1e6
    assert robot.send(robot.scan()) == []
    robot.stamp = now
    assert [pose.stamp for pose in poses_of(robot.tick())] == [robot.stamp]


# ---- scans of a lifted robot


def lifted(robot, *, active):
    return robot.send(Signal(robot.stamp, SignalKind.WHEEL_DROP, active=active))


def test_a_scan_taken_in_the_air_is_ignored_after_landing(robot_in, hall_plan):
    """It came late, or odometry did."""
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    lifted(robot, active=True)
    robot.stamp += 0.1
    waited, late = robot.scan(), robot.scan()
    robot.send(waited)
    robot.stamp += 0.1
    lifted(robot, active=False)
    assert poses_of(robot.send(Odometry(robot.stamp, robot.T_odom_base))) == []
    assert robot.send(late) == []
    assert robot.localizer.state is State.SEARCHING
    found = robot.send(robot.scan())  # at the moment of landing
    assert [pose.stamp for pose in poses_of(found)] == [robot.stamp] * 2


def test_a_robot_that_landed_before_its_map_came(hall_plan):
    localizer = Localizer()
    localizer.handle(Odometry(100.0, SE2.identity()))
    for stamp, active in ((100.0, True), (101.0, False)):
        localizer.handle(Signal(stamp, SignalKind.PICKED_UP, active=active))
    localizer.handle(NewMap(0.0, hall_plan))
    localizer.handle(Odometry(103.0, SE2.identity()))
    rng, pose = np.random.default_rng(0), SE2(1.5, 1.5, 0.0)
    assert localizer.handle(Lidar(beams=180).scan(hall_plan, pose, rng, 100.5)) == []
    assert len(localizer.handle(Lidar(beams=180).scan(hall_plan, pose, rng, 102.0))) == 3


def test_a_robot_that_landed_before_the_clock_was_set_back_is_found_by_the_new_time(
    robot_in, hall_plan
):
    """Otherwise it would ignore all scans until the old time comes again."""
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    lifted(robot, active=True)
    lifted(robot, active=False)
    robot.stamp = 5.0
    robot.send(Reset(5.0))
    robot.send(Odometry(5.0, robot.T_odom_base))
    assert poses_of(robot.send(robot.scan())) != []


def test_a_reset_ends_the_lifted_state(robot_in, hall_plan):
    """Its base was restarted in the air and never reports that it was set down."""
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    lifted(robot, active=True)
    assert robot.tick() == []
    robot.send(Reset(robot.stamp))
    assert poses_of(robot.tick()) != []
