"""A bag of ROS 1 from `firstfix.lab.simulation`, as a robot would have recorded it."""

from __future__ import annotations

from itertools import takewhile
from pathlib import Path
from typing import Any

from play import BASE, LASER, report
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scripts import SCRIPTS

from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import occupancy_grid, transforms
from firstfix.lab.scenarios.scenario import run

STORE = get_typestore(Stores.ROS1_NOETIC)
STORE.register(
    get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
)
TYPES = {
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "scan": "sensor_msgs/msg/LaserScan",
    "map": "nav_msgs/msg/OccupancyGrid",
}
LATCHED = ("/tf_static", "map")


def make(type_name: str, /, **fields: Any) -> Any:
    """Build a message."""
    package, _, name = type_name.partition("/")
    if name == "Header":
        fields["seq"] = 0
    return STORE.types[f"{package}/msg/{name}"](**fields)


def record(path: Path, script: str, seconds: float, began: float) -> SE2:
    """Write the first seconds of a script, and return where the robot began."""
    grid, scenario, seed = SCRIPTS[script]()
    with Writer(path) as writer:
        connections = {
            topic: writer.add_connection(
                f"/{topic.lstrip('/')}", kind, typestore=STORE, latching=int(topic in LATCHED)
            )
            for topic, kind in TYPES.items()
        }
        now = began

        def publish(topic: str, message: Any) -> None:
            ns = round(1e9 * now)
            writer.write(connections[topic], ns, STORE.serialize_ros1(message, TYPES[topic]))

        publish(
            "/tf_static", transforms(make, now, BASE, LASER, scenario.rig.lidars[0].T_base_laser)
        )
        publish("map", occupancy_grid(make, now, "map", grid))
        moments = takewhile(lambda moment: moment.stamp < seconds, run(scenario, grid, seed))
        first = next(moments)
        for moment in (first, *moments):
            for event in moment.events:
                now = began + event.stamp
                report(event, began, make, publish)
    return first.T_map_base
