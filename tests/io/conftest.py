"""Bags in the making, of both ROS and all storages."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

STORAGES = ("ros1", "sqlite3", "mcap")
SCAN = "sensor_msgs/msg/LaserScan"
TF = "tf2_msgs/msg/TFMessage"
ODOM = "nav_msgs/msg/Odometry"

LEVEL = (0.0, 0.0, 0.0, 1.0)
TO_THE_LEFT = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))


@cache
def typestore(storage: str) -> Typestore:
    if storage != "ros1":
        return get_typestore(Stores.ROS2_HUMBLE)
    store = get_typestore(Stores.ROS1_NOETIC)
    fields = "geometry_msgs/TransformStamped[] transforms"
    store.register(get_types_from_msg(fields, TF))
    store.register(get_types_from_msg(fields, "tf/msg/tfMessage"))
    store.register(get_types_from_msg("int32 x", "my_msgs/msg/LaserScan"))
    return store


@dataclass
class Bag:
    """A bag in the making: messages are added in the order of their recording."""

    storage: str
    path: Path
    entries: list[tuple[str, str, float, Any]] = field(default_factory=list)

    @property
    def store(self) -> Typestore:
        return typestore(self.storage)

    def new(self, kind: str, **fields: Any) -> Any:
        return self.store.types[kind](**fields)

    def header(self, frame: str, stamp: float) -> Any:
        sec, frac = divmod(stamp, 1.0)
        time = self.new("builtin_interfaces/msg/Time", sec=int(sec), nanosec=round(1e9 * frac))
        seq = {"seq": 0} if self.storage == "ros1" else {}
        return self.new("std_msgs/msg/Header", stamp=time, frame_id=frame, **seq)

    def scan(
        self,
        stamp: float,
        *,
        ranges: Any = (1.0, 2.0, 3.0),
        topic: str = "/scan",
        frame: str = "laser",
        at: float | None = None,
        angle_min: float = -0.5,
        increment: float = 0.5,
    ) -> None:
        message = self.new(
            SCAN,
            header=self.header(frame, stamp),
            angle_min=angle_min,
            angle_max=angle_min + 2 * increment,
            angle_increment=increment,
            time_increment=0.0,
            scan_time=0.1,
            range_min=0.1,
            range_max=10.0,
            ranges=np.array(ranges, np.float32),
            intensities=np.zeros(0, np.float32),
        )
        self.entries.append((topic, SCAN, stamp if at is None else at, message))

    def vector(self, kind: str, values: Any) -> Any:
        return self.new(
            f"geometry_msgs/msg/{kind}", **dict(zip("xyzw", map(float, values), strict=False))
        )

    def tf(
        self,
        parent: str,
        child: str,
        xyz: tuple[float, float, float] = (0.0, 0.0, 0.0),
        q: tuple[float, float, float, float] = LEVEL,
        *,
        stamp: float = 1.0,
        topic: str = "/tf_static",
        kind: str = TF,
    ) -> None:
        transform = self.new(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(parent, stamp),
            child_frame_id=child,
            transform=self.new(
                "geometry_msgs/msg/Transform",
                translation=self.vector("Vector3", xyz),
                rotation=self.vector("Quaternion", q),
            ),
        )
        self.entries.append((topic, kind, stamp, self.new(kind, transforms=[transform])))

    def odometry(
        self, stamp: float, x: float, *, topic: str = "/odom", child: str = "base_link"
    ) -> None:
        pose = self.new(
            "geometry_msgs/msg/Pose",
            position=self.vector("Point", (x, 0, 0)),
            orientation=self.vector("Quaternion", LEVEL),
        )
        still = self.vector("Vector3", (0, 0, 0))
        message = self.new(
            ODOM,
            header=self.header("odom", stamp),
            child_frame_id=child,
            pose=self.new(
                "geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36)
            ),
            twist=self.new(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=self.new("geometry_msgs/msg/Twist", linear=still, angular=still),
                covariance=np.zeros(36),
            ),
        )
        self.entries.append((topic, ODOM, stamp, message))

    def robot(self, n: int = 3) -> "Bag":
        """Add a robot with an offset sensor that drives 1 m a second, and its scans."""
        self.tf("base_link", "laser", (0.2, 0.1, 0.3), TO_THE_LEFT)
        for i in range(n):
            self.tf("odom", "base_link", (float(i), 0.0, 0.0), stamp=1.0 + i, topic="/tf")
            self.scan(1.0 + i)
        return self

    def write(self) -> Path:
        store = self.store
        if self.storage == "ros1":
            writer: Any = Writer1(self.path.with_suffix(".bag"))
            serialize = store.serialize_ros1
        else:
            plugin = StoragePlugin[self.storage.upper()]
            writer = Writer2(self.path, version=9, storage_plugin=plugin)
            serialize = store.serialize_cdr
        with writer:
            connections = {}
            for topic, kind, at, message in self.entries:
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=store)
                writer.write(connections[topic], round(1e9 * at), serialize(message, kind))
        path: Path = writer.path
        return path


@pytest.fixture(params=STORAGES)
def bag(request: pytest.FixtureRequest, tmp_path: Path) -> Bag:
    return Bag(request.param, tmp_path / "drive")


@pytest.fixture
def ros1(tmp_path: Path) -> Bag:
    return Bag("ros1", tmp_path / "drive")


@pytest.fixture(scope="session")
def new_bag() -> Callable[[str, Path], Bag]:
    """Give a function that begins a bag of a storage, to be written under a name without suffix."""
    return Bag
