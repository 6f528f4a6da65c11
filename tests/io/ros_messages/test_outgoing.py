"""Core types to messages, over the wire, and back."""

import array
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from firstfix.core.angles import angle_error
from firstfix.core.grid import UNKNOWN, OccupancyGrid
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import (
    to_grid,
    to_laser_scan,
    to_odometry,
    to_planar,
    to_pose,
    to_seconds,
    to_transform,
)
from firstfix.io.ros_messages.outgoing import (
    Level,
    diagnostics,
    header,
    laser_scan,
    occupancy_grid,
    odometry,
    particle_cloud,
    pose_array,
    pose_with_covariance,
    transforms,
)

NOW = 1_800_000_000.123456
LENGTHS = st.floats(-1e6, 1e6)
POSES = st.builds(SE2, LENGTHS, LENGTHS, st.floats(-math.pi, math.pi))
# Stamps of both clocks: since the epoch, and since the simulation began.
STAMPS = st.floats(0.0, 2.0**31 - 1.0)
over_the_wire = settings(
    max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def plain(name, /, **fields):
    """Make a message without a type."""
    return SimpleNamespace(**fields)


def assert_same_pose(a: SE2, b: SE2) -> None:
    assert (a.x, a.y) == (b.x, b.y)
    assert angle_error(a.yaw, b.yaw) < 1e-12


# ---- stamps


@given(STAMPS)
def test_a_stamp_comes_back_to_the_last_bit_or_to_half_a_nanosecond(stamp):
    back = to_seconds(header(plain, stamp, "map").stamp)
    assert abs(back - stamp) <= max(0.5e-9, math.ulp(stamp) / 2)
    if stamp > 2**24:  # half a nanosecond is below the resolution of float64
        assert back == stamp


@given(st.integers(0, 2**31 - 1), st.integers(0, 999_999_999))
def test_a_stamp_is_sent_as_exactly_as_float64_allows(sec, nanosec):
    """0.2 µs today: results can be matched to their scans."""
    stamp_sent = header(plain, to_seconds(SimpleNamespace(sec=sec, nanosec=nanosec)), "map").stamp
    off_ns = (stamp_sent.sec - sec) * 1_000_000_000 + stamp_sent.nanosec - nanosec
    assert abs(off_ns) <= 1 + 1e9 * math.ulp(float(sec + 1)) / 2
    assert 0 <= stamp_sent.nanosec < 1_000_000_000


def test_a_stamp_just_below_a_second_is_rounded_up():
    stamp = header(plain, 9.9999999999, "map").stamp
    assert (stamp.sec, stamp.nanosec) == (10, 0)


@pytest.mark.parametrize("stamp", [-1e-12, -0.5, -1.0, -1e12])
def test_stamps_before_the_epoch_become_the_epoch(stamp):
    stamp_sent = header(plain, stamp, "map").stamp
    assert (stamp_sent.sec, stamp_sent.nanosec) == (0, 0)


def test_a_header_names_its_frame(wire):
    sent = wire.sent(header(wire.make, NOW, "map"))
    assert sent.frame_id == "map"
    assert to_seconds(sent.stamp) == pytest.approx(NOW, abs=0.5e-6)


# ---- poses


@over_the_wire
@given(POSES, STAMPS)
def test_a_pose_comes_back(wire, T_map_base, stamp):
    message = wire.sent(pose_with_covariance(wire.make, stamp, "map", T_map_base, np.eye(3)))
    received = to_pose(message)
    assert (received.parent, received.child) == ("map", "")
    assert received.stamp == to_seconds(header(plain, stamp, "").stamp)
    assert_same_pose(to_planar(received), T_map_base)


def test_a_covariance_has_x_y_and_yaw_where_ros_has_them(wire):
    covariance = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]])
    message = pose_with_covariance(wire.make, 1.0, "map", SE2(1.0, 2.0, 3.0), covariance)
    full = np.array(wire.sent(message).pose.covariance).reshape(6, 6)
    x, y, yaw = 0, 1, 5
    assert_array_equal(full[np.ix_([x, y, yaw], [x, y, yaw])], covariance)
    assert np.count_nonzero(full) == 9


@over_the_wire
@given(st.lists(POSES, max_size=5))
def test_poses_keep_their_order(wire, poses):
    message = wire.sent(pose_array(wire.make, NOW, "map", poses))
    assert message.header.frame_id == "map"
    assert [(p.position.x, p.position.y) for p in message.poses] == [(T.x, T.y) for T in poses]
    for received, T in zip(message.poses, poses, strict=True):
        q = received.orientation
        assert math.hypot(q.x, q.y, q.z, q.w) == pytest.approx(1.0)
        assert angle_error(2.0 * math.atan2(q.z, q.w), T.yaw) < 1e-12


def test_particles_have_poses_and_weights(wire):
    poses = np.array([[1.0, 2.0, 0.5], [3.0, 4.0, -3.0]])
    cloud = wire.sent(particle_cloud(wire.make, NOW, "map", poses, np.array([0.25, 0.75])))
    assert [p.weight for p in cloud.particles] == [0.25, 0.75]
    assert [p.pose.position.y for p in cloud.particles] == [2.0, 4.0]
    assert_allclose([2 * math.asin(p.pose.orientation.z) for p in cloud.particles], poses[:, 2])


# ---- transforms and odometry


@over_the_wire
@given(POSES)
def test_a_transform_comes_back(wire, T):
    (received,) = map(
        to_transform, wire.sent(transforms(wire.make, 5.5, "map", "odom", T)).transforms
    )
    assert (received.parent, received.child, received.stamp) == ("map", "odom", 5.5)
    assert received.translation[2] == 0.0
    assert_same_pose(to_planar(received), T)


@over_the_wire
@given(POSES)
def test_odometry_comes_back(wire, T):
    received = to_odometry(wire.sent(odometry(wire.make, 5.5, "odom", "base_footprint", T)))
    assert (received.parent, received.child, received.stamp) == ("odom", "base_footprint", 5.5)
    assert_same_pose(to_planar(received), T)


# ---- scans


def scan_of(ranges, angle_min=-1.0, angle_increment=0.1, **limits):
    limits = {"range_min": 0.1, "range_max": 8.0} | limits
    return LaserScan(np.array(ranges, np.float32), angle_min, angle_increment, **limits, stamp=5.5)


@over_the_wire
@given(
    ranges=st.lists(
        st.floats(width=32) | st.sampled_from([math.inf, -math.inf, math.nan, 0.0]),
        min_size=1,
        max_size=50,
    ),
    angle_min=st.floats(-6.25, 6.25, width=32),
    increment=st.floats(2**-10, 0.125, width=32),
    sign=st.sampled_from([-1, 1]),
)
def test_a_scan_comes_back(wire, ranges, angle_min, increment, sign):
    scan = scan_of(ranges, angle_min, sign * increment)
    message = wire.sent(laser_scan(wire.make, "laser", scan))
    place = SE2(0.2, -0.1, 3.0)
    back = to_laser_scan(message, T_base_laser=place, mounting=Mounting.UPSIDE_DOWN)
    assert message.header.frame_id == "laser"
    assert_array_equal(back.ranges, scan.ranges)  # NaN equals NaN here
    assert (back.angle_min, back.angle_increment) == (angle_min, sign * increment)
    assert (back.stamp, back.T_base_laser) == (5.5, place)
    assert_allclose(back.bearings, -scan.bearings)
    # What float32 has lost of the limits moves no beam from one kind to another.
    assert_allclose([back.range_min, back.range_max], [0.1, 8.0], rtol=1e-7)


def test_the_last_beam_has_the_bearing_of_ros(wire):
    message = wire.sent(laser_scan(wire.make, "laser", scan_of([1.0] * 11)))
    assert message.angle_max == pytest.approx(0.0, abs=1e-6)
    assert len(message.ranges) == 11
    assert len(message.intensities) == 0


def test_a_lidar_of_2880_beams_has_its_last_bearing_within_a_thousandth_of_a_degree(wire):
    """Increments travel as float32, and their error adds up."""
    step = 2 * math.pi / 2880
    message = wire.sent(laser_scan(wire.make, "laser", scan_of([1.0] * 2880, -math.pi, step)))
    back = to_laser_scan(message, T_base_laser=SE2.identity(), mounting=Mounting.UPRIGHT)
    assert abs(back.bearings[-1] - (math.pi - step)) < math.radians(1e-3)


# ---- maps

CELLS = np.array([[0, 100, -1], [50, 7, 0]], np.int8)


def plan(resolution=0.05, T_map_grid=None, unseen=None):
    return OccupancyGrid(CELLS, resolution, T_map_grid or SE2.identity(), unseen)


@over_the_wire
@given(st.sampled_from([0.01, 0.02, 0.025, 0.03, 0.05, 0.1, 0.2, 1 / 3, 1.0]), POSES)
def test_a_map_comes_back(wire, resolution, T_map_grid):
    message = wire.sent(occupancy_grid(wire.make, NOW, "map", plan(resolution, T_map_grid)))
    back = to_grid(message)
    assert_array_equal(back.cells, CELLS)
    assert back.resolution == pytest.approx(resolution, rel=1e-7)
    assert_same_pose(back.T_map_grid, T_map_grid)
    assert (message.info.width, message.info.height, message.header.frame_id) == (3, 2, "map")


@pytest.mark.parametrize("resolution", [0.01, 0.02, 0.025, 0.05, 0.1, 1.0])
def test_the_resolution_survives_float32(wire, resolution):
    """0.05 travels as 0.05000000074505806, which is 6 µm in a building of 400 m."""
    message = wire.sent(occupancy_grid(wire.make, NOW, "map", plan(resolution)))
    assert to_grid(message).resolution == resolution


def test_unseen_cells_are_sent_as_unknown(wire):
    unseen = np.zeros(CELLS.shape, np.bool_)
    unseen[0, 0] = True
    sent = wire.sent(occupancy_grid(wire.make, NOW, "map", plan(unseen=unseen)))
    assert to_grid(sent).cells.tolist() == [[UNKNOWN, 100, -1], [50, 7, 0]]


def test_a_map_of_other_clients_is_the_same(wire):
    """rclpy has an array.array, rospy a tuple, others bytes."""
    message = wire.sent(occupancy_grid(wire.make, NOW, "map", plan()))
    flat = CELLS.ravel()
    for data in (
        flat,
        tuple(flat.tolist()),
        array.array("b", flat.tolist()),
        flat.tobytes(),
        bytearray(flat.tobytes()),
        memoryview(flat),
    ):
        message.data = data
        back = to_grid(message)
        assert_array_equal(back.cells, CELLS)
        assert not np.shares_memory(back.cells, np.asarray(flat))


# ---- status


def test_a_status_has_a_level_and_a_message(wire):
    values = {"state": "DISAMBIGUATING", "beams": "120"}
    message = diagnostics(wire.make, NOW, "firstfix", Level.WARN, "two places fit", values)
    sent = wire.sent(message)
    (status,) = sent.status
    assert (status.level, status.name, status.message) == (1, "firstfix", "two places fit")
    assert {pair.key: pair.value for pair in status.values} == values
    assert to_seconds(sent.header.stamp) == pytest.approx(NOW, abs=0.5e-6)


def test_levels_are_those_of_ros():
    assert [level.value for level in (Level.OK, Level.WARN, Level.ERROR)] == [0, 1, 2]
