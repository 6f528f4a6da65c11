"""A transport that keeps what is published, and a robot that speaks in messages."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import laser_scan, occupancy_grid, transforms
from firstfix.lab.simulation.lidar import Lidar
from firstfix.ros.channels import PARTICLES, Channel, Topic
from firstfix.ros.transport import Severity

ODOM, BASE, LASER = "odom", "base_footprint", "laser"
T_BASE_LASER = SE2(0.1, 0.0, 0.0)


class Recorder:
    """Everything that was published, as it would arrive, and all lines of the log.

    `wire` makes messages, and sends them to bytes and back. `listening` has the number of listeners
    by the name of the topic.
    """

    def __init__(self, wire: Any, particles: Topic = PARTICLES) -> None:
        self.wire = wire
        self.particles = particles
        self.listening: dict[str, int] = {}
        self.published: list[tuple[Topic, Any]] = []
        self.lines: list[tuple[Severity, str]] = []
        self.threads: set[str] = set()
        self.map_server: list[tuple[str, str]] | None = []  # calls; None: it is away

    def make(self, type_name: str, /, **fields: Any) -> Any:
        return self.wire.make(type_name, **fields)

    def publish(self, topic: Topic, message: Any) -> None:
        self.threads.add(threading.current_thread().name)
        kind = "/".join(message.__msgtype__.split("/msg/"))
        assert kind == topic.type_name
        self.published.append((topic, self.wire.sent(message)))

    def subscriber_count(self, topic: Topic) -> int:
        return self.listening.get(topic.name, 0)

    def load_map(self, service: str, path: str) -> int:
        if self.map_server is None:
            raise OSError(f"there is no service {service}")
        self.map_server.append((service, path))
        return 0

    def log(self, severity: Severity, text: str) -> None:
        self.lines.append((severity, text))

    def on(self, topic: Topic) -> list[Any]:
        """Return the messages of a topic, in order."""
        return [message for where, message in self.published if where is topic]

    def logged(self, severity: Severity) -> list[str]:
        """Return the lines of the log that are that grave."""
        return [text for how, text in self.lines if how is severity]


def point_cloud(make: Any, header: Any, xyz: Any, **changes: Any) -> Any:
    """Build a ``sensor_msgs/PointCloud2`` of points, shape (n, 3); changes replace its fields."""
    data = np.asarray(xyz, "<f4")
    fields = [
        make("sensor_msgs/PointField", name=name, offset=4 * i, datatype=7, count=1)
        for i, name in enumerate("xyz")
    ]
    parts = {
        "header": header,
        "height": 1,
        "width": len(data),
        "fields": fields,
        "is_bigendian": False,
        "point_step": 12,
        "row_step": 12 * len(data),
        "data": np.frombuffer(data.tobytes(), np.uint8),
        "is_dense": True,
    }
    return make("sensor_msgs/PointCloud2", **(parts | changes))


class Speaker:
    """The messages of a robot that stands or drives in a drawn world."""

    def __init__(self, wire: Any, world: OccupancyGrid, pose: SE2, stamp: float = 100.0) -> None:
        self.wire = wire
        self.world = world
        self.pose = pose
        self.stamp = stamp
        self.T_odom_base = SE2(-3.0, 7.0, 2.0)
        self._lidar = Lidar(beams=180, T_base_laser=T_BASE_LASER)
        self._rng = np.random.default_rng(0)

    def move(self, moved: SE2 | None = None, seconds: float = 0.1) -> None:
        """Let time pass."""
        self.stamp = round(self.stamp + seconds, 6)
        self.pose = self.pose @ (moved or SE2.identity())
        self.T_odom_base = self.T_odom_base @ (moved or SE2.identity())

    def map(self, frame: str = "map") -> Any:
        return self.wire.sent(occupancy_grid(self.wire.make, 1.0, frame, self.world))

    def fixed(self) -> Any:
        return self.wire.sent(transforms(self.wire.make, 0.0, BASE, LASER, T_BASE_LASER))

    def tf(self) -> Any:
        return self.wire.sent(transforms(self.wire.make, self.stamp, ODOM, BASE, self.T_odom_base))

    def scan(self, frame: str = LASER) -> Any:
        scan = self._lidar.scan(self.world, self.pose, self._rng, self.stamp)
        return self.wire.sent(laser_scan(self.wire.make, frame, scan))

    def report(self, callback: Callable[[Channel, Any], Any]) -> list[Any]:
        """Tell odometry, then the scan at the same time; return what was answered."""
        return [callback(Channel.TF, self.tf()), callback(Channel.SCAN, self.scan())]


def wait_for(what: Callable[[], Any], seconds: float = 240.0) -> Any:
    """Wait until something is so, and return it; the kernels may have to be compiled first."""
    end = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < end, "it has not happened"
        time.sleep(0.01)
    return found
