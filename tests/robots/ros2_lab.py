"""A robot and other nodes around a node of ROS 2, over the stand-in for rclpy."""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import laser_scan, occupancy_grid, transforms
from firstfix.lab.simulation.lidar import Lidar

STAND_IN = Path(__file__).parent / "rclpy_stand_in"
OURS = (
    "rclpy",
    *(f"rclpy.{path.stem}" for path in (STAND_IN / "rclpy").glob("*.py")),
    *(f"firstfix.ros.ros2.{name}" for name in ("bond", "localized", "node", "transport", "types")),
)
ALL = ("bond", "nav2_msgs", "kobuki_ros_interfaces", "visualization_msgs")
# The wheels never turn: a change of the pose means that the robot is carried.
T_ODOM_BASE = SE2(5.0, 5.0, 1.0)
# A kernel may have to be compiled first.
PATIENCE_S = 240.0


class Lab:
    """A fresh rclpy with its other packages; the node is imported again over it."""

    def __init__(self, patch: pytest.MonkeyPatch, optional: tuple[str, ...] = ALL) -> None:
        patch.syspath_prepend(str(STAND_IN))
        patch.delitem(sys.modules, "ros_types", raising=False)
        ros_types = importlib.import_module("ros_types")
        for name in [*OURS, *ros_types.names()]:
            patch.setitem(sys.modules, name, ModuleType(name))  # remembers what was there before
            del sys.modules[name]
        for name, module in ros_types.modules(optional).items():
            patch.setitem(sys.modules, name, module)
        self.rclpy = importlib.import_module("rclpy")
        self.world = importlib.import_module("rclpy.graph").world
        self.lifecycle = importlib.import_module("rclpy.lifecycle")
        self.types = importlib.import_module("firstfix.ros.ros2.types")
        self.ros2 = importlib.import_module("firstfix.ros.ros2.node")
        self.nodes: list[Any] = []

    def node(self, *arguments: str) -> Any:
        """Start a node as a command line with these arguments of ROS does."""
        self.rclpy.init(args=["firstfix", "--ros-args", *arguments])
        self.nodes.append(self.ros2.Ros2Node())
        return self.nodes[-1]

    def quality(self, *, is_sensor: bool = False, is_latched: bool = False, depth: int = 10) -> Any:
        """Return a quality of service."""
        qos = importlib.import_module("rclpy.qos")
        reliable, kept = qos.ReliabilityPolicy, qos.DurabilityPolicy
        return qos.QoSProfile(
            depth=depth,
            reliability=reliable.BEST_EFFORT if is_sensor else reliable.RELIABLE,
            durability=kept.TRANSIENT_LOCAL if is_latched else kept.VOLATILE,
        )

    def listen(
        self, topic: str, type_name: str, receive: Callable[[Any], None], **quality: Any
    ) -> None:
        """Call a function with what is published."""
        kind = self.types.find("msg", type_name)
        self.world.listen(kind, topic, self.quality(**quality), receive)

    def subscribe(self, topic: str, type_name: str, **quality: Any) -> list[Any]:
        """Return a list that grows with what is published."""
        received: list[Any] = []
        self.listen(topic, type_name, received.append, **quality)
        return received

    def advertise(self, topic: str, type_name: str, **quality: Any) -> Any:
        """Return a publisher."""
        return self.world.advertise(
            self.types.find("msg", type_name), topic, self.quality(**quality)
        )

    def end(self) -> None:
        """Let no thread outlive its test."""
        for node in self.nodes:
            node.end()


class Robot:
    """A robot that stands in a map, and its map server."""

    def __init__(self, lab: Lab, grid: OccupancyGrid, T_map_base: SE2) -> None:
        self.lab, self.grid, self.T_map_base = lab, grid, T_map_base
        self.make = lab.types.make
        self.lidar = Lidar(beams=180, T_base_laser=SE2(0.1, 0.0, 0.0))
        self.stamp = 100.0
        self.scan = lab.advertise("scan", "sensor_msgs/LaserScan", is_sensor=True, depth=5)
        self.tf = lab.advertise("/tf", "tf2_msgs/TFMessage", depth=100)
        self.fixed = lab.advertise("/tf_static", "tf2_msgs/TFMessage", is_latched=True, depth=1)
        self.map = lab.advertise("map", "nav_msgs/OccupancyGrid", is_latched=True, depth=1)
        T_base_laser = self.lidar.T_base_laser
        self.fixed.publish(transforms(self.make, 0.0, "base_footprint", "laser", T_base_laser))
        self.map.publish(occupancy_grid(self.make, 0.0, "map", grid))

    def look(self) -> None:
        """Report odometry and a scan, a tenth of a second later."""
        self.stamp += 0.1
        wheels = transforms(self.make, self.stamp, "odom", "base_footprint", T_ODOM_BASE)
        self.tf.publish(wheels)
        rng = np.random.default_rng(round(10 * self.stamp))
        seen = replace(self.lidar.scan(self.grid, self.T_map_base, rng), stamp=self.stamp)
        self.scan.publish(laser_scan(self.make, "laser", seen))

    def look_until(self, is_done: Callable[[], Any]) -> None:
        """Send scans, each after the last was processed, until a condition holds."""
        wait_until(lambda: (self.look(), is_done())[1])


def wait_until(is_done: Callable[[], Any]) -> None:
    """Wait until something has happened."""
    deadline = time.monotonic() + PATIENCE_S
    while not is_done():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.02)
