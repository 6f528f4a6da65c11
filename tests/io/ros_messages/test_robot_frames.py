"""Odometry and the pose of the sensor, from the messages of a robot."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import ScanError
from firstfix.core.odometry import Odometry
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import StampedTransform
from firstfix.io.ros_messages.robot_frames import RobotFrames
from firstfix.io.ros_messages.sensor_place import place_of
from firstfix.io.ros_messages.tf_buffer import LookupFailure

LEVEL = (0.0, 0.0, 0.0, 1.0)


def link(parent, child, stamp=0.0, x=0.0, q=LEVEL):
    return StampedTransform(parent, child, stamp, (x, 0.0, 0.0), q)


def driven(stamp, parent="odom", child="base"):
    """Drive 1 m a second."""
    return link(parent, child, stamp, stamp)


@pytest.fixture
def frames():
    return RobotFrames("odom", "base")


def laser_at(frames, frame, stamp):
    return place_of(frame, frames.sensor_at(frame, stamp))


def new_odometry(frames):
    return [(each.stamp, each.T_odom_base.x) for each in frames.new_odometry()]


# ---- odometry by tf


def test_without_messages_nothing_is_known(frames):
    assert isinstance(frames.reach, LookupFailure)
    assert frames.new_odometry() == []
    assert frames.odometry_at(1.0) == []
    assert frames.known_until == -math.inf
    assert isinstance(frames.sensor_at("laser", 1.0), LookupFailure)


def test_each_transform_gives_odometry_once(frames):
    for stamp in (1.0, 1.02, 1.04):
        assert frames.add_moving([driven(stamp)]) == 0.0
        assert frames.new_odometry() == [Odometry(stamp, SE2(stamp, 0.0, 0.0))]
        assert frames.new_odometry() == []
        assert (frames.reach, frames.known_until) == (stamp, stamp)


def test_other_transforms_give_no_odometry(frames):
    frames.add_moving([driven(1.0)])
    frames.new_odometry()
    frames.add_moving([driven(2.0, "base", "wheel"), driven(2.0, "map", "odom")])
    assert frames.new_odometry() == []


def test_of_two_moving_links_the_slower_one_sets_the_pace(frames):
    frames.add_moving([driven(1.0, "odom", "mid"), driven(1.0, "mid", "base")])
    assert new_odometry(frames) == [(1.0, 2.0)]
    frames.add_moving([driven(2.0, "odom", "mid")])
    assert new_odometry(frames) == []
    frames.add_moving([driven(1.5, "mid", "base")])
    assert new_odometry(frames) == [(1.5, 3.0)]


def test_odometry_through_a_fixed_link(frames):
    frames.add_static([link("foot", "base", x=0.5)])
    frames.add_moving([driven(1.0, "odom", "foot")])
    assert new_odometry(frames) == [(1.0, 1.5)]


def test_a_robot_that_is_fixed_to_its_odometry_is_asked_at_its_scans(frames):
    frames.add_static([link("odom", "base", x=3.0)])
    assert frames.reach == math.inf
    assert frames.new_odometry() == []
    assert frames.odometry_at(7.0) == [Odometry(7.0, SE2(3.0, 0.0, 0.0))]
    assert frames.known_until == 7.0


def test_a_late_message_gives_no_odometry_but_fills_a_gap(frames):
    frames.add_moving([driven(1.0)])
    frames.add_moving([link("odom", "base", 2.0, x=9.0)])
    assert new_odometry(frames) == [(2.0, 9.0)]
    assert frames.add_moving([driven(1.5)]) == 0.0
    assert new_odometry(frames) == []
    assert frames.odometry_at(1.5)[0].T_odom_base.x == 1.5


@given(st.lists(st.floats(0.0, 0.5), min_size=1, max_size=20))
def test_stamps_of_odometry_increase_for_any_order_of_messages(delays):
    frames = RobotFrames("odom", "base")
    stamps = []
    sent = [0.1 * i for i in range(len(delays))]
    for i in sorted(range(len(delays)), key=lambda i: sent[i] + delays[i]):
        assert frames.add_moving([driven(sent[i])]) == 0.0
        stamps += [stamp for stamp, _ in new_odometry(frames)]
    assert stamps == sorted(set(stamps))
    assert stamps[-1] == sent[-1]


# ---- the clock


def test_a_clock_set_back_is_reported_and_moving_frames_are_discarded(frames):
    frames.add_static([link("base", "laser", x=0.2)])
    frames.add_moving([driven(100.0)])
    frames.new_odometry()
    assert frames.add_moving([driven(40.0)]) == pytest.approx(60.0)
    assert frames.known_until == -math.inf
    assert new_odometry(frames) == [(40.0, 40.0)]
    assert frames.odometry_at(100.0) == []
    assert laser_at(frames, "laser", 40.0).T_base_laser == SE2(0.2, 0.0, 0.0)
    assert frames.add_moving([driven(40.1)]) == 0.0
    assert new_odometry(frames) == [(40.1, 40.1)]


def test_one_second_back_is_not_a_clock_set_back(frames):
    frames.add_moving([driven(100.0)])
    frames.new_odometry()
    assert frames.add_moving([driven(99.0)]) == 0.0
    assert frames.odometry_at(100.0) != []


def test_a_clock_set_back_a_little_is_detected_from_scans_and_odometry_together(frames):
    frames.add_static([link("base", "laser", x=0.2)])
    for stamp in (100.0, 100.1, 100.2):
        frames.add_moving([driven(stamp)])
        frames.new_odometry()
        assert frames.clock_step_at_scan(stamp) == 0.0
    # The clock was set back by 0.15 s, the robot drives on.
    assert frames.add_moving([link("odom", "base", 100.12, 100.27)]) == 0.0
    assert new_odometry(frames) == []
    assert frames.clock_step_at_scan(100.12) == pytest.approx(0.08)
    assert (frames.known_until, frames.odometry_at(100.1)) == (-math.inf, [])
    frames.add_moving([link("odom", "base", 100.14, 100.29)])
    assert new_odometry(frames) == [(100.14, 100.29)]
    assert laser_at(frames, "laser", 100.14).T_base_laser == SE2(0.2, 0.0, 0.0)
    assert frames.clock_step_at_scan(100.14) == 0.0
    assert frames.odometry_at(100.2) == []


@pytest.mark.parametrize("older", [100.1, 100.16, 100.3])
def test_a_late_laser_of_two_does_not_set_the_clock_back(frames, older):
    for i in range(5):
        frames.add_moving([driven(100.2 + 0.1 * i)])
        frames.new_odometry()
        assert frames.clock_step_at_scan(100.2 + 0.1 * i) == 0.0
        assert frames.clock_step_at_scan(older - 0.1 + 0.1 * i) == 0.0
    assert frames.odometry_at(100.3) != []


def test_late_odometry_does_not_set_the_clock_back(frames):
    frames.add_moving([driven(100.0)])
    frames.add_moving([driven(100.4)])
    frames.new_odometry()
    frames.clock_step_at_scan(100.3)
    frames.add_moving([driven(100.2)])
    assert frames.clock_step_at_scan(100.4) == 0.0
    assert frames.odometry_at(100.1) != []


def test_only_odometry_advances_the_time(frames):
    """AMCL dates its transforms ahead, and another robot's clock is no concern of this one."""
    frames.add_moving(
        [driven(100.0), driven(105.0, "map", "odom"), driven(100.0, "base", "camera")]
    )
    frames.new_odometry()
    others = [driven(100.1, "map", "odom"), driven(5.0, "base", "camera"), driven(5.0, "x", "y")]
    assert frames.add_moving(others) == 0.0
    assert frames.odometry_at(100.0) != []


# ---- odometry by its topic


def test_the_topic_is_used_where_tf_has_no_odometry(frames):
    frames.add_moving([driven(1.0, "map", "odom")])
    assert frames.add_odometry(driven(1.0)) == 0.0
    assert new_odometry(frames) == [(1.0, 1.0)]
    frames.add_odometry(driven(2.0))
    assert frames.odometry_at(1.5) == [Odometry(1.5, SE2(1.5, 0.0, 0.0))]


def test_tf_takes_over_and_is_not_mixed_with_the_topic(frames):
    frames.add_odometry(link("odom", "base", 1.0, x=7.0))
    assert new_odometry(frames) == [(1.0, 7.0)]
    frames.add_moving([driven(1.5)])
    assert new_odometry(frames) == [(1.5, 1.5)]
    assert frames.odometry_at(1.25) == []
    assert frames.add_odometry(link("odom", "base", 3.0, x=7.0)) == 0.0
    assert (frames.reach, new_odometry(frames)) == (1.5, [])
    frames.add_moving([driven(2.0)])
    assert new_odometry(frames) == [(2.0, 2.0)]


def test_where_tf_moves_the_base_below_another_frame_the_topic_goes_on(frames):
    """A filter publishes odom_combined -> base, and odom is only a topic."""
    stamps = []
    for i in range(1, 6):
        frames.add_moving([driven(float(i), "odom_combined", "base")])
        frames.add_odometry(driven(i + 0.5))
        assert frames.reach == i + 0.5
        stamps += [stamp for stamp, _ in new_odometry(frames)]
    assert stamps == [1.5, 2.5, 3.5, 4.5, 5.5]
    assert frames.odometry_at(3.0) == [Odometry(3.0, SE2(3.0, 0.0, 0.0))]


def test_the_topic_may_move_another_frame_of_the_robot(frames):
    frames.add_static([link("base", "base_link", x=0.5)])
    frames.add_odometry(driven(1.0, child="base_link"))
    assert new_odometry(frames) == [(1.0, 0.5)]


def test_a_topic_without_a_child_moves_the_base(frames):
    frames.add_odometry(driven(1.0, child=""))
    assert new_odometry(frames) == [(1.0, 1.0)]


def test_a_topic_of_another_frame_is_named(frames):
    frames.add_odometry(driven(1.0, "wheel_odom"))
    assert isinstance(frames.reach, LookupFailure)
    assert "odom" in frames.reach.why
    assert "wheel_odom" in frames.reach.why
    assert frames.new_odometry() == []


def test_the_topic_reports_a_clock_set_back_too(frames):
    frames.add_odometry(driven(100.0))
    frames.new_odometry()
    assert frames.add_odometry(driven(40.0)) == pytest.approx(60.0)
    assert new_odometry(frames) == [(40.0, 40.0)]


def test_a_source_that_takes_over_is_not_compared_with_the_one_before(frames):
    for i in range(101):
        assert frames.add_odometry(driven(0.02 * i)) == 0.0
        frames.new_odometry()
    for i in range(100):
        assert frames.add_moving([driven(0.02 * i)]) == 0.0
        assert new_odometry(frames) == []
    assert frames.add_moving([driven(2.02)]) == 0.0
    assert new_odometry(frames) == [(2.02, 2.02)]


# ---- extrapolation


def extrapolated(frames, stamp):
    return [(each.stamp, each.T_odom_base.x) for each in frames.extrapolated(stamp)]


def test_odometry_is_extrapolated_by_one_period_at_its_last_velocity(frames):
    frames.add_moving([driven(1.0)])
    frames.new_odometry()
    assert extrapolated(frames, 1.01) == []  # no velocity yet
    frames.add_moving([driven(1.025)])
    frames.new_odometry()
    assert extrapolated(frames, 1.0251 + 0.025) == []
    assert extrapolated(frames, 1.025) == []
    assert extrapolated(frames, 1.045) == [(1.045, pytest.approx(1.045))]
    assert frames.known_until == 1.045


def test_slow_odometry_is_extrapolated_by_a_twentieth_of_a_second_at_most(frames):
    for stamp in (1.0, 2.0):
        frames.add_moving([driven(stamp)])
        frames.new_odometry()
    assert extrapolated(frames, 2.06) == []
    assert extrapolated(frames, 2.05) == [(2.05, pytest.approx(2.05))]


def test_measured_odometry_replaces_what_was_extrapolated(frames):
    for stamp in (1.0, 1.025):
        frames.add_moving([driven(stamp)])
        frames.new_odometry()
    frames.extrapolated(1.05)
    frames.add_moving([link("odom", "base", 1.05, x=1.3)])
    assert new_odometry(frames) == [(1.05, 1.3)]
    frames.extrapolated(1.06)
    frames.add_moving([link("odom", "base", 1.055, x=1.4)])
    assert new_odometry(frames) == []  # odometry never goes back
    frames.add_moving([driven(1.08)])
    assert new_odometry(frames) == [(1.08, 1.08)]


def test_a_turning_robot_is_extrapolated_in_its_own_frame(frames):
    quarter = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))
    frames.add_moving([link("odom", "base", 1.0, q=quarter)])
    frames.new_odometry()
    moved = link("odom", "base", 1.04, q=quarter)._replace(translation=(0.0, 0.4, 0.0))
    frames.add_moving([moved])
    frames.new_odometry()
    (odometry,) = frames.extrapolated(1.06)
    assert (odometry.T_odom_base.x, odometry.T_odom_base.y) == pytest.approx((0.0, 0.6))


# ---- the sensor


def test_a_sensor_on_a_moving_mast_is_asked_at_the_stamp_of_its_scan(frames):
    frames.add_static([link("mast", "laser", x=0.1)])
    frames.add_moving([driven(1.0, "base", "mast"), driven(2.0, "base", "mast")])
    assert laser_at(frames, "laser", 1.5).T_base_laser.x == pytest.approx(1.6)
    later = frames.sensor_at("laser", 2.5)
    assert isinstance(later, LookupFailure)
    assert later.later


def test_a_sensor_upside_down_and_a_tilted_one(frames):
    frames.add_static([link("base", "under", q=(1.0, 0.0, 0.0, 0.0))])
    assert laser_at(frames, "under", 1.0).mounting is Mounting.UPSIDE_DOWN
    half = math.radians(45.0) / 2
    frames.add_static([link("base", "tilted", q=(0.0, math.sin(half), 0.0, math.cos(half)))])
    with pytest.raises(ScanError, match="tilted by 45°"):
        laser_at(frames, "tilted", 1.0)


def test_scans_in_the_frame_of_the_base_need_no_transform(frames):
    assert laser_at(frames, "base", 1.0).T_base_laser == SE2.identity()
