"""What messages mean: inputs, or one sentence why not."""

import numpy as np
import pytest
from node_lab import Converter
from numpy.testing import assert_array_equal
from recorder import T_BASE_LASER, Speaker

from firstfix.core.errors import InputError, MapError, ScanError
from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import (
    occupancy_grid,
    odometry,
    pose_with_covariance,
    transforms,
)
from firstfix.lab.worlds.drawing import Drawing
from firstfix.localizer.inputs import NewMap, NoMotionUpdate, PoseHint, Reset
from firstfix.ros.channels import Channel


@pytest.fixture
def robot(wire, hall_plan):
    return Speaker(wire, hall_plan, SE2(4.0, 3.0, 1.0))


@pytest.fixture
def known(converter, robot):
    """A converter that has the pose of the laser, and odometry up to 100 s."""
    converter.convert(Channel.TF_STATIC, robot.fixed())
    converter.convert(Channel.TF, robot.tf())
    return converter


def kinds(inputs):
    return [type(given) for given in inputs]


# ---- odometry and scans


def test_transforms_are_odometry(converter, robot):
    assert converter.convert(Channel.TF_STATIC, robot.fixed()) == []
    (reported,) = converter.convert(Channel.TF, robot.tf())
    assert reported == Odometry(100.0, reported.T_odom_base)
    assert reported.T_odom_base.distance_to(robot.T_odom_base) < 1e-9
    assert converter.convert(Channel.TF, robot.tf()) == []


def test_odometry_comes_from_its_topic_without_a_transform(converter, robot):
    message = robot.wire.sent(
        odometry(robot.wire.make, 5.0, "odom", "base_footprint", SE2(1.0, 2.0, 0.5))
    )
    (reported,) = converter.convert(Channel.ODOM, message)
    assert (reported.stamp, reported.T_odom_base.x) == (5.0, 1.0)


def test_a_scan_has_the_pose_of_its_sensor_on_the_robot(known, robot):
    message = robot.scan()
    (scan,) = known.convert(Channel.SCAN, message)
    assert isinstance(scan, LaserScan)
    assert scan.stamp == 100.0
    assert scan.T_base_laser.distance_to(T_BASE_LASER) < 1e-9
    assert_array_equal(scan.ranges, message.ranges)
    assert known.warnings == []


def test_the_slash_of_old_frames_does_not_matter(known, robot):
    assert kinds(known.convert(Channel.SCAN, robot.scan("/laser"))) == [LaserScan]


def test_a_robot_that_is_fixed_to_its_odometry_stands_where_it_stood_at_each_scan(converter, robot):
    converter.convert(Channel.TF_STATIC, robot.fixed())
    fixed = transforms(robot.wire.make, 0.0, "odom", "base_footprint", SE2.identity())
    converter.convert(Channel.TF_STATIC, fixed)
    inputs = converter.convert(Channel.SCAN, robot.scan())
    assert kinds(inputs) == [Odometry, LaserScan]
    assert [given.stamp for given in inputs] == [100.0, 100.0]


# ---- scans that are left out


def test_scans_before_any_odometry_are_counted_with_the_reason(converter, robot):
    assert converter.convert(Channel.SCAN, robot.scan()) == []
    assert converter.convert(Channel.SCAN, robot.scan()) == []
    assert converter.last == (
        "2 scans dropped so far; odometry (odom -> base_footprint) is unknown: "
        "no transform has the frame odom and base_footprint; known frames: none"
    )
    assert len({subject for subject, _ in converter.warnings}) == 1


def test_a_wrong_base_frame_names_those_that_there_are(robot):
    converter = Converter(base_frame_id="base_link")
    converter.convert(Channel.TF, robot.tf())
    converter.convert(Channel.SCAN, robot.scan())
    assert (
        "no transform has the frame base_link; known frames: base_footprint, odom" in converter.last
    )


def test_a_wrong_frame_of_the_laser_is_a_separate_warning(known, robot):
    assert known.convert(Channel.SCAN, robot.scan("lidar")) == []
    assert "the pose of the laser is unknown: no transform has the frame lidar" in known.last
    assert known.warnings[-1][0] == "the pose of the laser is unknown"


def test_a_scan_without_a_stamp_is_reported_with_its_driver(known, robot):
    robot.stamp = 0.0
    assert known.convert(Channel.SCAN, robot.scan()) == []
    assert known.last == "1 scans dropped so far; a scan has no stamp: its driver must write one"


def test_scans_far_ahead_of_odometry_come_from_another_clock(known, robot):
    robot.stamp += 0.9
    assert kinds(known.convert(Channel.SCAN, robot.scan())) == [LaserScan]
    assert known.warnings == []
    for _ in range(3):  # odometry may be late for a moment, such as after activation
        robot.stamp += 0.3
        assert kinds(known.convert(Channel.SCAN, robot.scan())) == [LaserScan]
    assert known.warnings == []
    robot.stamp += 3600.0
    assert kinds(known.convert(Channel.SCAN, robot.scan())) == [LaserScan]
    assert known.warnings == [
        ("lag", "odometry is 3601.8 s behind the scans: do the clocks agree?")
    ]


def test_a_scan_ahead_of_odometry_by_less_than_a_period_does_not_wait(known, robot):
    robot.move(SE2(0.01, 0.0, 0.0), 0.025)
    known.convert(Channel.TF, robot.tf())
    robot.move(SE2(0.008, 0.0, 0.0), 0.02)
    odometry, scan = known.convert(Channel.SCAN, robot.scan())
    assert (odometry.stamp, scan.stamp) == (robot.stamp, robot.stamp)
    assert odometry.T_odom_base.distance_to(robot.T_odom_base) < 1e-6


def test_an_invalid_scan_is_an_error_of_ours(known, robot):
    message = robot.scan()
    message.angle_increment = 0.0
    with pytest.raises(ScanError):
        known.convert(Channel.SCAN, message)


# ---- a laser that moves on its robot


@pytest.fixture
def turret(wire, hall_plan):
    """A robot whose laser sits on a mast that turns."""

    class Turret(Speaker):
        def mast(self, stamp, yaw=0.0):
            return transforms(wire.make, stamp, "base_footprint", "laser", SE2(0.0, 0.0, yaw))

    return Turret(wire, hall_plan, SE2(4.0, 3.0, 1.0))


def test_a_scan_waits_for_the_place_of_a_moving_laser(converter, turret):
    converter.convert(Channel.TF, turret.tf())
    converter.convert(Channel.TF, turret.mast(99.9, 0.0))
    assert converter.convert(Channel.SCAN, turret.scan()) == []
    (scan,) = converter.convert(Channel.TF, turret.mast(100.1, 0.2))
    assert scan.stamp == 100.0
    assert scan.T_base_laser.yaw == pytest.approx(0.1, abs=1e-6)
    assert converter.convert(Channel.TF, turret.mast(100.2)) == []
    assert converter.warnings == []


def test_of_scans_that_become_usable_together_the_newest_wins(converter, turret):
    converter.convert(Channel.TF, turret.mast(99.9))
    converter.convert(Channel.TF, turret.tf())
    for _ in range(3):
        turret.move()
        assert converter.convert(Channel.SCAN, turret.scan()) == []
        assert kinds(converter.convert(Channel.TF, turret.tf())) == [Odometry]
    (scan,) = converter.convert(Channel.TF, turret.mast(turret.stamp))
    assert scan.stamp == turret.stamp
    assert converter.convert(Channel.TF, turret.mast(turret.stamp + 1.0)) == []


def test_scans_that_wait_for_ever_are_reported_and_do_not_accumulate(converter, turret):
    converter.convert(Channel.TF, turret.mast(50.0))
    converter.convert(Channel.TF, turret.tf())
    for _ in range(100):
        converter.convert(Channel.SCAN, turret.scan())
    assert converter.waiting == 40
    assert converter.last.startswith("60 scans dropped so far; the pose of the laser is unknown: ")
    assert "from base_footprint to laser is 50.000 s older than the scan" in converter.last


def test_a_waiting_scan_that_cannot_be_used_costs_no_odometry(converter, turret):
    converter.convert(Channel.TF, turret.mast(99.9))
    converter.convert(Channel.TF, turret.tf())
    bad = turret.scan()
    bad.range_max = 0.0
    converter.convert(Channel.SCAN, bad)
    converter.convert(Channel.TF, turret.mast(100.5))
    assert "a scan cannot be used: expected a range_max above range_min" in converter.last
    turret.move()
    assert kinds(converter.convert(Channel.TF, turret.tf())) == [Odometry]


# ---- the clock


def test_a_clock_set_back_is_a_reset_then_odometry(known, robot):
    robot.stamp = 20.0
    reset, reported = known.convert(Channel.TF, robot.tf())
    assert reset == Reset(20.0)
    assert isinstance(reported, Odometry)
    assert reported.stamp == 20.0
    assert known.warnings == [("clock", "time went back by 80.0 s: starting over")]
    assert kinds(known.convert(Channel.SCAN, robot.scan())) == [LaserScan]


def test_a_clock_set_back_by_less_than_a_second_costs_one_scan_and_mixes_no_odometry(known, robot):
    T_odom_base = robot.T_odom_base
    assert kinds(known.convert(Channel.SCAN, robot.scan())) == [LaserScan]
    robot.stamp, robot.T_odom_base = 99.4, T_odom_base @ SE2(0.2, 0.0, 0.5)
    assert known.convert(Channel.TF, robot.tf()) == []  # it might have been overtaken
    assert known.convert(Channel.SCAN, robot.scan()) == []
    assert "1 scans dropped so far; the clock was set back: scans by 0.60 s" in known.last
    robot.stamp = 99.42
    (reported,) = known.convert(Channel.TF, robot.tf())
    assert reported.stamp == 99.42
    assert reported.T_odom_base.distance_to(robot.T_odom_base) < 1e-9
    assert kinds(known.convert(Channel.SCAN, robot.scan())) == [LaserScan]


def test_scans_that_wait_when_the_clock_is_set_back_are_discarded(converter, turret):
    converter.convert(Channel.TF, turret.mast(99.9))
    converter.convert(Channel.TF, turret.tf())
    assert converter.convert(Channel.SCAN, turret.scan()) == []
    turret.stamp = 20.0
    assert kinds(converter.convert(Channel.TF, turret.tf())) == [Reset, Odometry]
    assert converter.convert(Channel.TF, turret.mast(21.0)) == []
    assert converter.convert(Channel.TF, turret.mast(120.0)) == []


# ---- maps


def test_a_map_is_used_once_however_often_it_is_published(converter, robot):
    (given,) = converter.convert(Channel.MAP, robot.map())
    assert isinstance(given, NewMap)
    assert given.stamp == 1.0
    assert_array_equal(given.grid.cells, robot.world.cells)
    assert converter.convert(Channel.MAP, robot.map()) == []
    assert converter.warnings == []


def other_floor(robot):
    plan = Drawing(5.0, 5.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 4.0, 4.0)
    return occupancy_grid(robot.wire.make, 2.0, "map", plan.grid())


def test_a_different_map_is_a_new_map(converter, robot):
    converter.convert(Channel.MAP, robot.map())
    assert kinds(converter.convert(Channel.MAP, other_floor(robot))) == [NewMap]
    assert kinds(converter.convert(Channel.MAP, robot.map())) == [NewMap]


def test_only_the_first_map_counts_where_that_is_asked_for(robot):
    converter = Converter(first_map_only=True)
    assert kinds(converter.convert(Channel.MAP, robot.map())) == [NewMap]
    assert converter.convert(Channel.MAP, other_floor(robot)) == []


def test_a_map_that_could_not_be_searched_is_not_the_one_in_use(converter, robot):
    converter.convert(Channel.MAP, robot.map())
    converter.convert(Channel.MAP, other_floor(robot))
    converter.restore_map()
    assert converter.convert(Channel.MAP, robot.map()) == []
    first = Converter(first_map_only=True)
    first.convert(Channel.MAP, other_floor(robot))
    first.restore_map()
    assert kinds(first.convert(Channel.MAP, robot.map())) == [NewMap]


def test_a_map_in_another_frame_is_used_and_reported(converter, robot):
    assert kinds(converter.convert(Channel.MAP, robot.map("world"))) == [NewMap]
    assert converter.warnings == [
        ("map frame", "the map is in 'world', not in 'map': used as it is")
    ]


def test_an_invalid_map_is_an_error_of_ours(converter, robot):
    message = robot.map()
    message.info.width += 1
    with pytest.raises(MapError):
        converter.convert(Channel.MAP, message)
    assert kinds(converter.convert(Channel.MAP, robot.map())) == [NewMap]


# ---- people


def hint(robot, frame="map", stamp=5.0):
    make, T = robot.wire.make, SE2(1.0, 2.0, 0.5)
    return robot.wire.sent(pose_with_covariance(make, stamp, frame, T, np.eye(3)))


def test_a_hint_has_the_pose_of_initialpose(converter, robot):
    (given,) = converter.convert(Channel.INITIAL_POSE, hint(robot))
    assert (given.stamp, given.source) == (5.0, "a person")
    assert given.T_map_base.distance_to(SE2(1.0, 2.0, 0.5)) < 1e-12
    assert kinds(converter.convert(Channel.INITIAL_POSE, hint(robot, "/map"))) == [PoseHint]
    assert converter.warnings == []


def test_a_hint_without_a_stamp_gets_the_present_time(known, robot):
    (given,) = known.convert(Channel.INITIAL_POSE, hint(robot, stamp=0.0))
    assert given.stamp == 100.0


def test_a_hint_without_a_frame_is_read_as_in_amcl(converter, robot):
    assert kinds(converter.convert(Channel.INITIAL_POSE, hint(robot, ""))) == [PoseHint]
    assert converter.last == "an initial pose names no frame: taken as in map"


def test_a_hint_in_another_frame_is_refused_with_a_remedy(converter, robot):
    with pytest.raises(InputError, match="received one in odom; set the fixed frame of the viewer"):
        converter.convert(Channel.INITIAL_POSE, hint(robot, "odom"))


def test_an_invalid_hint_is_an_error_of_ours(converter, robot):
    message = hint(robot)
    message.pose.pose.orientation.w = message.pose.pose.orientation.z = 0.0
    with pytest.raises(InputError):
        converter.convert(Channel.INITIAL_POSE, message)


def test_requests_have_the_present_time(converter, known):
    assert known.convert(Channel.RESET, None) == [Reset(100.0)]
    assert known.convert(Channel.UPDATE, None) == [NoMotionUpdate(100.0)]
    assert Converter().convert(Channel.RESET, None) == [Reset(0.0)]


def test_inputs_that_need_no_conversion_are_passed_on(converter, hall_plan):
    given = Reset(3.0)
    assert converter.convert(Channel.INPUT, given) == [given]
    assert kinds(converter.convert(Channel.INPUT, NewMap(1.0, hall_plan))) == [NewMap]
    assert converter.convert(Channel.INPUT, NewMap(2.0, hall_plan)) == []
