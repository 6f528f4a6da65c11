"""Recordings from ROS bags, written here with rosbags for both ROS and all storages."""

import math
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from firstfix.core.errors import ScanError
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.formats.bag import load_bag

STORAGES = ("ros1", "sqlite3", "mcap")
SCAN = "sensor_msgs/msg/LaserScan"
TF = "tf2_msgs/msg/TFMessage"
ODOM = "nav_msgs/msg/Odometry"

LEVEL = (0.0, 0.0, 0.0, 1.0)


def turned(yaw: float) -> tuple[float, float, float, float]:
    return (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def turned_over(yaw: float) -> tuple[float, float, float, float]:
    return (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0)  # Rz(yaw) Rx(π)


def pitched(pitch: float) -> tuple[float, float, float, float]:
    return (0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2))


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

    def new(self, kind: str, **fields: Any) -> Any:
        return typestore(self.storage).types[kind](**fields)

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
        self.tf("base_link", "laser", (0.2, 0.1, 0.3), turned(math.pi / 2))
        for i in range(n):
            self.tf("odom", "base_link", (float(i), 0.0, 0.0), stamp=1.0 + i, topic="/tf")
            self.scan(1.0 + i)
        return self

    def write(self) -> Path:
        store = typestore(self.storage)
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


def test_scans_come_with_the_place_of_their_sensor_and_odometry(bag: Bag) -> None:
    recording = load_bag(bag.robot().write())
    assert [scan.stamp for scan in recording.scans] == [1, 2, 3]
    scan = recording.scans[0]
    assert_allclose(scan.ranges, [1, 2, 3])
    assert_allclose(scan.bearings, [-0.5, 0.0, 0.5])
    assert_allclose(scan.T_base_laser.as_array(), [0.2, 0.1, math.pi / 2])
    assert scan.mounting is Mounting.UPRIGHT
    assert (scan.range_min, scan.range_max) == pytest.approx((0.1, 10.0))
    assert recording.odometry is not None
    assert_array_equal(recording.odometry.stamps, [1, 2, 3])
    assert_array_equal(recording.odometry.poses, [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    assert recording.truth is None
    assert recording.notes == ()


def test_bare_storage_files_are_bags_too(tmp_path: Path) -> None:
    for storage, suffix in (("sqlite3", ".db3"), ("mcap", ".mcap")):
        path = Bag(storage, tmp_path / storage).robot().write()
        assert len(load_bag(next(path.glob(f"*{suffix}")))) == 3


@pytest.mark.parametrize("yaw", [-2.0, 0.0, 0.6])
def test_an_upside_down_sensor_sees_what_space_says(bag: Bag, yaw: float) -> None:
    bag.tf("base_link", "laser", (0.2, 0.1, 0.3), turned_over(yaw))
    bag.scan(1.0, ranges=(1.0, 2.0, 3.0), angle_min=0.3)
    scan = load_bag(bag.write()).scans[0]
    assert scan.mounting is Mounting.UPSIDE_DOWN
    c, s = math.cos(yaw), math.sin(yaw)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.diag([1.0, -1.0, -1.0])
    a = np.array([0.3, 0.8, 1.3])
    r = np.array([1.0, 2.0, 3.0])
    points = np.column_stack([r * np.cos(a), r * np.sin(a), 0 * a]) @ R.T + [0.2, 0.1, 0.3]
    assert_allclose(scan.points(), points[:, :2], atol=1e-6)


def test_a_clockwise_sensor_keeps_its_bearings(bag: Bag) -> None:
    bag.tf("base_link", "laser")
    bag.scan(1.0, angle_min=0.5, increment=-0.5)
    assert_allclose(load_bag(bag.write()).scans[0].bearings, [0.5, 0.0, -0.5])


def test_transforms_chain_in_space_and_either_way(bag: Bag) -> None:
    bag.tf("base_link", "camera", (1.0, 0.0, 0.5), (-0.5, 0.5, -0.5, 0.5))  # an optical frame
    bag.tf("laser", "camera", (0.0, 0.2, 0.0), (-0.5, 0.5, -0.5, 0.5))
    bag.scan(1.0)
    scan = load_bag(bag.write()).scans[0]
    assert_allclose(scan.T_base_laser.as_array(), [1.0, -0.2, 0.0], atol=1e-12)


def test_ros1_repeats_static_transforms_and_puts_slashes(ros1: Bag) -> None:
    for i in range(5):
        kind = "tf/msg/tfMessage"
        ros1.tf("/base_link", "/laser", (0.2, 0.0, 0.0), stamp=1.0 + i, topic="/tf", kind=kind)
        ros1.tf("/odom", "/base_link", (float(i), 0, 0), stamp=1.0 + i, topic="/tf", kind=kind)
        ros1.scan(1.0 + i, frame="/laser")
    recording = load_bag(ros1.write())
    assert recording.scans[0].T_base_laser == SE2(0.2, 0.0, 0.0)
    assert recording.odometry is not None
    assert len(recording.odometry) == 5


def test_a_sensor_that_moves_on_the_robot_has_no_place(bag: Bag) -> None:
    for i in range(3):
        bag.tf("base_link", "laser", q=turned(0.1 * i), stamp=1.0 + i, topic="/tf")
        bag.tf("odom", "base_link", (float(i), 0, 0), stamp=1.0 + i, topic="/tf")
        bag.scan(1.0 + i)
    recording = load_bag(bag.write())
    assert "no fixed transforms" in recording.notes[0]
    assert recording.odometry is None


def test_without_transforms_the_base_is_the_sensor_and_that_is_said(bag: Bag) -> None:
    bag.scan(1.0)
    bag.odometry(1.0, 0.0)
    recording = load_bag(bag.write())
    assert recording.scans[0].T_base_laser == SE2.identity()
    assert recording.odometry is None
    assert "no fixed transforms lead from the base to laser" in recording.notes[0]
    assert "/odom does not tell" in recording.notes[1]


def test_scans_in_the_frame_of_the_base_need_no_transform(bag: Bag) -> None:
    bag.scan(1.0, frame="base_link")
    recording = load_bag(bag.write())
    assert recording.scans[0].T_base_laser == SE2.identity()
    assert recording.notes == ()


def test_odometry_messages_serve_where_transforms_are_missing(bag: Bag) -> None:
    bag.tf("base_link", "laser", (0.2, 0.0, 0.0))
    for i in range(3):
        bag.scan(1.0 + i)
        bag.odometry(1.0 + i, 2.0 * i)
        bag.odometry(1.0 + i, -9.0, topic="/another")
    recording = load_bag(bag.write())
    assert recording.odometry is not None
    assert_array_equal(recording.odometry.poses[:, 0], [0, 2, 4])
    assert "odometry is from /odom" in recording.notes[0]


def test_transforms_are_preferred_to_odometry_messages(bag: Bag) -> None:
    bag.robot().odometry(1.0, 77.0)
    odometry = load_bag(bag.write()).odometry
    assert odometry is not None
    assert odometry.poses[:, 0].max() == 2.0


def test_odometry_of_the_footprint_is_taken_to_the_base(bag: Bag) -> None:
    bag.tf("base_footprint", "base_link", (0.5, 0.0, 0.1))
    bag.tf("base_link", "laser", (0.2, 0.0, 0.0))
    for i in range(2):
        bag.tf("odom", "base_footprint", q=turned(i * math.pi / 2), stamp=1.0 + i, topic="/tf")
        bag.scan(1.0 + i)
    recording = load_bag(bag.write())
    assert recording.scans[0].T_base_laser == SE2(0.2, 0.0, 0.0)
    assert recording.odometry is not None
    assert_allclose(recording.odometry.poses[1], [0.0, 0.5, math.pi / 2], atol=1e-12)


def test_a_base_of_any_name_is_known_by_its_odometry(bag: Bag) -> None:
    bag.tf("chassis", "laser", (0.2, 0.0, 0.0))
    bag.odometry(1.0, 0.0, child="chassis")
    bag.scan(1.0)
    recording = load_bag(bag.write())
    assert recording.scans[0].T_base_laser == SE2(0.2, 0.0, 0.0)
    assert recording.odometry is not None


def test_odometry_is_sorted_and_each_stamp_is_kept_once(bag: Bag) -> None:
    bag.tf("base_link", "laser")
    bag.scan(1.0)
    for stamp, x in ((2.0, 2.0), (1.0, 1.0), (2.0, 2.0), (3.0, math.nan), (4.0, 4.0)):
        bag.tf("odom", "base_link", (x, 0.0, 0.0), stamp=stamp, topic="/tf")
    odometry = load_bag(bag.write()).odometry
    assert odometry is not None
    assert_array_equal(odometry.stamps, [1, 2, 4])
    assert_array_equal(odometry.poses[:, 0], [1, 2, 4])


def test_what_a_localizer_published_is_not_the_truth(bag: Bag) -> None:
    bag.robot().tf("map", "odom", (5.0, 0.0, 0.0), topic="/tf")
    recording = load_bag(bag.write())
    assert recording.truth is None
    assert recording.odometry is not None
    assert recording.odometry.poses[0, 0] == 0.0


def test_scans_are_sorted_by_stamp(bag: Bag) -> None:
    bag.tf("base_link", "laser")
    for stamp, at in ((1.0, 1.0), (3.0, 2.0), (2.0, 3.0)):
        bag.scan(stamp, ranges=(stamp,) * 3, at=at)
    recording = load_bag(bag.write())
    assert [float(scan.ranges[0]) for scan in recording.scans] == [1, 2, 3]
    assert "sorted by stamp" in recording.notes[0]


def test_scans_without_a_stamp_get_the_time_of_recording(bag: Bag) -> None:
    bag.tf("base_link", "laser")
    bag.scan(0.0, at=5.0)
    recording = load_bag(bag.write())
    assert recording.scans[0].stamp == pytest.approx(5.0)
    assert "no stamp" in recording.notes[0]


def test_of_several_topics_scan_is_taken(bag: Bag) -> None:
    bag.scan(1.0, topic="/rear/scan", frame="base_link")
    bag.scan(2.0, topic="/scan", frame="base_link")
    path = bag.write()
    assert load_bag(path).scans[0].stamp == 2
    assert load_bag(path, topic="/rear/scan").scans[0].stamp == 1
    assert load_bag(path, topic="rear/scan").scans[0].stamp == 1
    with pytest.raises(ScanError, match=r"on the topic /tf.*/rear/scan \(sensor_msgs"):
        load_bag(path, topic="/tf")


def test_several_topics_without_a_scan_must_be_chosen_from(bag: Bag) -> None:
    bag.scan(1.0, topic="/front")
    bag.scan(2.0, topic="/rear")
    with pytest.raises(ScanError, match=r"/front .*/rear .*name one topic"):
        load_bag(bag.write())


def test_a_bag_without_scans_lists_what_it_has(bag: Bag) -> None:
    bag.odometry(1.0, 0.0)
    with pytest.raises(ScanError, match=r"the topics /odom \(nav_msgs"):
        load_bag(bag.write())


def test_two_sensors_on_one_topic_each_have_their_place(bag: Bag) -> None:
    bag.tf("base_link", "front", (0.3, 0.0, 0.0))
    bag.tf("base_link", "rear", (-0.3, 0.0, 0.0), turned(math.pi))
    bag.scan(1.0, frame="front")
    bag.scan(2.0, frame="rear")
    places = [scan.T_base_laser.x for scan in load_bag(bag.write()).scans]
    assert places == [0.3, -0.3]


def test_two_sensors_on_one_topic_are_refused_without_transforms(bag: Bag) -> None:
    bag.scan(1.0, frame="front")
    bag.scan(2.0, frame="rear")
    with pytest.raises(ScanError, match="scans in the frames front, rear"):
        load_bag(bag.write())


def test_a_slight_tilt_is_said_and_a_steep_one_refused(bag: Bag) -> None:
    bag.tf("base_link", "slight", q=pitched(math.radians(10)))
    bag.tf("base_link", "steep", q=pitched(math.radians(90)))
    bag.scan(1.0, frame="slight", topic="/slight")
    bag.scan(1.0, frame="steep", topic="/steep")
    path = bag.write()
    assert "slight is tilted by 10°" in load_bag(path, topic="/slight").notes[0]
    with pytest.raises(ScanError, match="steep tilted by 90°"):
        load_bag(path, topic="/steep")


def test_only_the_first_scans_are_read_on_request(bag: Bag) -> None:
    bag.robot(8)
    bag.scan(9.0, increment=0.0)
    path = bag.write()
    recording = load_bag(path, max_scans=2)
    assert len(recording) == 2
    assert recording.odometry is not None
    # Enough to interpolate at the last scan, not the whole drive.
    assert recording.odometry.at(2.0) is not None
    assert recording.odometry.stamps[-1] < 5.0
    with pytest.raises(ScanError, match=r"angle_increment 0.0 in scan 8 on /scan in .*drive"):
        load_bag(path)


def test_the_first_scans_are_the_first_by_stamp(bag: Bag) -> None:
    late = [3.0, 1.0, 5.0, 2.0, 4.0, 6.0]
    for i, stamp in enumerate(late):
        bag.scan(stamp, at=10.0 + i)
    path = bag.write()
    for n in range(1, len(late) + 1):
        recording = load_bag(path, max_scans=n)
        assert [scan.stamp for scan in recording.scans] == sorted(late)[:n]
        assert "sorted by stamp" in recording.notes[-1]


def test_a_scan_of_another_definition_is_refused(ros1: Bag) -> None:
    ros1.scan(1.0)
    path = ros1.write()
    digest = typestore("ros1").generate_msgdef(SCAN, ros_version=1)[1].encode()
    path.write_bytes(path.read_bytes().replace(digest, b"0" * 32))
    with pytest.raises(ScanError, match="as ROS defines it on /scan"):
        load_bag(path)


def test_messages_of_another_type_on_the_topic_are_left_out(tmp_path: Path) -> None:
    bag = Bag("ros1", tmp_path / "drive").robot()
    store = typestore("ros1")
    path = bag.path.with_suffix(".bag")
    with Writer1(path) as writer:
        other = writer.add_connection("/scan", "my_msgs/msg/LaserScan", typestore=store)
        writer.write(other, 1, b"abcd")
        right = writer.add_connection("/scan", SCAN, typestore=store)
        for _, kind, _, message in bag.entries:
            if kind == SCAN:
                writer.write(right, 2, store.serialize_ros1(message, kind))
    assert len(load_bag(path)) == 3


def test_an_index_that_points_to_another_topic_is_told(ros1: Bag) -> None:
    path = ros1.robot().write()
    data = path.read_bytes()
    mark = b"conn=\x02\x00\x00\x00"  # in the order of writing: /tf_static, /tf, /scan
    places = [i for i in range(len(data)) if data.startswith(mark, i)]
    told = 0
    for i in places:
        path.write_bytes(data[:i] + b"conn=\x01" + data[i + 6 :])
        try:
            load_bag(path)
        except ScanError as error:
            told += "a message of /tf on /scan" in str(error)
    assert told >= 3  # each of the three scans


def _break(storage: str, path: Path, change: Callable[[bytearray], bytearray]) -> None:
    suffix = {"ros1": ".bag", "sqlite3": ".db3", "mcap": ".mcap"}[storage]
    file = path if path.is_file() else next(path.glob(f"*{suffix}"))
    file.write_bytes(change(bytearray(file.read_bytes())))


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.9])
def test_a_truncated_bag_is_told(bag: Bag, share: float) -> None:
    path = bag.robot(200).write()
    _break(bag.storage, path, lambda data: data[: int(share * len(data))])
    with pytest.raises(ScanError, match="a ROS bag that can be read"):
        load_bag(path)


def test_a_damaged_message_is_told(bag: Bag) -> None:
    path = bag.robot().write()
    mark = b"\x05\x00\x00\x00laser"  # the length of the frame's name, in a scan

    def lengthen(data: bytearray) -> bytearray:
        return data.replace(mark, b"\x05\x00\x00\x70laser").replace(
            b"\x06\x00\x00\x00laser\x00", b"\x06\x00\x00\x70laser\x00"
        )

    _break(bag.storage, path, lengthen)
    with pytest.raises(ScanError, match="a ROS bag that can be read"):
        load_bag(path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("whole")
    return {storage: Bag(storage, folder / storage).robot().write() for storage in STORAGES}


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data(), storage=st.sampled_from(STORAGES))
def test_damage_is_always_a_scan_error(
    tmp_path: Path, whole: dict[str, Path], data: st.DataObject, storage: str
) -> None:
    source = whole[storage]
    file = source if source.is_file() else next(p for p in source.iterdir() if p.suffix != ".yaml")
    content = bytearray(file.read_bytes())
    for _ in range(data.draw(st.integers(1, 6))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    damaged = tmp_path / f"damaged{file.suffix}"
    damaged.write_bytes(content)
    with suppress(ScanError):
        load_bag(damaged)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_metadata_is_always_a_scan_error(
    tmp_path: Path, whole: dict[str, Path], data: st.DataObject
) -> None:
    folder = tmp_path / "bag"
    shutil.copytree(whole["sqlite3"], folder, dirs_exist_ok=True)
    content = bytearray((whole["sqlite3"] / "metadata.yaml").read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    (folder / "metadata.yaml").write_bytes(content[: data.draw(st.integers(0, len(content)))])
    with suppress(ScanError):
        load_bag(folder)


@pytest.mark.shared
@pytest.mark.parametrize(
    ("name", "topic", "case", "n", "place"),
    [
        ("uob_trace0.bag", "/base_scan", "uob_cs_test0", 958, (0.135, 0.0, 0.0)),
        ("olin_ros2", "/scan", "olin_mac1_9_23", 357, (0.00393584, 0.0, math.pi / 2)),
    ],
)
def test_real_bags_hold_what_their_cases_hold(
    shared: Path, name: str, topic: str, case: str, n: int, place: tuple[float, ...]
) -> None:
    recording = load_bag(shared / "bags" / name)
    expected = np.load(shared / "cases" / case / "scans.npz")
    ranges, odometry = expected["ranges"], expected["odom"]  # unpacked once
    assert len(recording) == n
    assert recording.notes == ()
    assert len(load_bag(shared / "bags" / name, topic=topic, max_scans=3)) == 3
    assert recording.odometry is not None
    by_stamp = {scan.stamp: scan for scan in recording.scans}
    for i, stamp in enumerate(expected["stamp"].tolist()):
        scan = by_stamp[stamp]
        assert scan.T_base_laser.distance_to(SE2(*place)) < 1e-9
        hit = np.isfinite(ranges[i])
        assert np.array_equal(scan.ranges[hit], ranges[i][hit])
        # The case has the sensor's odometry: this checks the place and the frames at once.
        T_odom_base = recording.odometry.at(stamp)
        assert (
            T_odom_base is None
            or (T_odom_base @ scan.T_base_laser).distance_to(SE2.from_array(odometry[i])) < 1e-4
        )
