"""The messages of a ROS bag, of either ROS and any storage."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag2 import Reader as Reader2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from firstfix.core.errors import ScanError
from firstfix.io.logs.checks import unreadable

SCAN = "sensor_msgs/msg/LaserScan"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
ODOMETRY = "nav_msgs/msg/Odometry"
CLOUD = "sensor_msgs/msg/PointCloud2"
DEPTH = "sensor_msgs/msg/Image"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"

# Before ROS Groovy: the same fields under another name.
_OLD_NAMES = {"tf/msg/tfMessage": TRANSFORMS}


class BagFile:
    """A bag that is open for reading; a context manager.

    These messages have the same definition in every ROS, so the definitions inside the bag, which
    are not trusted, are not used.

    Parameters
    ----------
    path : Path
        A ``.bag``, ``.db3`` or ``.mcap`` file, or the folder of a ROS 2 bag.

    Raises
    ------
    ScanError
        In every method, if the bag is damaged.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._is_ros1 = path.suffix.lower() == ".bag"
        self._connections: list[Connection] = []
        with self._damage_as_scan_error():
            self._reader = Reader1(path) if self._is_ros1 else Reader2(path)
            self._store = _ros1_types() if self._is_ros1 else _ros2_types()

    def __enter__(self) -> BagFile:
        with self._damage_as_scan_error():
            self._reader.open()
            self._connections = [c for c in self._reader.connections if c.msgcount]
            for connection in self._connections:
                _check_names(connection)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._damage_as_scan_error():
            self._reader.close()

    def topics(self) -> list[tuple[str, str]]:
        """Return the topics that have messages, each with its type, sorted."""
        return sorted({(c.topic, _type_of(c)) for c in self._connections})

    def topics_of(self, kind: str) -> list[str]:
        """Return the topics that have messages of a type, sorted."""
        return [topic for topic, its_kind in self.topics() if its_kind == kind]

    def messages(
        self, kind: str, topics: Collection[str], *, until_ns: int | None = None
    ) -> Iterator[tuple[int, Any]]:
        """Yield decoded messages in the order of their recording.

        Parameters
        ----------
        kind : str
            One of the types that this module names.
        topics : collection of str
            Topics; messages of other types on them are skipped.
        until_ns : int or None
            Stop at this time of recording, ns.

        Yields
        ------
        int
            Time of recording, ns.
        message
            With the fields of its definition.
        """
        wanted = [c for c in self._connections if c.topic in topics and _type_of(c) == kind]
        if not wanted:
            return
        for connection in wanted:
            self._check_definition(connection)
        with self._damage_as_scan_error():
            stream = self._reader.messages(wanted, stop=until_ns)
        while True:
            with self._damage_as_scan_error():
                item = next(stream, None)
                if item is None:
                    return
                connection, time_ns, raw = item
                if connection not in wanted:  # the index and the message disagree
                    raise ValueError(f"a message of {connection.topic} on {', '.join(topics)}")
                message = self._decode(raw, kind)
                time_ns = int(time_ns)
            yield time_ns, message

    def _decode(self, raw: bytes, kind: str) -> Any:
        if self._is_ros1:
            return self._store.deserialize_ros1(raw, kind)
        return self._store.deserialize_cdr(raw, kind)

    def _check_definition(self, connection: Connection) -> None:
        if not self._is_ros1 or connection.digest in ("", "*"):
            return
        digest = self._store.generate_msgdef(_type_of(connection), ros_version=1)[1]
        if connection.digest != digest:
            raise ScanError(
                expected=f"{connection.msgtype} as ROS defines it on {connection.topic}",
                received=f"another definition in {self._path}",
                remedy="convert the messages to the standard type",
            )

    @contextmanager
    def _damage_as_scan_error(self) -> Iterator[None]:
        try:
            yield
        # After a flipped byte, rosbags and its libraries (SQLite, LZ4, Zstandard, YAML, generated
        # decoders) raise nearly anything, depending on the version. Only their code runs here.
        except Exception as error:
            raise unreadable(self._path, "a ROS bag", error) from error


def _check_names(connection: Connection) -> None:
    # SQLite does not check types: a damaged name can be a number or NULL.
    if not (isinstance(connection.topic, str) and isinstance(connection.msgtype, str)):
        raise TypeError(f"a topic {connection.topic!r} of the type {connection.msgtype!r}")


def _type_of(connection: Connection) -> str:
    return _OLD_NAMES.get(connection.msgtype, connection.msgtype)


@cache  # a tenth of a second each
def _ros2_types() -> Typestore:
    return get_typestore(Stores.ROS2_HUMBLE)


@cache
def _ros1_types() -> Typestore:
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS))
    return store
