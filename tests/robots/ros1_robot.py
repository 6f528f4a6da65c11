"""A simulated rospy robot, run as a program; a line on its stdin is a command.

Such a line is JSON: ``flaws`` (names of `FLAWS`, instead of those before), ``shift`` (x, y, yaw:
the map moves by that much, the robot does not), ``ask`` (a service without arguments), ``hint``
(x, y, yaw: a person publishes a hint), ``gone`` (that person), ``go`` (on with the script),
``load`` (the path of a map for the node), ``set`` (the map, and x, y, yaw in it).
After each, map and fixed transforms are published anew.
"""

from __future__ import annotations

import argparse
import json
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import genpy.dynamic
import nav_msgs.srv
import numpy as np
import rospy

sys.path.insert(0, str(Path(__file__).parent))

from play import places, play
from scripts import SCRIPTS, TOLD

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import occupancy_grid, pose_with_covariance
from firstfix.lab.simulation.rigs import Rig
from firstfix.ros.ros1.types import Empty, make, message_class

# As kobuki_msgs has them, less the comments.
DEFINITIONS = {
    "CliffEvent": "uint8 LEFT=0\nuint8 CENTER=1\nuint8 RIGHT=2\nuint8 FLOOR=0\nuint8 CLIFF=1\n"
    "uint8 sensor\nuint8 state\nuint16 bottom",
    "WheelDropEvent": "uint8 LEFT=0\nuint8 RIGHT=1\nuint8 RAISED=0\nuint8 DROPPED=1\n"
    "uint8 wheel\nuint8 state",
    "BumperEvent": "uint8 LEFT=0\nuint8 CENTER=1\nuint8 RIGHT=2\nuint8 RELEASED=0\n"
    "uint8 PRESSED=1\nuint8 bumper\nuint8 state",
}
TYPES = {
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
    "scan": "sensor_msgs/LaserScan",
    "front/scan": "sensor_msgs/LaserScan",
    "rear/scan": "sensor_msgs/LaserScan",
    "points": "sensor_msgs/PointCloud2",
    "map": "nav_msgs/OccupancyGrid",
    "initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    "events/cliff": "kobuki/CliffEvent",
    "events/wheel_drop": "kobuki/WheelDropEvent",
    "events/bumper": "kobuki/BumperEvent",
}
LATCHED = ("/tf_static", "map")


def _without_stamp(topic: str, message: Any) -> Any:
    if topic == "scan":
        message.header.stamp = rospy.Time(0)
    return message


def _in_another_frame(topic: str, message: Any) -> Any:
    if topic == "map":
        message.header.frame_id = "second_floor"
    return message


def _silent(silent: str) -> Callable[[str, Any], Any]:
    return lambda topic, message: None if topic == silent else message


# What can be wrong with a robot: from topic and message to the message that it sends, or None.
FLAWS = {
    "no laser frame": _silent("/tf_static"),
    "no odometry": _silent("/tf"),
    "no map": _silent("map"),
    "no scan": _silent("scan"),
    "no stamp": _without_stamp,
    "map elsewhere": _in_another_frame,
}


class Robot:
    """What a robot and the people around it publish."""

    def __init__(self, grid: OccupancyGrid, rig: Rig, flaws: list[str]) -> None:
        self._grid = grid
        self._rig = rig
        self._flaws = flaws
        self._publishers = {
            topic: rospy.Publisher(topic, _kind(kind), latch=topic in LATCHED, queue_size=50)
            for topic, kind in TYPES.items()
            if topic != "initialpose"  # advertised only for a hint
        }

    def publish(self, topic: str, message: Any) -> None:
        """Publish, with the flaws, until ROS ends this program."""
        if rospy.is_shutdown():
            sys.exit()
        for flaw in self._flaws:
            message = FLAWS[flaw](topic, message) if message is not None else None
        if message is not None:
            self._publishers[topic].publish(message)

    def publish_latched(self) -> None:
        """Publish what does not change."""
        self.publish("/tf_static", places(make, self._rig))
        self.publish("map", self.map())

    def map(self) -> Any:
        """Return the map as a message."""
        return occupancy_grid(make, 0.0, "map", self._grid)

    def execute(self, command: dict[str, Any]) -> None:
        """Execute a command of the module's docstring."""
        self._flaws = command.get("flaws", self._flaws)
        T_new_old = SE2(*command.get("shift", (0.0, 0.0, 0.0)))
        self._grid = replace(self._grid, T_map_grid=T_new_old @ self._grid.T_map_grid)
        self.publish_latched()
        if "hint" in command:
            self._publishers["initialpose"] = rospy.Publisher(
                "initialpose", _kind(TYPES["initialpose"]), latch=True, queue_size=1
            )
            where = SE2(*command["hint"])
            hint = pose_with_covariance(make, 0.0, "map", where, np.diag([0.25, 0.25, 0.07]))
            self._publishers["initialpose"].publish(hint)
        if "gone" in command:  # its latched hint would reach later subscribers
            self._publishers.pop("initialpose").unregister()
        if "go" in command:
            TOLD.set()
        if "ask" in command:
            rospy.wait_for_service(command["ask"], timeout=240.0)
            rospy.ServiceProxy(command["ask"], Empty)()
        if "load" in command:
            load = rospy.ServiceProxy("firstfix/load_map", nav_msgs.srv.LoadMap)
            sys.stdout.write(f"load_map: {load(command['load']).result}\n")
        if "set" in command:
            where = SE2(*command["set"])
            pose = pose_with_covariance(make, 0.0, "map", where, np.diag([0.25, 0.25, 0.07]))
            rospy.ServiceProxy("set_map", nav_msgs.srv.SetMap)(self.map(), pose)

    def listen(self) -> None:
        """Execute commands from stdin."""
        for line in sys.stdin:
            self.execute(json.loads(line))


def _kind(name: str) -> Any:
    """Return the class of a message, of a Kobuki's too."""
    package, _, short = name.partition("/")
    if package != "kobuki":
        return message_class(name)
    full = f"kobuki_msgs/{short}"
    return genpy.dynamic.generate_dynamic(full, DEFINITIONS[short])[full]


def make_any(name: str, /, **fields: Any) -> Any:
    """Build a message, of a Kobuki's too."""
    if name == "sensor_msgs/PointCloud2":
        fields["data"] = fields["data"].tobytes()  # rospy has no arrays
    return _kind(name)(**fields) if name.startswith("kobuki/") else make(name, **fields)


def main() -> None:
    """Publish the map and the place of the sensor, then play."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("script", choices=SCRIPTS)
    parser.add_argument("truth", type=Path)
    parser.add_argument("--flaws", nargs="*", choices=FLAWS, default=[])
    parser.add_argument("--serve-map", action="store_true", help="as the service static_map")
    arguments = parser.parse_args()
    rospy.init_node("robot", anonymous=True)
    grid, scenario, seed = SCRIPTS[arguments.script]()
    robot = Robot(grid, scenario.rig, arguments.flaws)
    if arguments.serve_map:
        rospy.Service("static_map", nav_msgs.srv.GetMap, lambda _: robot.map())
    robot.publish_latched()
    threading.Thread(target=robot.listen, daemon=True).start()
    play(scenario, grid, seed, make_any, robot.publish, arguments.truth)


if __name__ == "__main__":
    main()
