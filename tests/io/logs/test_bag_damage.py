"""Bags that are damaged, or not what they seem."""

import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rosbags.rosbag1 import Writer as Writer1

from firstfix.core.errors import ScanError
from firstfix.io.logs.bag import load_bag

STORAGES = ("ros1", "sqlite3", "mcap")
SCAN = "sensor_msgs/msg/LaserScan"


def test_a_scan_of_another_definition_is_refused(ros1) -> None:
    ros1.scan(1.0)
    path = ros1.write()
    digest = ros1.store.generate_msgdef(SCAN, ros_version=1)[1].encode()
    path.write_bytes(path.read_bytes().replace(digest, b"0" * 32))
    with pytest.raises(ScanError, match="as ROS defines it on /scan"):
        load_bag(path)


def test_messages_of_another_type_on_the_topic_are_left_out(ros1) -> None:
    ros1.robot()
    store = ros1.store
    path = ros1.path.with_suffix(".bag")
    with Writer1(path) as writer:
        other = writer.add_connection("/scan", "my_msgs/msg/LaserScan", typestore=store)
        writer.write(other, 1, b"abcd")
        right = writer.add_connection("/scan", SCAN, typestore=store)
        for _, kind, _, message in ros1.entries:
            if kind == SCAN:
                writer.write(right, 2, store.serialize_ros1(message, kind))
    assert len(load_bag(path)) == 3


def test_an_index_that_points_to_another_topic_is_rejected(ros1) -> None:
    path = ros1.robot().write()
    data = path.read_bytes()
    mark = b"conn=\x02\x00\x00\x00"  # in the order of writing: /tf_static, /tf, /scan
    places = [i for i in range(len(data)) if data.startswith(mark, i)]
    rejected = 0
    for i in places:
        path.write_bytes(data[:i] + b"conn=\x01" + data[i + 6 :])
        try:
            load_bag(path)
        except ScanError as error:
            rejected += "a message of /tf on /scan" in str(error)
    assert rejected >= 3  # each of the three scans


def _break(storage: str, path: Path, change: Callable[[bytearray], bytearray]) -> None:
    suffix = {"ros1": ".bag", "sqlite3": ".db3", "mcap": ".mcap"}[storage]
    file = path if path.is_file() else next(path.glob(f"*{suffix}"))
    file.write_bytes(change(bytearray(file.read_bytes())))


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.9])
def test_a_truncated_bag_is_rejected(bag, share: float) -> None:
    path = bag.robot(200).write()
    _break(bag.storage, path, lambda data: data[: int(share * len(data))])
    with pytest.raises(ScanError, match="a ROS bag that can be read"):
        load_bag(path)


def test_a_damaged_message_is_rejected(bag) -> None:
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
def whole(new_bag, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("whole")
    return {storage: new_bag(storage, folder / storage).robot().write() for storage in STORAGES}


@settings(
    max_examples=2 * settings.default.max_examples,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
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
