"""What messages mean: inputs, or one sentence why not."""

from types import SimpleNamespace as Message

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from recorder import T_BASE_LASER, Speaker

from firstfix.core.errors import InputError, MapError, ScanError
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import (
    laser_scan,
    occupancy_grid,
    odometry,
    pose_with_covariance,
    transforms,
)
from firstfix.lab.worlds.drawing import Drawing
from firstfix.localizer.inputs import NewMap, NoMotionUpdate, PoseHint, Reset
from firstfix.ros.channels import Channel
from firstfix.ros.exact_stamps import ExactStamps
from firstfix.ros.message_converter import MessageConverter
from firstfix.ros.node_config import NodeConfig


class Ear:
    """An converter, and what it has complained of."""

    def __init__(self, **settings) -> None:
        self.complaints: list[tuple[str, str]] = []
        self.converter = MessageConverter(NodeConfig(**settings), ExactStamps(), self._complain)
        self.take = self.converter.convert

    def _complain(self, subject: str, text: str) -> None:
        self.complaints.append((subject, text))

    @property
    def last(self) -> str:
        return self.complaints[-1][1]


@pytest.fixture
def ear():
    return Ear()


@pytest.fixture
def robot(wire, hall_plan):
    return Speaker(wire, hall_plan, SE2(4.0, 3.0, 1.0))


@pytest.fixture
def known(ear, robot):
    """A converter that has the pose of the laser, and odometry up to 100 s."""
    ear.take(Channel.TF_STATIC, robot.fixed())
    ear.take(Channel.TF, robot.tf())
    return ear


def kinds(inputs):
    return [type(given) for given in inputs]


# ---- odometry and scans


def test_transforms_are_odometry(ear, robot):
    assert ear.take(Channel.TF_STATIC, robot.fixed()) == []
    (reported,) = ear.take(Channel.TF, robot.tf())
    assert reported == Odometry(100.0, reported.T_odom_base)
    assert reported.T_odom_base.distance_to(robot.T_odom_base) < 1e-9
    assert ear.take(Channel.TF, robot.tf()) == []


def test_odometry_comes_from_its_topic_without_a_transform(ear, robot):
    message = robot.wire.sent(
        odometry(robot.wire.make, 5.0, "odom", "base_footprint", SE2(1.0, 2.0, 0.5))
    )
    (reported,) = ear.take(Channel.ODOM, message)
    assert (reported.stamp, reported.T_odom_base.x) == (5.0, 1.0)


def test_a_scan_has_the_pose_of_its_sensor_on_the_robot(known, robot):
    message = robot.scan()
    (scan,) = known.take(Channel.SCAN, message)
    assert isinstance(scan, LaserScan)
    assert scan.stamp == 100.0
    assert scan.T_base_laser.distance_to(T_BASE_LASER) < 1e-9
    assert_array_equal(scan.ranges, message.ranges)
    assert known.complaints == []


def test_the_slash_of_old_frames_does_not_matter(known, robot):
    assert kinds(known.take(Channel.SCAN, robot.scan("/laser"))) == [LaserScan]


def test_a_robot_that_is_fixed_to_its_odometry_stands_where_it_stood_at_each_scan(ear, robot):
    ear.take(Channel.TF_STATIC, robot.fixed())
    fixed = transforms(robot.wire.make, 0.0, "odom", "base_footprint", SE2.identity())
    ear.take(Channel.TF_STATIC, fixed)
    inputs = ear.take(Channel.SCAN, robot.scan())
    assert kinds(inputs) == [Odometry, LaserScan]
    assert [given.stamp for given in inputs] == [100.0, 100.0]


# ---- scans that are left out


def test_scans_before_any_odometry_are_counted_with_the_reason(ear, robot):
    assert ear.take(Channel.SCAN, robot.scan()) == []
    assert ear.take(Channel.SCAN, robot.scan()) == []
    assert ear.last == (
        "2 scans dropped so far; odometry (odom -> base_footprint) is unknown: "
        "no transform has the frame odom and base_footprint; known frames: none"
    )
    assert len({subject for subject, _ in ear.complaints}) == 1


def test_a_wrong_base_frame_names_those_that_there_are(robot):
    ear = Ear(base_frame_id="base_link")
    ear.take(Channel.TF, robot.tf())
    ear.take(Channel.SCAN, robot.scan())
    assert "no transform has the frame base_link; known frames: base_footprint, odom" in ear.last


def test_a_wrong_frame_of_the_laser_is_another_subject(known, robot):
    assert known.take(Channel.SCAN, robot.scan("lidar")) == []
    assert "the pose of the laser is unknown: no transform has the frame lidar" in known.last
    assert known.complaints[-1][0] == "the pose of the laser is unknown"


def test_a_scan_without_a_stamp_is_the_fault_of_its_driver(known, robot):
    robot.stamp = 0.0
    assert known.take(Channel.SCAN, robot.scan()) == []
    assert known.last == "1 scans dropped so far; a scan has no stamp: its driver must write one"


def test_scans_far_ahead_of_odometry_come_from_another_clock(known, robot):
    robot.stamp += 0.9
    assert kinds(known.take(Channel.SCAN, robot.scan())) == [LaserScan]
    assert known.complaints == []
    for _ in range(3):  # odometry may be late for a moment, such as after activation
        robot.stamp += 0.3
        assert kinds(known.take(Channel.SCAN, robot.scan())) == [LaserScan]
    assert known.complaints == []
    robot.stamp += 3600.0
    assert kinds(known.take(Channel.SCAN, robot.scan())) == [LaserScan]
    assert known.complaints == [
        ("lag", "odometry is 3601.8 s behind the scans: do the clocks agree?")
    ]


def test_a_scan_ahead_of_odometry_by_less_than_a_period_does_not_wait(known, robot):
    robot.move(SE2(0.01, 0.0, 0.0), 0.025)
    known.take(Channel.TF, robot.tf())
    robot.move(SE2(0.008, 0.0, 0.0), 0.02)
    odometry, scan = known.take(Channel.SCAN, robot.scan())
    assert (odometry.stamp, scan.stamp) == (robot.stamp, robot.stamp)
    assert odometry.T_odom_base.distance_to(robot.T_odom_base) < 1e-6


def test_a_message_that_is_no_scan_is_an_error_of_ours(known, robot):
    message = robot.scan()
    message.angle_increment = 0.0
    with pytest.raises(ScanError):
        known.take(Channel.SCAN, message)


# ---- a laser that moves on its robot


@pytest.fixture
def turret(wire, hall_plan):
    """A robot whose laser sits on a mast that turns."""

    class Turret(Speaker):
        def mast(self, stamp, yaw=0.0):
            return transforms(wire.make, stamp, "base_footprint", "laser", SE2(0.0, 0.0, yaw))

    return Turret(wire, hall_plan, SE2(4.0, 3.0, 1.0))


def test_a_scan_waits_for_the_place_of_a_moving_laser(ear, turret):
    ear.take(Channel.TF, turret.tf())
    ear.take(Channel.TF, turret.mast(99.9, 0.0))
    assert ear.take(Channel.SCAN, turret.scan()) == []
    (scan,) = ear.take(Channel.TF, turret.mast(100.1, 0.2))
    assert scan.stamp == 100.0
    assert scan.T_base_laser.yaw == pytest.approx(0.1, abs=1e-6)
    assert ear.take(Channel.TF, turret.mast(100.2)) == []
    assert ear.complaints == []


def test_of_scans_that_become_usable_together_the_newest_wins(ear, turret):
    ear.take(Channel.TF, turret.mast(99.9))
    ear.take(Channel.TF, turret.tf())
    for _ in range(3):
        turret.move()
        assert ear.take(Channel.SCAN, turret.scan()) == []
        assert kinds(ear.take(Channel.TF, turret.tf())) == [Odometry]
    (scan,) = ear.take(Channel.TF, turret.mast(turret.stamp))
    assert scan.stamp == turret.stamp
    assert ear.take(Channel.TF, turret.mast(turret.stamp + 1.0)) == []


def test_scans_that_wait_for_ever_are_reported_and_do_not_accumulate(ear, turret):
    ear.take(Channel.TF, turret.mast(50.0))
    ear.take(Channel.TF, turret.tf())
    for _ in range(100):
        ear.take(Channel.SCAN, turret.scan())
    assert len(ear.converter._waiting) == 40
    assert ear.last.startswith("60 scans dropped so far; the pose of the laser is unknown: ")
    assert "from base_footprint to laser is 50.000 s older than the scan" in ear.last


def test_a_waiting_scan_that_cannot_be_used_costs_no_odometry(ear, turret):
    ear.take(Channel.TF, turret.mast(99.9))
    ear.take(Channel.TF, turret.tf())
    bad = turret.scan()
    bad.range_max = 0.0
    ear.take(Channel.SCAN, bad)
    ear.take(Channel.TF, turret.mast(100.5))
    assert "a scan cannot be used: expected a range_max above range_min" in ear.last
    turret.move()
    assert kinds(ear.take(Channel.TF, turret.tf())) == [Odometry]


# ---- the clock


def test_a_clock_set_back_is_a_reset_then_odometry(known, robot):
    robot.stamp = 20.0
    reset, reported = known.take(Channel.TF, robot.tf())
    assert reset == Reset(20.0)
    assert isinstance(reported, Odometry)
    assert reported.stamp == 20.0
    assert known.complaints == [("clock", "time went back by 80.0 s: starting over")]
    assert kinds(known.take(Channel.SCAN, robot.scan())) == [LaserScan]


def test_a_clock_set_back_by_less_than_a_second_costs_one_scan_and_mixes_nothing(known, robot):
    T_odom_base = robot.T_odom_base
    assert kinds(known.take(Channel.SCAN, robot.scan())) == [LaserScan]
    robot.stamp, robot.T_odom_base = 99.4, T_odom_base @ SE2(0.2, 0.0, 0.5)
    assert known.take(Channel.TF, robot.tf()) == []  # it might have been overtaken
    assert known.take(Channel.SCAN, robot.scan()) == []
    assert "1 scans dropped so far; the clock was set back: scans by 0.60 s" in known.last
    robot.stamp = 99.42
    (reported,) = known.take(Channel.TF, robot.tf())
    assert reported.stamp == 99.42
    assert reported.T_odom_base.distance_to(robot.T_odom_base) < 1e-9
    assert kinds(known.take(Channel.SCAN, robot.scan())) == [LaserScan]


def test_scans_that_wait_when_the_clock_is_set_back_are_left_behind(ear, turret):
    ear.take(Channel.TF, turret.mast(99.9))
    ear.take(Channel.TF, turret.tf())
    assert ear.take(Channel.SCAN, turret.scan()) == []
    turret.stamp = 20.0
    assert kinds(ear.take(Channel.TF, turret.tf())) == [Reset, Odometry]
    assert ear.take(Channel.TF, turret.mast(21.0)) == []
    assert ear.take(Channel.TF, turret.mast(120.0)) == []


# ---- maps


def test_a_map_is_used_once_however_often_it_is_published(ear, robot):
    (given,) = ear.take(Channel.MAP, robot.map())
    assert isinstance(given, NewMap)
    assert given.stamp == 1.0
    assert_array_equal(given.grid.cells, robot.world.cells)
    assert ear.take(Channel.MAP, robot.map()) == []
    assert ear.complaints == []


def other_floor(robot):
    plan = Drawing(5.0, 5.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 4.0, 4.0)
    return occupancy_grid(robot.wire.make, 2.0, "map", plan.grid())


def test_another_map_is_another_floor(ear, robot):
    ear.take(Channel.MAP, robot.map())
    assert kinds(ear.take(Channel.MAP, other_floor(robot))) == [NewMap]
    assert kinds(ear.take(Channel.MAP, robot.map())) == [NewMap]


def test_only_the_first_map_counts_where_that_is_asked_for(robot):
    ear = Ear(first_map_only=True)
    assert kinds(ear.take(Channel.MAP, robot.map())) == [NewMap]
    assert ear.take(Channel.MAP, other_floor(robot)) == []


def test_a_map_that_could_not_be_searched_is_not_the_one_in_use(ear, robot):
    ear.take(Channel.MAP, robot.map())
    ear.take(Channel.MAP, other_floor(robot))
    ear.converter.restore_map()
    assert ear.take(Channel.MAP, robot.map()) == []
    first = Ear(first_map_only=True)
    first.take(Channel.MAP, other_floor(robot))
    first.converter.restore_map()
    assert kinds(first.take(Channel.MAP, robot.map())) == [NewMap]


def test_a_map_in_another_frame_is_used_and_reported(ear, robot):
    assert kinds(ear.take(Channel.MAP, robot.map("world"))) == [NewMap]
    assert ear.complaints == [("map frame", "the map is in 'world', not in 'map': used as it is")]


def test_a_message_that_is_no_map_is_an_error_of_ours(ear, robot):
    message = robot.map()
    message.info.width += 1
    with pytest.raises(MapError):
        ear.take(Channel.MAP, message)
    assert kinds(ear.take(Channel.MAP, robot.map())) == [NewMap]


# ---- people


def hint(robot, frame="map", stamp=5.0):
    make, T = robot.wire.make, SE2(1.0, 2.0, 0.5)
    return robot.wire.sent(pose_with_covariance(make, stamp, frame, T, np.eye(3)))


def test_a_hint_has_the_pose_of_initialpose(ear, robot):
    (given,) = ear.take(Channel.INITIAL_POSE, hint(robot))
    assert (given.stamp, given.source) == (5.0, "a person")
    assert given.T_map_base.distance_to(SE2(1.0, 2.0, 0.5)) < 1e-12
    assert kinds(ear.take(Channel.INITIAL_POSE, hint(robot, "/map"))) == [PoseHint]
    assert ear.complaints == []


def test_a_hint_without_a_stamp_is_of_now(known, robot):
    (given,) = known.take(Channel.INITIAL_POSE, hint(robot, stamp=0.0))
    assert given.stamp == 100.0


def test_a_hint_without_a_frame_is_taken_as_amcl_takes_it(ear, robot):
    assert kinds(ear.take(Channel.INITIAL_POSE, hint(robot, ""))) == [PoseHint]
    assert ear.last == "an initial pose names no frame: taken as in map"


def test_a_hint_in_another_frame_is_refused_with_a_remedy(ear, robot):
    with pytest.raises(InputError, match="received one in odom; set the fixed frame of the viewer"):
        ear.take(Channel.INITIAL_POSE, hint(robot, "odom"))


def test_a_hint_that_is_no_pose_is_an_error_of_ours(ear, robot):
    message = hint(robot)
    message.pose.pose.orientation.w = message.pose.pose.orientation.z = 0.0
    with pytest.raises(InputError):
        ear.take(Channel.INITIAL_POSE, message)


def test_requests_are_of_now(ear, known):
    assert known.take(Channel.RESET, None) == [Reset(100.0)]
    assert known.take(Channel.UPDATE, None) == [NoMotionUpdate(100.0)]
    assert Ear().take(Channel.RESET, None) == [Reset(0.0)]


def test_what_needs_no_conversion_is_passed_on(ear, hall_plan):
    given = Reset(3.0)
    assert ear.take(Channel.INPUT, given) == [given]
    assert kinds(ear.take(Channel.INPUT, NewMap(1.0, hall_plan))) == [NewMap]
    assert ear.take(Channel.INPUT, NewMap(2.0, hall_plan)) == []


# ---- events


@pytest.mark.parametrize(
    ("received", "name", "field", "kind"),
    [
        (Channel.CLIFF, "CliffEvent", "sensor", SignalKind.CLIFF),
        (Channel.WHEEL_DROP, "WheelDropEvent", "wheel", SignalKind.WHEEL_DROP),
        (Channel.BUMPER, "BumperEvent", "bumper", SignalKind.BUMPER),
    ],
)
def test_events_of_a_kobuki_are_signals(known, wire, received, name, field, kind):
    def event(state):
        more = {"bottom": 0} if received is Channel.CLIFF else {}
        return wire.sent(wire.make(f"kobuki/{name}", **{field: 1, "state": state}, **more))

    assert known.take(received, event(0)) == []
    assert known.take(received, event(1)) == [Signal(100.0, kind, active=True)]
    assert known.take(received, event(0)) == [Signal(100.0, kind, active=False)]
    assert known.take(received, event(0)) == []


def test_a_robot_stands_again_when_both_wheels_do(known):
    def wheel(which, state):
        (signal,) = known.take(Channel.WHEEL_DROP, Message(wheel=which, state=state))
        return signal.active

    assert [wheel(0, 1), wheel(1, 1), wheel(0, 0), wheel(1, 0)] == [True, True, True, False]


def test_a_requested_search_ends_the_lifted_state(known):
    """A base that was restarted in the air does not report that it was set down."""
    known.take(Channel.WHEEL_DROP, Message(wheel=0, state=1))
    known.take(Channel.RESET, None)
    known.take(Channel.WHEEL_DROP, Message(wheel=1, state=1))
    (signal,) = known.take(Channel.WHEEL_DROP, Message(wheel=1, state=0))
    assert not signal.active


def test_kinds_of_events_do_not_mix(known):
    known.take(Channel.WHEEL_DROP, Message(wheel=0, state=1))
    known.take(Channel.CLIFF, Message(sensor=0, state=1))
    (signal,) = known.take(Channel.CLIFF, Message(sensor=0, state=0))
    assert (signal.kind, signal.active) == (SignalKind.CLIFF, False)


def test_picked_up_is_a_signal_on_its_topic(known, wire):
    message = wire.sent(wire.make("std_msgs/Bool", data=True))
    assert known.take(Channel.KIDNAPPED, message) == [
        Signal(100.0, SignalKind.PICKED_UP, active=True)
    ]


def test_another_message_on_the_topic_of_an_event_is_an_error_of_ours(known):
    with pytest.raises(InputError):
        known.take(Channel.CLIFF, Message(data="false"))
    assert known.take(Channel.TF, Message(transforms=[])) == []


def test_a_scan_may_have_one_beam_or_thousands(known, robot):
    for ranges in (np.ones(1, np.float32), np.ones(4000, np.float32)):
        scan = LaserScan(ranges, -1.0, 0.001, 0.1, 10.0, stamp=100.0)
        message = robot.wire.sent(laser_scan(robot.wire.make, "laser", scan))
        (given,) = known.take(Channel.SCAN, message)
        assert len(given) == len(ranges)


def test_an_empty_scan_is_an_error_of_ours(known, robot):
    message = robot.scan()
    message.ranges = np.empty(0, np.float32)
    with pytest.raises(ScanError):
        known.take(Channel.SCAN, message)
