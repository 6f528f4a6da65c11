import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("cyclonedds")

import contextlib

from cyclonedds.idl import IdlStruct
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import to_grid, to_pose, to_pressed
from firstfix.io.ros_messages.outgoing import (
    Level,
    diagnostics,
    laser_scan,
    occupancy_grid,
    odometry,
    particle_cloud,
    place_markers,
    pose_array,
    pose_with_covariance,
    transforms,
)
from firstfix.ros.channels import PARTICLES, published_topics, subscriptions
from firstfix.ros.dds import types as dds_types
from firstfix.ros.dds.graph import GRAPH
from firstfix.ros.dds.types import Cdr, decode, described, encode, make, type_hash
from firstfix.ros.node_config import Mode, NodeConfig

POSE = SE2(1.0, -2.0, 0.5)
MADE = {
    "sensor_msgs/LaserScan": laser_scan(
        make, "laser", LaserScan([1.0, np.inf], -0.1, 0.2, 0.1, 9.0, stamp=12.5)
    ),
    "nav_msgs/OccupancyGrid": occupancy_grid(
        make, 3.0, "map", OccupancyGrid(np.arange(6, dtype=np.int8).reshape(2, 3), 0.05, POSE)
    ),
    "tf2_msgs/TFMessage": transforms(make, 1.5, "map", "odom", POSE),
    "nav_msgs/Odometry": odometry(make, 1.5, "odom", "base_link", POSE),
    "geometry_msgs/PoseWithCovarianceStamped": pose_with_covariance(
        make, 2.0, "map", POSE, np.diag([0.1, 0.2, 0.3])
    ),
    "geometry_msgs/PoseArray": pose_array(make, 2.0, "map", [POSE, SE2.identity()]),
    "nav2_msgs/ParticleCloud": particle_cloud(
        make, 2.0, "map", np.array([[1.0, 2.0, 3.0]] * 2), np.array([0.25, 0.75])
    ),
    "diagnostic_msgs/DiagnosticArray": diagnostics(
        make, 2.0, "firstfix", Level.WARN, "SEARCHING: é", {"state": "SEARCHING", "": ""}
    ),
    "sensor_msgs/PointCloud2": make("sensor_msgs/PointCloud2", height=1, width=0),
    "sensor_msgs/Image": make("sensor_msgs/Image", encoding="16UC1"),
    "sensor_msgs/CameraInfo": make("sensor_msgs/CameraInfo", k=np.eye(3).ravel()),
    "kobuki/CliffEvent": make("kobuki/CliffEvent", sensor=1, state=1, bottom=700),
    "kobuki/WheelDropEvent": make("kobuki/WheelDropEvent", wheel=1, state=1),
    "kobuki/BumperEvent": make("kobuki/BumperEvent", bumper=2, state=0),
    "std_msgs/Bool": make("std_msgs/Bool", data=True),
    "std_msgs/String": make("std_msgs/String", data="floor é"),
    "visualization_msgs/MarkerArray": place_markers(make, 1.0, "map", [(SE2.identity(), 0.5)]),
}


@pytest.fixture(scope="module")
def rosbags_own():
    """A typestore that nothing of firstfix has touched."""
    store = get_typestore(Stores.ROS2_JAZZY if hasattr(Stores, "ROS2_JAZZY") else Stores.ROS2_IRON)
    for name, text in dds_types._DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


def test_every_type_of_a_channel_is_tested_here():
    config = NodeConfig(cloud_topics="points", depth_topics="depth/image")
    topics = [topic for _, topic in subscriptions(config)]
    for mode in Mode:
        topics += published_topics(NodeConfig(mode=mode), PARTICLES)
    assert {topic.type_name for topic in topics} == MADE.keys()


@pytest.mark.parametrize("kind", MADE)
def test_messages_are_read_as_they_were_written(kind, rosbags_own):
    name = dds_types.full_name(kind)
    data = encode(kind, MADE[kind])
    assert data[:4] == b"\0\1\0\0"  # little-endian CDR
    there = rosbags_own.deserialize_cdr(data, name)
    assert bytes(rosbags_own.serialize_cdr(there, name)) == data
    assert encode(kind, decode(kind, data)) == data
    other_order = rosbags_own.serialize_cdr(there, name, little_endian=False)
    assert encode(kind, decode(kind, bytes(other_order))) == data


def test_messages_arrive_unchanged():
    grid = to_grid(decode("nav_msgs/OccupancyGrid", encode(*only("nav_msgs/OccupancyGrid"))))
    assert grid.cells.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert grid.T_map_grid.x == POSE.x
    pose = to_pose(decode(*there("geometry_msgs/PoseWithCovarianceStamped")))
    assert (pose.parent, pose.stamp) == ("map", 2.0)
    assert to_pressed(decode(*there("kobuki/CliffEvent"))) == (1, True)
    assert to_pressed(decode(*there("std_msgs/Bool"))) == (0, True)
    reported = decode(*there("diagnostic_msgs/DiagnosticArray")).status[0]
    assert (reported.level, reported.message, reported.values[0].value) == (
        1,
        "SEARCHING: é",
        "SEARCHING",
    )


def only(kind):
    return kind, MADE[kind]


def there(kind):
    return kind, encode(kind, MADE[kind])


@pytest.mark.parametrize("kind", MADE)
def test_a_message_that_was_cut_off_is_an_error_of_ours(kind):
    data = encode(kind, MADE[kind])
    whole = len(data.rstrip(b"\0"))  # padding may be cut
    for size in range(min(whole, 200)):
        with pytest.raises(InputError, match=f"expected a {kind}"):
            decode(kind, data[:size])


@given(st.sampled_from(sorted(MADE)), st.binary(max_size=300), st.binary(min_size=4, max_size=4))
def test_random_bytes_are_a_message_or_an_error_of_ours(kind, data, head):
    for start in (head, b"\0\1\0\0", b"\0\0\0\0"):
        with contextlib.suppress(InputError):
            decode(kind, start + data)


@given(st.sampled_from(sorted(MADE)), st.data())
def test_a_message_with_wrong_bytes_is_a_message_or_an_error_of_ours(kind, drawn):
    data = bytearray(encode(kind, MADE[kind]))
    for _ in range(drawn.draw(st.integers(1, 4))):
        data[drawn.draw(st.integers(0, len(data) - 1))] = drawn.draw(st.integers(0, 255))
    with contextlib.suppress(InputError):
        decode(kind, bytes(data))


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("sensor_msgs/LaserScan", "sensor_msgs::msg::dds_::LaserScan_"),
        ("kobuki/CliffEvent", "kobuki_ros_interfaces::msg::dds_::CliffEvent_"),
        (GRAPH.type_name, "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"),
    ],
)
def test_types_have_the_names_of_ros_in_dds(kind, name):
    about = described(kind).__idl__
    about.populate()
    assert about.idl_transformed_typename == name
    assert about.keyless


def as_cyclone_has_it(kind, message):
    """Build the object that Cyclone DDS would write, from a message of rosbags."""
    return kind(
        **{name: _part(t, getattr(message, name)) for name, t in kind.__annotations__.items()}
    )


def _part(kind, value):
    if isinstance(kind, type) and issubclass(kind, IdlStruct):
        return as_cyclone_has_it(kind, value)
    if isinstance(value, list):
        return [_part(kind.__metadata__[0].subtype, element) for element in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


@pytest.mark.parametrize("kind", MADE)
def test_cyclone_dds_would_write_the_same_bytes(kind):
    twin = as_cyclone_has_it(described(kind), MADE[kind])
    assert twin.serialize(use_version_2=False) == encode(kind, MADE[kind])


def test_definitions_have_the_hashes_of_ros():
    # As `ros2 topic info --verbose` prints them.
    assert type_hash("std_msgs/String") == (
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    )
    assert all(type_hash(kind).startswith("RIHS01_") for kind in MADE)


def test_cdr_passes_bytes_through():
    assert Cdr.deserialize(b"abc").serialize(use_version_2=False) == b"abc"
    assert Cdr.deserialize_key(b"").data == b""


DISTRIBUTIONS = ("humble", "jazzy", "kilted", "lyrical", "rolling", "noetic", "")


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_hashes_are_those_of_the_distribution(monkeypatch, distribution):
    """An unknown distribution is taken for a new one, and ROS 1 has no say."""
    monkeypatch.setenv("ROS_DISTRO", distribution)
    if distribution in DISTRIBUTIONS[:4] and not hasattr(Stores, f"ROS2_{distribution.upper()}"):
        pytest.skip(f"this rosbags does not know {distribution}")
    store = get_typestore(getattr(Stores, f"ROS2_{distribution.upper()}", Stores.ROS2_IRON))
    for name, text in dds_types._DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    dds_types._store.cache_clear()
    try:
        for kind in [*MADE, GRAPH.type_name]:
            assert type_hash(kind) == store.hash_rihs01(dds_types.full_name(kind))
    finally:
        dds_types._store.cache_clear()
