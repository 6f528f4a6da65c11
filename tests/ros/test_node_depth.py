"""A robot with nothing but a depth camera: images in, a pose out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from recorder import BASE, Speaker

from firstfix.core.angles import angle_error
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.io.ros_messages.outgoing import header
from firstfix.localizer.outputs import TrackedPose
from firstfix.localizer.states import State
from firstfix.ros.channels import Channel

CAMERA = "camera_optical"
REACH_M, HEIGHT_M, FORWARD_M = 5.0, 0.4, 0.1
WIDTH, HEIGHT = 80, 57
FOCAL = 0.5 * WIDTH / math.tan(math.radians(30.0))  # 60 degrees across, 45 degrees upright
CX, CY = 0.5 * (WIDTH - 1), 0.5 * (HEIGHT - 1)
STEPS = 18
STEP = SE2(0.0, 0.0, 2.0 * math.pi / STEPS)


class DepthRobot(Speaker):
    """A robot whose camera looks ahead over the floor, at walls higher than its view."""

    def camera_place(self):
        make = self.wire.make
        place = make(
            "geometry_msgs/Transform",
            translation=make("geometry_msgs/Vector3", x=FORWARD_M, y=0.0, z=HEIGHT_M),
            # The optical axis is z, and x is to the right.
            rotation=make("geometry_msgs/Quaternion", x=-0.5, y=0.5, z=-0.5, w=0.5),
        )
        stamped = make(
            "geometry_msgs/TransformStamped",
            header=header(make, 0.0, BASE),
            child_frame_id=CAMERA,
            transform=place,
        )
        return self.wire.sent(make("tf2_msgs/TFMessage", transforms=[stamped]))

    def camera_info(self):
        make = self.wire.make
        region = make(
            "sensor_msgs/RegionOfInterest",
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False,
        )  # fmt: skip
        info = make(
            "sensor_msgs/CameraInfo",
            header=header(make, self.stamp, CAMERA),
            height=HEIGHT,
            width=WIDTH,
            distortion_model="plumb_bob",
            d=np.zeros(5),
            k=np.array([FOCAL, 0.0, CX, 0.0, FOCAL, CY, 0.0, 0.0, 1.0]),
            r=np.eye(3).ravel(),
            p=np.zeros(12),
            binning_x=0,
            binning_y=0,
            roi=region,
        )
        return self.wire.sent(info)

    def depth(self):
        """Return the depth of every pixel, shape (HEIGHT, WIDTH), m; NaN beyond the reach."""
        right, below = (np.arange(WIDTH) - CX) / FOCAL, (np.arange(HEIGHT) - CY) / FOCAL
        camera = self.pose @ SE2(FORWARD_M, 0.0, 0.0)
        bearings = -np.arctan(right)
        walls = expected_ranges(self.world, camera, bearings, 12.0) * np.cos(bearings)
        floor = np.where(below > 0.0, HEIGHT_M / np.maximum(below, 1e-9), np.inf)
        seen = np.minimum(walls, floor[:, None])
        seen += self._rng.normal(0.0, 0.01, seen.shape)
        return np.where(seen < REACH_M, seen, np.nan)

    def image(self, encoding):
        make, metres = self.wire.make, self.depth()
        if encoding == "32FC1":
            pixels = metres.astype("<f4")
        else:
            pixels = np.round(1e3 * np.nan_to_num(metres, nan=0.0)).astype("<u2")
        image = make(
            "sensor_msgs/Image",
            header=header(make, self.stamp, CAMERA),
            height=HEIGHT,
            width=WIDTH,
            encoding=encoding,
            is_bigendian=0,
            step=pixels.itemsize * WIDTH,
            data=np.frombuffer(pixels.tobytes(), np.uint8),
        )
        return self.wire.sent(image)


@pytest.mark.parametrize("encoding", ["32FC1", "16UC1"])
def test_one_turn_in_place_is_enough_for_a_depth_camera(run, ros2, hall_plan, encoding):
    robot = DepthRobot(ros2, hall_plan, SE2(6.5, 3.0, 1.0))
    node = run(depth_topics="camera/depth/image_raw")
    node.receive(Channel.MAP, robot.map())
    node.receive(Channel.TF_STATIC, robot.camera_place())
    node.receive(Channel.CAMERA_INFO, robot.camera_info())
    states, truth = [], {}
    for n in range(1, STEPS + 1):
        robot.move(STEP, 0.4)
        truth[round(robot.stamp, 3)] = robot.pose
        node.receive(Channel.TF, robot.tf())
        node.receive(Channel.DEPTH, robot.image(encoding))
        node.wait_until_handled(LaserScan, n)
        states.append(node.state)
    assert states[0] is State.DISAMBIGUATING  # a narrow view decides nothing by itself
    assert states[-1] is State.LOCALIZED
    poses = [o for _, outputs in node.handled for o in outputs if isinstance(o, TrackedPose)]
    assert poses
    for pose in poses:
        expected = truth[round(pose.stamp, 3)]
        assert pose.T_map_base.distance_to(expected) < 0.2
        assert angle_error(pose.T_map_base.yaw, expected.yaw) < math.radians(3.0)
