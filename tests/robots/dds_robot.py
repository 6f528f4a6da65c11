"""A robot from `firstfix.lab.simulation` on plain DDS: run as a program."""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.topic import Topic as DdsTopic
from cyclonedds.util import duration

sys.path.insert(0, str(Path(__file__).parent))

from play import TOPICS, places, play
from scripts import SCRIPTS

from firstfix.io.ros_messages.outgoing import occupancy_grid
from firstfix.ros.dds.types import Cdr, described, encode, make

LATCHED = ("/tf_static", "map")
TYPES = {
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
    "scan": "sensor_msgs/LaserScan",
    "front/scan": "sensor_msgs/LaserScan",
    "rear/scan": "sensor_msgs/LaserScan",
    "points": "sensor_msgs/PointCloud2",
    "map": "nav_msgs/OccupancyGrid",
    "events/cliff": "kobuki/CliffEvent",
    "events/wheel_drop": "kobuki/WheelDropEvent",
    "events/bumper": "kobuki/BumperEvent",
}
# As the publishers of ROS 2 offer it, less what they have by default.
RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))
XCDR1 = Policy.DataRepresentation(use_cdrv0_representation=True)


def writer(participant: Any, name: str, kind: str, *policies: Any) -> DataWriter:
    """Return a writer of CDR."""
    topic = DdsTopic(participant, name, described(kind))
    topic.data_type = Cdr
    return DataWriter(participant, topic, Qos(XCDR1, Policy.History.KeepLast(50), *policies))


def main() -> None:
    """Publish the place of the sensor and the map, then play."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("script", choices=SCRIPTS)
    parser.add_argument("truth", type=Path)
    parser.add_argument("--namespace", default="")
    parser.add_argument("--map", choices=("latched", "late", "volatile"), default="latched")
    options = parser.parse_args()
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    writers = {}
    for topic, kind in TYPES.items():
        full = f"{options.namespace}/{topic.removeprefix('/')}"
        is_latched = topic in LATCHED and (topic, options.map) != ("map", "volatile")
        kept = Policy.Durability.TransientLocal if is_latched else Policy.Durability.Volatile
        is_sensor = topic in {name for name, _ in TOPICS.values()}
        how = Policy.Reliability.BestEffort if is_sensor else RELIABLE
        writers[topic] = writer(participant, f"rt{full}", kind, how, kept)

    def publish(topic: str, message: Any) -> None:
        writers[topic].write(Cdr(encode(TYPES[topic], message)))

    grid, scenario, seed = SCRIPTS[options.script]()
    publish("/tf_static", places(make, scenario.rig))
    if options.map == "late":
        time.sleep(2.0)
    publish("map", occupancy_grid(make, 0.0, "map", grid))
    play(scenario, grid, seed, make, publish, options.truth)


if __name__ == "__main__":
    main()
