"""The observers of `soak.py`: messages of a ROS 1 node and of its page, as lines of JSON.

python benchmarks/soak_observer.py ros FILE
python benchmarks/soak_observer.py page FILE WEBSOCKET_URL
"""

from __future__ import annotations

import asyncio
import json
import sys
import threading
import time
from functools import partial
from pathlib import Path
from typing import Any

NODE = "/firstfix"
POSE = "geometry_msgs/PoseWithCovarianceStamped"
TOPICS = {
    "amcl_pose": POSE,
    "initialpose": POSE,
    "/tf": "tf2_msgs/TFMessage",
    "localization_status": "diagnostic_msgs/DiagnosticArray",
}
_CONNECT_AGAIN_S = 0.5
_HANDSHAKE_S = 3.0


class Lines:
    """A file of JSON, a line each, from any thread."""

    def __init__(self, path: str) -> None:
        self._file = Path(path).open("a", encoding="utf-8", buffering=1)  # noqa: SIM115 - to the end
        self._lock = threading.Lock()

    def write(self, **line: Any) -> None:
        """Write a line."""
        with self._lock:
            self._file.write(json.dumps(line) + "\n")


def listen(lines: Lines) -> None:
    """Record what the node publishes, and no other node."""
    import rospy
    from soak_robot import stay_known

    from firstfix.io.ros_messages.incoming import planar, to_pose, to_seconds, to_transform
    from firstfix.ros.ros1.types import message_class

    def hear(topic: str, message: Any) -> None:
        at = time.time()
        if message._connection_header["callerid"] != NODE:
            return
        if topic == "/tf":
            for transform in map(to_transform, message.transforms):
                pose = planar(transform)
                lines.write(topic=topic, at=at, stamp=transform.stamp, pose=pose)
        elif topic == "localization_status":
            values = {value.key: value.value for value in message.status[0].values}
            stamp, text = to_seconds(message.header.stamp), message.status[0].message
            lines.write(topic=topic, at=at, stamp=stamp, state=values["state"], text=text)
        else:
            told = to_pose(message)
            lines.write(topic=topic, at=at, stamp=told.stamp, pose=planar(told))

    rospy.init_node("observer")
    for topic, kind in TOPICS.items():
        rospy.Subscriber(topic, message_class(kind), partial(hear, topic), tcp_nodelay=True)
    stay_known()
    rospy.spin()


async def look(lines: Lines, url: str) -> None:
    """Record what the page receives; reconnect after an interruption."""
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException

    while True:
        try:
            async with connect(url, open_timeout=_HANDSHAKE_S, close_timeout=1) as viewer:
                lines.write(what="open", at=time.time())
                async for message in viewer:
                    if isinstance(message, str):
                        see(lines, json.loads(message))
        except (OSError, WebSocketException, asyncio.TimeoutError) as error:
            lines.write(what="cut", at=time.time(), why=type(error).__name__)
        await asyncio.sleep(_CONNECT_AGAIN_S)


def see(lines: Lines, message: dict[str, Any]) -> None:
    """Record a message to the page."""
    what, at = message["type"], time.time()
    if what == "state":
        lines.write(what=what, at=at, stamp=message["stamp"], state=message["state"])
    elif what == "error" or message.get("kind") == "warning":
        lines.write(what="complaint", at=at, text=message.get("detail") or message["text"])


def main() -> None:
    """Watch until ended."""
    kind, path, *url = sys.argv[1:]
    if kind == "ros":
        listen(Lines(path))
    else:
        asyncio.run(look(Lines(path), *url))


if __name__ == "__main__":
    main()
