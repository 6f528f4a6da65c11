"""Fuzz targets: every reader of files and of network messages.

A target takes arbitrary bytes, and may raise only errors of firstfix. `seeds` makes valid inputs.
"""

from __future__ import annotations

import asyncio
import functools
import gzip
import io
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore
from starlette.exceptions import HTTPException

from firstfix.core.errors import FirstfixError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.io.logs.load import load_recording
from firstfix.io.logs.tum import load_trajectory
from firstfix.io.maps import image
from firstfix.io.maps.check import check_map
from firstfix.io.maps.map_server import load_map, save_map
from firstfix.io.ros_messages.incoming import (
    to_grid,
    to_laser_scan,
    to_odometry,
    to_planar,
    to_pose,
    to_transform,
)
from firstfix.io.saved_pose import SavedPose, load_pose, save_pose
from firstfix.ros.arguments import settings_from
from firstfix.ros.parameters import load_node_config
from firstfix.web.commands import ClientMessage
from firstfix.web.json_decoding import decode
from firstfix.web.locate_queue import LocateQueue
from firstfix.web.request_body import JSON, NPZ
from firstfix.web.snapshot import ActiveMap

MAX_CELLS = 1_000_000
_HEADER = b"image: map.%s\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
_THRESHOLDS = b"occupied_thresh: 0.65\nfree_thresh: 0.196\n"
_CARMEN = (
    b"PARAM laser_front_laser_resolution 1.0\n"
    b"FLASER 5 1.0 1.1 1.2 1.3 1.4 0.1 0.2 0.3 0.1 0.2 0.3 100.5 host 0.5\n"
    b"ODOM 0.1 0.2 0.3 0.0 0.0 0.0 100.6 host 0.6\n"
    b"ROBOTLASER1 0 -1.57 3.14 0.78 80.0 0.01 0 5 1.0 1.1 1.2 1.3 1.4 0 "
    b"0.1 0.2 0.3 0.1 0.2 0.3 0.0 0.0 0.0 0.0 0.0 101.0 host 1.0\n"
)

Target = Callable[[bytes, Path], None]


def read_map_yaml(data: bytes, folder: Path) -> None:
    """Read a map YAML with a valid image."""
    (folder / "map.pgm").write_bytes(b"P5 3 2 255\n" + bytes([0, 205, 254, 0, 205, 254]))
    (folder / "map.yaml").write_bytes(data)
    load_map(folder / "map.yaml")
    check_map(folder / "map.yaml")


def _image_of(kind: str) -> Target:
    def read(data: bytes, folder: Path) -> None:
        (folder / "map.yaml").write_bytes(_HEADER % kind.encode() + _THRESHOLDS)
        (folder / f"map.{kind}").write_bytes(data)
        with patch.object(image, "MAX_CELLS", MAX_CELLS):
            load_map(folder / "map.yaml")

    return read


def _recording_of(kind: str) -> Target:
    def read(data: bytes, folder: Path) -> None:
        path = folder / f"drive{kind}"
        path.write_bytes(data)
        load_recording(path, max_scans=50)

    return read


def read_npz_member(data: bytes, folder: Path) -> None:
    """Read a valid archive with a damaged array: checksums stop raw mutations."""
    path = folder / "drive.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("ranges.npy", data)
        for name, value in (("angle_min", -1.0), ("angle_increment", 0.1)):
            archive.writestr(f"{name}.npy", _npy(np.float64(value)))
        archive.writestr("range_min.npy", _npy(np.float64(0.1)))
        archive.writestr("range_max.npy", _npy(np.float64(10.0)))
    load_recording(path, max_scans=50)


def read_bag_message(data: bytes, folder: Path) -> None:
    """Read a valid bag with a damaged message: SQLite refuses most raw mutations."""
    with Writer2(folder / "drive", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        store, kind = get_typestore(Stores.ROS2_HUMBLE), "sensor_msgs/msg/LaserScan"
        writer.write(writer.add_connection("/scan", kind, typestore=store), 10**9, data)
    load_recording(folder / "drive", max_scans=50)


def read_parameters(data: bytes, folder: Path) -> None:
    """Read a parameter file of Nav2."""
    (folder / "nav2.yaml").write_bytes(data)
    load_node_config(folder / "nav2.yaml")


def read_saved_pose(data: bytes, folder: Path) -> None:
    """Read a saved pose."""
    (folder / "pose.json").write_bytes(data)
    load_pose(folder / "pose.json")


def read_tum(data: bytes, folder: Path) -> None:
    """Read a trajectory."""
    (folder / "track.tum").write_bytes(data)
    load_trajectory(folder / "track.tum")


def read_node_parameters(data: bytes, folder: Path) -> None:
    """Read a parameter file of the node."""
    (folder / "node.yaml").write_bytes(data)
    settings_from(
        node="firstfix", amcl_file=None, files=[folder / "node.yaml"], assignments=[], options={}
    )


def read_node_argument(data: bytes, _: Path) -> None:
    """Read a parameter from the command line."""
    text = data.decode(errors="replace")
    settings_from(node="firstfix", amcl_file=None, files=[], assignments=[text], options={})


def read_command(data: bytes, _: Path) -> None:
    """Read a command of the live page."""
    decode(data, ClientMessage)


def _search_for(kind: str) -> Target:
    def read(data: bytes, _: Path) -> None:
        with suppress(HTTPException):
            asyncio.run(LocateQueue().locate(data, kind, None, _small_map()))

    return read


@functools.cache
def _small_map() -> ActiveMap:
    cells = np.zeros((40, 60), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = cells[20, 10:30] = 100
    grid = OccupancyGrid(cells, 0.1)
    return ActiveMap("small", "key", grid, ScanMatcher(grid))


# Converter of each message type; with DDS, any computer in the network can send the bytes.
_CONVERSIONS: dict[str, Callable[[Any], object]] = {
    "sensor_msgs/LaserScan": lambda message: to_laser_scan(
        message, T_base_laser=SE2(0.0, 0.0, 0.0), mounting=Mounting.UPRIGHT
    ),
    "nav_msgs/OccupancyGrid": to_grid,
    "nav_msgs/Odometry": lambda message: to_planar(to_odometry(message)),
    "geometry_msgs/PoseWithCovarianceStamped": lambda message: to_planar(to_pose(message)),
    "tf2_msgs/TFMessage": lambda message: [
        to_planar(to_transform(one)) for one in message.transforms
    ],
}


def _cdr_of(kind: str) -> Target:
    def read(data: bytes, _: Path) -> None:
        from firstfix.ros.dds.types import decode

        _CONVERSIONS[kind](decode(kind, data))

    return read


TARGETS: dict[str, Target] = {
    "map_yaml": read_map_yaml,
    "map_pgm": _image_of("pgm"),
    "map_png": _image_of("png"),
    "map_bmp": _image_of("bmp"),
    "npz": _recording_of(".npz"),
    "npz_member": read_npz_member,
    "carmen": _recording_of(".log"),
    "carmen_gz": _recording_of(".log.gz"),
    "bag1": _recording_of(".bag"),
    "bag2_db3": _recording_of(".db3"),
    "bag2_mcap": _recording_of(".mcap"),
    "bag2_message": read_bag_message,
    "parameters": read_parameters,
    "saved_pose": read_saved_pose,
    "tum": read_tum,
    "node_parameters": read_node_parameters,
    "node_argument": read_node_argument,
    "command": read_command,
    "locate_json": _search_for(JSON),
    "locate_npz": _search_for(NPZ),
}
if find_spec("cyclonedds"):
    TARGETS |= {f"cdr_{kind.partition('/')[2]}": _cdr_of(kind) for kind in _CONVERSIONS}


def try_one(name: str, data: bytes) -> None:
    """Run a target; only errors of firstfix are caught."""
    with tempfile.TemporaryDirectory(prefix="firstfix-fuzz-") as folder, suppress(FirstfixError):
        TARGETS[name](data, Path(folder))


def seeds(name: str, folder: Path) -> Iterator[bytes]:
    """Make valid inputs of a target."""
    if name in ("command", "locate_json", "locate_npz") or name.startswith(("cdr_", "node_")):
        yield from _network_seeds(name)
    elif name == "map_yaml":
        yield _HEADER % b"pgm" + _THRESHOLDS
        yield _HEADER % b"pgm" + _THRESHOLDS + b"mode: scale\n"
    elif name.startswith("map_"):
        yield from _images(name.removeprefix("map_"), folder)
    elif name == "npz_member":
        yield _npy(np.linspace(0.5, 5.0, 20, dtype=np.float32).reshape(2, 10))
    elif name == "npz":
        buffer = io.BytesIO()
        ranges = np.ones((2, 10), np.float32)
        np.savez(buffer, ranges=ranges, angle_min=-1.0, angle_increment=0.1, range_min=0.1,
                 range_max=10.0, true_pose=np.zeros((2, 3)))  # fmt: skip
        yield buffer.getvalue()
    elif name.startswith("carmen"):
        yield _CARMEN if name == "carmen" else gzip.compress(_CARMEN)
    elif name == "bag2_message":
        store = get_typestore(Stores.ROS2_HUMBLE)
        yield bytes(store.serialize_cdr(_scan(store), "sensor_msgs/msg/LaserScan"))
    elif name.startswith("bag"):
        yield _bag(name, folder)
    elif name == "parameters":
        yield b"amcl:\n  ros__parameters:\n    max_beams: 60\n    initial_pose: {x: 1.0, y: 2.0}\n"
    elif name == "saved_pose":
        saved = SavedPose(SE2(1.0, 2.0, 0.5), np.eye(3), 10.0, SE2(0.0, 0.0, 0.0), "key")
        save_pose(folder / "pose.json", saved)
        yield (folder / "pose.json").read_bytes()
    else:
        yield b"# t x y z qx qy qz qw\n1.0 2.0 3.0 0.0 0.0 0.0 0.0 1.0\n"


def _network_seeds(name: str) -> Iterator[bytes]:
    if name == "command":
        yield b'{"type": "pose", "x": 1.5, "y": -2, "yaw": 0.1}'
        yield b'{"type": "people", "count": 5}'
    elif name == "locate_json":
        yield (
            b'{"ranges": [1.0, 2.0, null, 1.5], "angle_min": -1.0, "angle_increment": 0.5, '
            b'"range_min": 0.1, "range_max": 10.0, "T_base_laser": [0.1, 0.0, 0.0], "map": "small"}'
        )
    elif name == "locate_npz":
        buffer = io.BytesIO()
        np.savez(buffer, ranges=np.ones((1, 10), np.float32), angle_min=-1.0, angle_increment=0.1,
                 range_min=0.1, range_max=10.0)  # fmt: skip
        yield buffer.getvalue()
    elif name == "node_parameters":
        yield b"firstfix:\n  ros__parameters:\n    mode: full\n    alpha1: 0.1\n"
    elif name == "node_argument":
        yield b"mode:=full"
        yield b"alpha1:=0.1"
    else:
        store, kind = get_typestore(Stores.ROS2_IRON), name.removeprefix("cdr_")
        full = next(one for one in _CONVERSIONS if one.endswith("/" + kind)).replace("/", "/msg/")
        message = _scan(store) if kind == "LaserScan" else _good(store, full)
        yield bytes(store.serialize_cdr(message, full))


def _good(store: Any, kind: str) -> Any:
    """Make a message with values: positions are (1, 2, 0), lists have one element."""
    made = {}
    for field, (node, detail) in store.fielddefs[kind][1]:
        if node == Nodetype.NAME:
            made[field] = _good(store, detail)
        elif node == Nodetype.BASE:
            made[field] = "map" if detail[0] == "string" else _plain(field)
        elif detail[0][0] == Nodetype.NAME:
            made[field] = [_good(store, detail[0][1])]
        else:
            dtype = np.dtype(detail[0][1][0])
            made[field] = np.zeros(detail[1] or 1, dtype)
    return store.types[kind](**made)


def _plain(field: str) -> int | float:
    return {"width": 1, "height": 1, "sec": 1, "nanosec": 5}.get(field, 0) or float(
        field in ("w", "x", "resolution")
    )


def _images(kind: str, folder: Path) -> Iterator[bytes]:
    from PIL import Image

    grid = OccupancyGrid(np.array([[0, 100, -1], [0, 0, 100]], np.int8), 0.05)
    save_map(grid, folder / "seed.yaml")
    picture = Image.open(next(p for p in folder.glob("seed.*") if p.suffix != ".yaml"))
    for mode in ("L", "RGB") if kind == "pgm" else ("L", "RGB", "P", "RGBA"):
        if kind == "bmp" and mode == "RGBA":
            continue
        buffer = io.BytesIO()
        picture.convert(mode).save(buffer, "PPM" if kind == "pgm" else kind.upper())
        yield buffer.getvalue()
    if kind == "pgm":
        yield b"P2 3 2 15\n0 1 2 3 4 15\n"


def _bag(name: str, folder: Path) -> bytes:
    if name == "bag1":
        store, path = get_typestore(Stores.ROS1_NOETIC), folder / "seed.bag"
        with Writer1(path) as writer:
            connection = writer.add_connection(
                "/scan", "sensor_msgs/msg/LaserScan", typestore=store
            )
            message = _scan(store, seq=0)
            raw = store.serialize_ros1(message, "sensor_msgs/msg/LaserScan")
            writer.write(connection, 10**9, raw)
        return path.read_bytes()
    store, path = get_typestore(Stores.ROS2_HUMBLE), folder / "seed"
    plugin = StoragePlugin.MCAP if name.endswith("mcap") else StoragePlugin.SQLITE3
    with Writer2(path, version=9, storage_plugin=plugin) as writer2:
        topic = writer2.add_connection("/scan", "sensor_msgs/msg/LaserScan", typestore=store)
        raw = store.serialize_cdr(_scan(store), "sensor_msgs/msg/LaserScan")
        writer2.write(topic, 10**9, raw)
    return next(p for p in path.iterdir() if p.suffix != ".yaml").read_bytes()


def _scan(store: object, **head: int) -> object:
    types = store.types  # type: ignore[attr-defined]
    stamp = types["builtin_interfaces/msg/Time"](sec=1, nanosec=5)
    header = types["std_msgs/msg/Header"](**head, stamp=stamp, frame_id="laser")
    return types["sensor_msgs/msg/LaserScan"](
        header=header, angle_min=-1.0, angle_max=1.0, angle_increment=0.2, time_increment=0.0,
        scan_time=0.0, range_min=0.1, range_max=10.0, ranges=np.ones(10, np.float32),
        intensities=np.empty(0, np.float32),
    )  # fmt: skip


def _npy(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()
