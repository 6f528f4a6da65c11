"""ROS messages to core types."""

import array
import math
from types import SimpleNamespace as Message
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from firstfix.core.errors import ScanError
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.formats.messages import (
    to_frame,
    to_laser_scan,
    to_odometry,
    to_planar,
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
def test_what_is_no_scan_is_a_scan_error(changes: dict[str, Any]) -> None:
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


def test_turned_over_about_its_x_axis_it_still_looks_the_same_way() -> None:
    yaw = 0.7  # Rz(yaw) Rx(π)
    q = (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0)
    assert to_planar(to_transform(transform_message(q))).yaw == pytest.approx(yaw)


@pytest.mark.parametrize(
    "q", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0), (0, 0, math.inf, 0)]
)
def test_a_rotation_that_is_not_known_is_never_the_identity(q: tuple[float, ...]) -> None:
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
