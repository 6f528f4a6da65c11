"""Write messages of ROS 1 topics as lines of JSON: ``ros1_watcher.py FILE TOPIC...``."""

from __future__ import annotations

import json
import sys
import threading
import time
from functools import partial
from pathlib import Path
from typing import Any

import rospy

from firstfix.io.ros_messages.incoming import planar, to_pose, to_seconds, to_transform
from firstfix.ros.ros1.types import decoded, message_class

TYPES = {
    "initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    "amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
    "hypotheses": "geometry_msgs/PoseArray",
    "hypothesis_markers": "visualization_msgs/MarkerArray",
    "localized": "std_msgs/Bool",
    "particle_cloud": "geometry_msgs/PoseArray",
    "localization_status": "diagnostic_msgs/DiagnosticArray",
    "scan": "sensor_msgs/LaserScan",
    "/tf": "tf2_msgs/TFMessage",
    "events/wheel_drop": "kobuki/WheelDropEvent",
    "map_id": "std_msgs/String",
    "/rosout_agg": "rosgraph_msgs/Log",
}


def of_pose(message: Any) -> dict[str, Any]:
    """Read a pose with its covariance."""
    return {"pose": planar(to_pose(message)), "covariance": list(message.pose.covariance)}


def of_poses(message: Any) -> dict[str, Any]:
    """Read where the poses are."""
    return {"places": [[pose.position.x, pose.position.y] for pose in message.poses]}


def of_status(message: Any) -> dict[str, Any]:
    """Read a diagnosis."""
    status = message.status[0]
    values = {entry.key: entry.value for entry in status.values}
    return {"level": status.level, "message": status.message, **values}


def of_transforms(message: Any) -> dict[str, Any]:
    """Read the first transform."""
    first = to_transform(message.transforms[0])
    frames = [first.parent, first.child]
    return {"frames": frames, "pose": planar(first), "stamp": first.stamp}


def of_event(message: Any) -> dict[str, Any]:
    """Read an event of a Kobuki."""
    return {"state": message.state}


def of_log(message: Any) -> dict[str, Any]:
    """Read a line of a log."""
    return {"node": message.name, "text": message.msg}


READERS = {
    "geometry_msgs/PoseWithCovarianceStamped": of_pose,
    "geometry_msgs/PoseArray": of_poses,
    "diagnostic_msgs/DiagnosticArray": of_status,
    "sensor_msgs/LaserScan": lambda _: {},
    "tf2_msgs/TFMessage": of_transforms,
    "kobuki/WheelDropEvent": of_event,
    "std_msgs/Bool": lambda message: {"data": message.data},
    "std_msgs/String": lambda message: {"data": message.data},
    "visualization_msgs/MarkerArray": lambda message: {
        "texts": [marker.text for marker in message.markers if marker.text]
    },
    "rosgraph_msgs/Log": of_log,
}


def main() -> None:
    """Watch until ended."""
    path, *topics = sys.argv[1:]
    rospy.init_node("watcher", anonymous=True)
    with Path(path).open("a", encoding="utf-8", buffering=1) as lines:
        lock = threading.Lock()

        def write(topic: str, message: Any) -> None:
            at = time.time()
            if isinstance(message, rospy.AnyMsg):
                message = decoded(message)
            head = getattr(message, "header", None)
            line = {"topic": topic, "at": at, "stamp": to_seconds(head.stamp) if head else 0.0}
            if head:
                line["frame"] = head.frame_id
            line |= READERS[TYPES[topic]](message)
            with lock:
                lines.write(json.dumps(line) + "\n")

        for topic in topics:
            # The package of a Kobuki's messages is not in Debian.
            known = not TYPES[topic].startswith("kobuki/")
            kind = message_class(TYPES[topic]) if known else rospy.AnyMsg
            rospy.Subscriber(topic, kind, partial(write, topic), tcp_nodelay=True)
        rospy.spin()


if __name__ == "__main__":
    main()
