"""Scans that wait for their odometry."""

from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.system.outputs import TrackedPose


def test_odometry_that_lags_by_several_scans_starves_none(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    lag, tracked = [], []
    for _ in range(20):
        robot.stamp += 0.1
        lag.append(Odometry(robot.stamp, robot.T_odom_base))
        robot.tell(robot.scan())
        if len(lag) > 3:  # 0.3 s late, three scans
            outputs = robot.tell(lag.pop(0))
            tracked += [output.stamp for output in outputs if isinstance(output, TrackedPose)]
    assert len(tracked) == 17


def test_what_waits_when_odometry_is_restarted_is_left_out(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(1.5, 1.5, 0.0))
    robot.tick()
    robot.stamp += 0.1
    robot.tell(robot.scan())
    assert robot.tell(Odometry(robot.stamp - 50.0, SE2.identity())) == []
    later = robot.tell(Odometry(robot.stamp + 1.0, SE2.identity()))
    assert not any(isinstance(output, TrackedPose) for output in later)
