"""A rospy robot from `firstfix.sim`: run as a program, with a scenario as JSON."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import genpy.dynamic
import rospy

sys.path.insert(0, str(Path(__file__).parent))

from play import BASE, LASER, play
from scripts import SCRIPTS

from firstfix.adapters.ros1_types import make, message_class
from firstfix.formats.outgoing import occupancy_grid, transforms

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
    "map": "nav_msgs/OccupancyGrid",
    "events/cliff": "kobuki/CliffEvent",
    "events/wheel_drop": "kobuki/WheelDropEvent",
    "events/bumper": "kobuki/BumperEvent",
}
LATCHED = ("/tf_static", "map")


def kind_of(name: str) -> Any:
    """Return the class of a message, of a Kobuki's too."""
    package, _, short = name.partition("/")
    if package != "kobuki":
        return message_class(name)
    full = f"kobuki_msgs/{short}"
    return genpy.dynamic.generate_dynamic(full, DEFINITIONS[short])[full]


def make_any(name: str, /, **fields: Any) -> Any:
    """Build a message, of a Kobuki's too."""
    return kind_of(name)(**fields) if name.startswith("kobuki/") else make(name, **fields)


def main() -> None:
    """Publish the map and the place of the sensor, then play."""
    script, truth = sys.argv[1:3]
    rospy.init_node("robot")
    publishers = {
        topic: rospy.Publisher(topic, kind_of(kind), latch=topic in LATCHED, queue_size=50)
        for topic, kind in TYPES.items()
    }
    grid, scenario, seed = SCRIPTS[script]()
    T_base_laser = scenario.lidar.T_base_laser
    publishers["/tf_static"].publish(transforms(make, 0.0, BASE, LASER, T_base_laser))
    publishers["map"].publish(occupancy_grid(make, 0.0, "map", grid))
    play(scenario, grid, seed, make_any, lambda t, m: publishers[t].publish(m), Path(truth))


if __name__ == "__main__":
    main()
