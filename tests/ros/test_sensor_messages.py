"""Several lasers, point clouds and depth images on their way to the localizer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from node_lab import Converter
from recorder import BASE, LASER, Speaker, point_cloud

from firstfix.core.errors import InputError, ScanError
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import header, pose_with_covariance, transforms
from firstfix.localizer.inputs import PositionFix
from firstfix.ros.channels import Channel, subscriptions
from firstfix.ros.node_config import NodeConfig

WALL = [[2.0, 0.1 * i, 0.5] for i in range(-10, 11)]
GROUND = [[0.1 * i, 0.0, 0.0] for i in range(1, 30)]


@pytest.fixture
def robot(wire, hall_plan):
    return Speaker(wire, hall_plan, SE2(4.0, 3.0, 1.0))


@pytest.fixture
def known(robot):
    return listening(robot)


def listening(robot, **parameters) -> Converter:
    """Give a converter that knows odometry and the pose of the laser."""
    converter = Converter(**parameters)
    converter.convert(Channel.TF_STATIC, robot.fixed())
    converter.convert(Channel.TF, robot.tf())
    return converter


def cloud(robot, points, frame=LASER, **changes):
    make = robot.wire.make
    return robot.wire.sent(point_cloud(make, header(make, robot.stamp, frame), points, **changes))


def depth(robot, metres, frame=LASER, **changes):
    make, pixels = robot.wire.make, np.round(1e3 * np.asarray(metres)).astype("<u2")
    height, width = pixels.shape
    parts = {
        "header": header(make, robot.stamp, frame),
        "height": height,
        "width": width,
        "encoding": "16UC1",
        "is_bigendian": 0,
        "step": 2 * width,
        "data": np.frombuffer(pixels.tobytes(), np.uint8),
    }
    return robot.wire.sent(make("sensor_msgs/Image", **(parts | changes)))


class Camera:
    """A camera info as ROS 2 names its fields."""

    def __init__(self, robot, width, height, frame=LASER, focal=100.0):
        self.header = header(robot.wire.make, robot.stamp, frame)
        self.width, self.height = width, height
        self.k = [focal, 0.0, width / 2, 0.0, focal, height / 2, 0.0, 0.0, 1.0]


# ---- which topics


def test_topics_of_several_sensors_are_lists_of_names():
    config = NodeConfig(
        scan_topics="front/scan rear/scan", cloud_topics="points", depth_topics="cam/depth/image"
    )
    named = {(channel, topic.name) for channel, topic in subscriptions(config)}
    assert {
        (Channel.SCAN, "front/scan"),
        (Channel.SCAN, "rear/scan"),
        (Channel.CLOUD, "points"),
        (Channel.DEPTH, "cam/depth/image"),
        (Channel.CAMERA_INFO, "cam/depth/camera_info"),
    } <= named
    assert (Channel.SCAN, "scan") not in named


# ---- lasers


def test_a_scan_has_the_name_of_its_frame(known, robot):
    (scan,) = known.convert(Channel.SCAN, robot.scan())
    assert scan.sensor == LASER


def test_scans_of_two_lasers_may_come_in_any_order(known, robot):
    """No clock was set back, although the second scan is older."""
    late = robot.wire.make
    fixed = transforms(late, 0.0, BASE, "rear", SE2(-0.3, 0.0, math.pi))
    known.convert(Channel.TF_STATIC, robot.wire.sent(fixed))
    robot.stamp -= 0.03
    rear = robot.scan("rear")
    robot.stamp += 0.03
    kinds = [known.convert(Channel.SCAN, scan) for scan in (robot.scan(), rear)]
    assert [[given.sensor for given in scans] for scans in kinds] == [[LASER], ["rear"]]
    assert known.warnings == []


def test_a_given_pose_replaces_transforms_that_are_missing(robot):
    known = listening(robot, laser_pose="0.2,0.1,1.57,3.14 rear=-0.3,0,3.14")
    (scan,) = known.convert(Channel.SCAN, robot.scan("nowhere"))
    assert scan.T_base_laser.distance_to(SE2(0.2, 0.1, 1.57)) < 1e-9
    assert scan.mounting is Mounting.UPSIDE_DOWN
    (scan,) = known.convert(Channel.SCAN, robot.scan("rear"))
    assert scan.T_base_laser.x == pytest.approx(-0.3)
    assert scan.mounting is Mounting.UPRIGHT


def test_the_frame_of_the_laser_can_be_given(robot):
    known = listening(robot, laser_frame=LASER)
    (scan,) = known.convert(Channel.SCAN, robot.scan("wrong"))
    assert isinstance(scan, LaserScan)


def test_unknown_skew_is_said_once_and_only_of_a_robot_that_moves(known, robot):
    known.convert(Channel.SCAN, robot.scan())
    assert known.warnings == []
    for _ in range(3):
        robot.move(SE2(0.1, 0.0, 0.0))
        robot.report(known.convert)
    ((subject, text),) = known.warnings
    assert subject == f"skew of {LASER}"
    assert "neither time_increment nor scan_time" in text


def test_scan_time_alone_gives_the_time_of_a_beam(known, robot):
    message = robot.scan()
    message.scan_time = 0.1
    (scan,) = known.convert(Channel.SCAN, message)
    assert scan.time_increment * len(scan) == pytest.approx(0.1)


# ---- point clouds


def test_a_cloud_is_cut_to_its_band_and_the_ground_is_removed(known, robot):
    (scan,) = known.convert(Channel.CLOUD, cloud(robot, WALL + GROUND))
    assert scan.sensor == LASER
    assert np.count_nonzero(scan.hit) >= 15
    assert scan.ranges[scan.hit].min() >= 2.0  # no ground


def test_the_band_of_heights_is_a_parameter(robot):
    known = listening(robot, height_band="0.6 1.0")
    (scan,) = known.convert(Channel.CLOUD, cloud(robot, WALL))
    assert not scan.hit.any()


def test_points_that_are_no_numbers_are_left_out(known, robot):
    bad = [[math.nan, 0.0, 0.5], [math.inf, 1.0, 0.5], [1e30, 1.0, 0.5]]
    with_bad, without = (known.convert(Channel.CLOUD, cloud(robot, p)) for p in (WALL + bad, WALL))
    np.testing.assert_array_equal(with_bad[0].ranges, without[0].ranges)


def test_a_cloud_without_points_is_a_scan_that_sees_nothing(known, robot):
    (scan,) = known.convert(Channel.CLOUD, cloud(robot, np.empty((0, 3))))
    assert not scan.hit.any()
    assert not scan.no_return.any()


def test_a_cloud_of_the_other_byte_order_is_the_same(known, robot):
    swapped = np.frombuffer(np.asarray(WALL, ">f4").tobytes(), np.uint8)
    other = cloud(robot, WALL, data=swapped, is_bigendian=True)
    big, little = (known.convert(Channel.CLOUD, c) for c in (other, cloud(robot, WALL)))
    np.testing.assert_array_equal(big[0].ranges, little[0].ranges)


def test_a_million_points_are_used(known, robot):
    many = np.tile(np.asarray(WALL, np.float32), (50_000, 1))
    (scan,) = known.convert(Channel.CLOUD, cloud(robot, many))
    assert scan.hit.any()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"fields": []}, "no float field x"),
        ({"point_step": 4}, "cannot hold fields"),
        ({"data": np.zeros(5, np.uint8)}, "has 5 bytes"),
        ({"width": 10**6}, "states 1 rows"),
        ({"point_step": 0}, "cannot hold fields"),
    ],
)
def test_a_damaged_cloud_is_refused_in_one_sentence_and_the_next_one_is_used(
    known, robot, changes, words
):
    with pytest.raises(ScanError, match=words):
        known.convert(Channel.CLOUD, cloud(robot, WALL, **changes))
    assert known.convert(Channel.CLOUD, cloud(robot, WALL))


# ---- depth images


def test_a_depth_image_needs_its_camera_info(known, robot):
    with pytest.raises(ScanError, match="No camera info of laser has come"):
        known.convert(Channel.DEPTH, depth(robot, np.full((4, 6), 2.0)))
    assert known.convert(Channel.CAMERA_INFO, Camera(robot, 6, 4)) == []
    (scan,) = known.convert(Channel.DEPTH, depth(robot, np.full((4, 6), 2.0)))
    assert isinstance(scan, LaserScan)
    assert scan.sensor == LASER


@pytest.mark.parametrize(
    ("camera", "changes", "words"),
    [
        ({"width": 8, "height": 4}, {}, "8 x 4"),
        ({"width": 6, "height": 4, "focal": 0.0}, {}, "no focal length"),
        ({"width": 6, "height": 4}, {"encoding": "rgb8"}, "'rgb8' is not that of a depth image"),
        ({"width": 6, "height": 4}, {"data": np.zeros(3, np.uint8)}, "has 3 bytes"),
    ],
)
def test_a_depth_image_that_does_not_match_is_refused(known, robot, camera, changes, words):
    known.convert(Channel.CAMERA_INFO, Camera(robot, **camera))
    with pytest.raises(ScanError, match=words):
        known.convert(Channel.DEPTH, depth(robot, np.full((4, 6), 2.0), **changes))


# ---- position fixes


def fix(robot, frame="map", variance=0.04):
    make = robot.wire.make
    covariance = np.diag([variance, variance, 0.01])
    message = pose_with_covariance(make, robot.stamp, frame, SE2(1.0, 2.0, 0.5), covariance)
    return robot.wire.sent(message)


def test_a_position_fix_is_a_pose_with_its_covariance(known, robot):
    (given,) = known.convert(Channel.POSITION_FIX, fix(robot))
    assert isinstance(given, PositionFix)
    assert given.T_map_base.distance_to(SE2(1.0, 2.0, 0.5)) < 1e-9
    np.testing.assert_allclose(given.covariance, np.diag([0.04, 0.04, 0.01]))


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"frame": "odom"}, "a position fix in map"), ({"variance": -1.0}, "no variance negative")],
)
def test_another_position_fix_is_refused(known, robot, changes, words):
    with pytest.raises(InputError, match=words):
        known.convert(Channel.POSITION_FIX, fix(robot, **changes))
