"""ROS messages to core types."""

import array
import math
from types import SimpleNamespace as Message
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from firstfix.core.errors import InputError, MapError, ScanError
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import (
    FARTHEST_M,
    to_frame,
    to_grid,
    to_laser_scan,
    to_odometry,
    to_planar,
    to_pose,
    to_pressed,
    to_seconds,
    to_transform,
)

ROS2_STAMP = Message(sec=10, nanosec=500_000_000)
ROS1_STAMP = Message(secs=10, nsecs=500_000_000)


def scan_message(**changes: Any) -> Message:
    fields = {
        "header": Message(stamp=ROS2_STAMP, frame_id="laser"),
        "angle_min": -0.5,
        "angle_max": 0.5,
        "angle_increment": 0.5,
        "range_min": 0.1,
        "range_max": 8.0,
        "ranges": [1.0, 2.0, math.inf],
    }
    return Message(**(fields | changes))


def transform_message(
    q: tuple[float, ...], xyz: tuple[float, ...] = (1.0, 2.0, 3.0), parent: str = "base_link"
) -> Message:
    return Message(
        header=Message(stamp=ROS2_STAMP, frame_id=parent),
        child_frame_id="/laser",
        transform=Message(
            translation=Message(x=xyz[0], y=xyz[1], z=xyz[2]),
            rotation=Message(x=q[0], y=q[1], z=q[2], w=q[3]),
        ),
    )


def convert(message: Message, **changes: Any) -> Any:
    arguments = {"T_base_laser": SE2.identity(), "mounting": Mounting.UPRIGHT}
    return to_laser_scan(message, **(arguments | changes))


@pytest.mark.parametrize("stamp", [ROS1_STAMP, ROS2_STAMP])
def test_times_of_both_ros_are_read(stamp: Message) -> None:
    assert to_seconds(stamp) == 10.5


def test_the_slash_of_old_frames_is_dropped() -> None:
    assert to_frame("/base_link") == "base_link"
    assert to_frame("robot1/base_link") == "robot1/base_link"


@pytest.mark.parametrize(
    "ranges",
    [
        [1.0, 2.0, math.inf],
        (1.0, 2.0, math.inf),
        array.array("f", [1.0, 2.0, math.inf]),
        np.array([1.0, 2.0, math.inf], np.float32),
    ],
)
def test_ranges_of_every_ros_become_a_scan(ranges: Any) -> None:
    place = SE2(1.0, 0.0, math.pi)
    scan = convert(scan_message(ranges=ranges), T_base_laser=place)
    assert_allclose(scan.ranges, [1, 2, math.inf])
    assert_allclose(scan.bearings, [-0.5, 0.0, 0.5])
    assert (scan.range_min, scan.range_max, scan.stamp) == (0.1, 8.0, 10.5)
    assert_allclose(scan.points()[1], [-1.0, 0.0], atol=1e-12)
    assert not np.shares_memory(scan.ranges, np.asarray(ranges))


def test_beams_may_run_clockwise() -> None:
    scan = convert(scan_message(angle_min=0.5, angle_max=-0.5, angle_increment=-0.5))
    assert_allclose(scan.bearings, [0.5, 0.0, -0.5])


def test_upside_down_mirrors_the_bearings() -> None:
    scan = convert(scan_message(), mounting=Mounting.UPSIDE_DOWN)
    assert_allclose(scan.bearings, [0.5, 0.0, -0.5])


def test_the_last_beam_is_where_the_increment_puts_it() -> None:
    assert convert(scan_message(angle_max=123.0)).bearings[-1] == pytest.approx(0.5)


def test_a_better_stamp_can_be_given() -> None:
    assert convert(scan_message(), stamp=3.0).stamp == 3.0


@pytest.mark.parametrize(
    "changes", [{"ranges": []}, {"angle_increment": 0.0}, {"range_max": 0.0}, {"ranges": [None]}]
)
def test_an_invalid_scan_is_a_scan_error(changes: dict[str, Any]) -> None:
    with pytest.raises(ScanError):
        convert(scan_message(**changes))


@pytest.mark.parametrize("yaw", [-3.0, -1.0, 0.0, 0.7, 3.1])
def test_a_transform_is_projected_onto_the_floor(yaw: float) -> None:
    # Quaternions that travelled as float32 are not quite of unit length.
    q = (0.0, 0.0, 1.01 * math.sin(yaw / 2), 1.01 * math.cos(yaw / 2))
    transform = to_transform(transform_message(q))
    assert (transform.parent, transform.child, transform.stamp) == ("base_link", "laser", 10.5)
    assert math.hypot(*transform.rotation) == pytest.approx(1.0)
    assert_allclose(to_planar(transform).as_array(), [1.0, 2.0, yaw], atol=1e-12)


def test_a_sensor_turned_over_about_its_x_axis_keeps_its_heading() -> None:
    yaw = 0.7  # Rz(yaw) Rx(π)
    q = (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0)
    assert to_planar(to_transform(transform_message(q))).yaw == pytest.approx(yaw)


@pytest.mark.parametrize(
    "q", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0), (0, 0, math.inf, 0)]
)
def test_an_unknown_rotation_is_never_the_identity(q: tuple[float, ...]) -> None:
    with pytest.raises(ScanError, match="finite numbers from base_link to laser"):
        to_planar(to_transform(transform_message(q)))


def test_odometry_is_the_transform_to_its_child() -> None:
    message = Message(
        header=Message(stamp=ROS1_STAMP, frame_id="odom"),
        child_frame_id="base_footprint",
        pose=Message(
            pose=Message(
                position=Message(x=1.0, y=2.0, z=0.0),
                orientation=Message(x=0.0, y=0.0, z=1.0, w=0.0),
            )
        ),
    )
    transform = to_odometry(message)
    assert (transform.parent, transform.child) == ("odom", "base_footprint")
    assert_allclose(to_planar(transform).as_array(), [1.0, 2.0, math.pi])


# ---- maps


def map_message(**changes: Any) -> Message:
    fields: dict[str, Any] = {
        "data": [0, 100, -1, 50, 7, 0],
        "width": 3,
        "height": 2,
        "resolution": 0.05,
        "position": (1.0, 2.0, 0.0),
        "orientation": (0.0, 0.0, 0.0, 1.0),
    } | changes
    x, y, z, w = fields["orientation"]
    return Message(
        header=Message(stamp=ROS2_STAMP, frame_id="map"),
        info=Message(
            width=fields["width"],
            height=fields["height"],
            resolution=fields["resolution"],
            origin=Message(
                position=Message(**dict(zip("xyz", fields["position"], strict=True))),
                orientation=Message(x=x, y=y, z=z, w=w),
            ),
        ),
        data=fields["data"],
    )


def test_row_0_of_a_map_is_at_the_bottom() -> None:
    grid = to_grid(map_message())
    assert grid.cells.tolist() == [[0, 100, -1], [50, 7, 0]]
    assert_allclose(grid.to_map(np.array([0.0, 1.0])), [1.0, 2.05])
    assert not grid.cells.flags.writeable


def test_the_origin_of_a_map_may_be_turned() -> None:
    turned = to_grid(map_message(orientation=(0.0, 0.0, math.sin(0.35), math.cos(0.35))))
    assert_allclose(turned.T_map_grid.as_array(), [1.0, 2.0, 0.7])


def test_a_map_without_a_rotation_is_not_turned() -> None:
    """octomap_server leaves all four numbers at zero, and AMCL does not look at them."""
    assert to_grid(map_message(orientation=(0, 0, 0, 0))).T_map_grid.yaw == 0.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"data": []}, "3 x 2 cells, received 0"),
        ({"data": [0] * 5}, "3 x 2 cells, received 5"),
        ({"data": [0] * 7}, "3 x 2 cells, received 7"),
        ({"width": 0, "height": 0, "data": []}, "at least one row"),
        ({"width": 2**32 - 1, "height": 2**32 - 1}, "4294967295 x 4294967295 cells, received 6"),
        ({"width": np.uint32(65536), "height": np.uint32(65536), "data": []}, "65536 x 65536"),
        ({"data": [0, 100, -2, 50, 7, 0]}, "from -2 to 100"),
        ({"data": [0, 101, -1, 50, 7, 0]}, "from -1 to 101"),
        ({"data": [0, 100, -1, 50, 7, 300]}, "from -1 to 300"),
        ({"data": np.array([0, 100, 255, 50, 7, 0], np.uint8)}, "from 0 to 255"),
        ({"data": np.array([0, -128, 0, 0, 0, 0], np.int8)}, "from -128 to 0"),
        ({"data": [0.0, 100.0, -1.0, 50.0, 7.0, math.nan]}, "float64"),
        ({"data": [10**30] * 6}, "object"),
        ({"data": ["0"] * 6}, "cells"),
        ({"data": b"\x00" * 5}, "received 5"),
        ({"resolution": 0.0}, "resolution above 0"),
        ({"resolution": -0.05}, "resolution above 0"),
        ({"resolution": math.nan}, "resolution above 0"),
        ({"resolution": math.inf}, "resolution above 0"),
        ({"resolution": 1e39}, "resolution above 0"),
        ({"position": (math.nan, 0.0, 0.0)}, "position"),
        ({"position": (0.0, math.inf, 0.0)}, "position"),
        ({"position": (0.0, -2e9, 0.0)}, "position"),
        ({"orientation": (math.nan, 0.0, 0.0, 1.0)}, "rotation"),
        ({"orientation": (0.0, 0.0, 0.0, 1e-9)}, "rotation"),
        ({"orientation": (1e308, 1e308, 1e308, 1e308)}, "rotation"),
    ],
)
def test_an_invalid_map_is_a_map_error(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(MapError, match=words):
        to_grid(map_message(**changes))


# ---- poses and events


def test_a_pose_has_a_frame_and_a_stamp() -> None:
    message = transform_message((0.0, 0.0, 1.0, 0.0), parent="/map")
    place = message.transform
    pose = Message(position=place.translation, orientation=place.rotation)
    received = to_pose(Message(header=message.header, pose=Message(pose=pose)))
    assert (received.parent, received.child, received.stamp) == ("map", "", 10.5)
    assert_allclose(to_planar(received).as_array(), [1.0, 2.0, math.pi])


@pytest.mark.parametrize("field", ["sensor", "wheel", "bumper"])
@pytest.mark.parametrize("state", [0, 1])
def test_events_of_a_kobuki_have_a_kind_and_a_state(field: str, state: int) -> None:
    assert to_pressed(Message(**{field: 1, "state": state, "bottom": 9})) == (1, bool(state))


@pytest.mark.parametrize("data", [True, False, np.True_, np.False_])
def test_a_bool_is_a_state(data: Any) -> None:
    assert to_pressed(Message(data=data)) == (0, bool(data))


@pytest.mark.parametrize(
    "message", [Message(data="false"), Message(data=1.0), Message(sensor=1), Message(state=1)]
)
def test_another_message_on_the_topic_of_an_event_is_none(message: Message) -> None:
    """A text "false" would be true."""
    with pytest.raises(InputError, match="remap the topic"):
        to_pressed(message)


def test_the_messages_of_a_kobuki_are_read_off_the_wire(wire: Any) -> None:
    for name, field in (("Cliff", "sensor"), ("WheelDrop", "wheel"), ("Bumper", "bumper")):
        fields = {field: 2, "state": 1} | ({"bottom": 7} if name == "Cliff" else {})
        assert to_pressed(wire.sent(wire.make(f"kobuki/{name}Event", **fields))) == (2, True)
    assert to_pressed(wire.sent(wire.make("std_msgs/Bool", data=True))) == (0, True)


# ---- hostile numbers

NUMBERS = st.floats() | st.sampled_from([0.0, -0.0, 5e-324, 1e308, -1e308])
QUATERNIONS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
POSITIONS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


@given(QUATERNIONS, POSITIONS)
def test_a_transform_is_a_pose_of_finite_numbers_or_an_error(
    q: tuple[float, ...], xyz: tuple[float, ...]
) -> None:
    transform = to_transform(transform_message(q, xyz))
    norm = math.hypot(*transform.rotation)
    assert math.isnan(norm) or norm == pytest.approx(1.0)
    try:
        pose = to_planar(transform)
    except ScanError:
        return
    assert np.abs(pose.as_array()).max() <= FARTHEST_M


@given(
    ranges=st.lists(st.floats() | st.integers(-(10**12), 10**12), max_size=20),
    numbers=st.fixed_dictionaries(
        dict.fromkeys(("angle_min", "angle_increment", "range_min", "range_max"), NUMBERS)
    ),
)
def test_any_scan_is_valid_or_a_scan_error(ranges: list[float], numbers: dict[str, float]) -> None:
    try:
        scan = convert(scan_message(ranges=ranges, **numbers))
    except ScanError:
        return
    assert np.isfinite(scan.bearings).all()
    assert np.isfinite(scan.points()).all()


@given(
    data=st.lists(st.integers(-200, 200), max_size=12)
    | st.binary(max_size=12)
    | st.lists(st.floats(), max_size=12),
    width=st.integers(0, 2**32 - 1) | st.integers(0, 4),
    height=st.integers(0, 2**32 - 1) | st.integers(0, 4),
    resolution=NUMBERS | st.just(0.05),
    position=POSITIONS | st.just((0.0, 0.0, 0.0)),
    orientation=QUATERNIONS | st.just((0.0, 0.0, 0.0, 1.0)),
)
def test_any_map_is_valid_or_a_map_error(**fields: Any) -> None:
    try:
        grid = to_grid(map_message(**fields))
    except MapError:
        return
    assert grid.cells.shape == (fields["height"], fields["width"])
    assert np.isfinite(grid.T_map_grid.as_array()).all()
    assert 0.0 < grid.resolution < math.inf
