"""The node on a real network of DDS, in a process of its own as users start it."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip("cyclonedds")

from cyclonedds.idl import make_idl_struct, types
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.topic import Topic as DdsTopic
from dds_lab import free_domain, pose_of, wait_for

from firstfix.cli.app import run
from firstfix.core.angles import angle_error
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import to_seconds
from firstfix.io.ros_messages.outgoing import occupancy_grid
from firstfix.ros.dds.graph import GRAPH
from firstfix.ros.dds.types import Cdr, make

POSE = "geometry_msgs/PoseWithCovarianceStamped"
STATUS = "diagnostic_msgs/DiagnosticArray"


def states(ear):
    return [
        value.value for m in ear.received for value in m.status[0].values if value.key == "state"
    ]


def assert_near(truth, pose, metres, radians):
    """Compare a pose with the nearest true one, in position and in heading."""
    position = np.hypot(truth[:, 1] - pose[0], truth[:, 2] - pose[1])
    nearest = int(np.argmin(position))
    assert position[nearest] < metres
    assert angle_error(truth[nearest, 3], pose[2]) < radians


@pytest.mark.slow
def test_a_robot_at_rest_is_found_and_its_pose_published_once(dds):
    poses = dds.ear("/initialpose", POSE)
    dds.robot("stand")
    node = dds.node()
    found = wait_for(lambda: poses.received)[0]
    assert found.header.frame_id == "map"
    assert_near(dds.truth(), pose_of(found), 0.1, 0.05)

    graph = dds.ear_named(GRAPH.name, GRAPH.type_name).latched()
    (entry,) = graph.node_entities_info_seq
    assert (entry.node_namespace, entry.node_name) == ("/", "firstfix")
    writer_ids = {gid.data.tobytes() for gid in entry.writer_gid_seq}
    assert {data.key.bytes for data in poses.senders()} <= writer_ids

    time.sleep(2.0)  # long enough for a second one
    assert len(poses.received) == 1
    late = dds.ear("/initialpose", POSE)
    wait_for(lambda: late.received)
    assert_near(dds.truth(), pose_of(late.received[0]), 0.1, 0.05)

    assert node.end(signal.SIGINT) == 0
    assert "WARN" not in node.log
    assert "LOCALIZED" in node.log


@pytest.mark.slow
@pytest.mark.parametrize("sensors", ["scan_topics:=front/scan rear/scan", "cloud_topics:=points"])
def test_a_robot_with_several_sensors_is_found(dds, sensors):
    """One of the lasers alone sees too little to be sure at rest."""
    poses = dds.ear("/initialpose", POSE)
    dds.robot("sensors")
    node = dds.node("-p", sensors)
    found = wait_for(lambda: poses.received)[0]
    assert_near(dds.truth(), pose_of(found), 0.1, 0.05)
    assert node.end() == 0
    assert "WARN" not in node.log


@pytest.mark.slow
def test_no_pose_is_published_where_places_look_alike(dds):
    poses = dds.ear("/initialpose", POSE)
    places = dds.ear("/hypotheses", "geometry_msgs/PoseArray")
    status = dds.ear("/localization_status", STATUS)
    dds.robot("twins")
    node = dds.node()
    wait_for(lambda: places.received)
    here = dds.truth()[0, 1:3]
    offered = places.received[-1].poses
    assert len(offered) > 1
    off = [np.hypot(p.position.x - here[0], p.position.y - here[1]) for p in offered]
    assert min(off) < 0.1
    wait_for(lambda: "DISAMBIGUATING" in states(status))
    time.sleep(1.0)
    assert poses.received == []
    assert node.end() == 0


@pytest.mark.slow
def test_a_carried_robot_is_found_again_on_a_map_that_came_late(dds):
    status = dds.ear("/localization_status", STATUS)
    poses = dds.ear("/amcl_pose", POSE)
    dds.node("--mode", "full")
    dds.robot("kidnapped", "--map", "late")
    wait_for(lambda: "LOCALIZED" in states(status))
    wait_for(lambda: len(states(status)) > 3 and "SEARCHING" in states(status)[2:])
    wait_for(lambda: states(status)[-1] == "LOCALIZED")
    count = len(poses.received)
    wait_for(lambda: len(poses.received) > count + 5)
    assert_near(dds.truth()[-20:], pose_of(poses.received[-1]), 0.15, 0.1)


@pytest.mark.slow
def test_a_drive_is_followed(dds):
    poses = dds.ear("/amcl_pose", POSE)
    moves = dds.ear("/tf", "tf2_msgs/TFMessage")
    clouds = dds.ear("/particle_cloud", "nav2_msgs/ParticleCloud", Policy.Reliability.BestEffort)
    dds.node("--ros-args", "-p", "mode:=full")
    dds.robot("drive")
    wait_for(lambda: poses.received)
    time.sleep(12.0)
    truth = {round(line[0], 3): line for line in dds.truth()}
    pairs = [(truth.get(round(to_seconds(m.header.stamp), 3)), pose_of(m)) for m in poses.received]
    errors = [np.hypot(t[1] - p[0], t[2] - p[1]) for t, p in pairs if t is not None]
    assert len(errors) > 50
    assert np.percentile(errors, 95) < 0.15
    ours = [t for m in moves.received for t in m.transforms if t.header.frame_id == "map"]
    assert len(ours) >= len(errors)
    assert {t.child_frame_id for t in ours} == {"odom"}
    assert len(clouds.received) > 5
    assert abs(sum(p.weight for p in clouds.received[-1].particles) - 1.0) < 1e-6


def impostor(dds, topic, kind, size):
    """Return a writer of any bytes under the name of a type of ROS."""
    any_bytes = make_idl_struct("Any_", kind, {"data": types.array[types.uint8, size]})
    made = DdsTopic(dds.participant, f"rt{topic}", any_bytes)
    made.data_type = Cdr
    xcdr1 = Policy.DataRepresentation(use_cdrv0_representation=True)
    return DataWriter(dds.participant, made, Qos(xcdr1, Policy.Reliability.Reliable(10**9)))


@pytest.mark.slow
def test_invalid_data_on_the_wire_does_not_end_the_node(dds):
    rng = np.random.default_rng(0)
    kinds = {"/scan": "sensor_msgs.msg.dds_.LaserScan_", "/tf": "tf2_msgs.msg.dds_.TFMessage_"}
    node = dds.node()
    for topic, kind in kinds.items():
        for size in (4, 60):
            writer = impostor(dds, topic, kind, size)
            wait_for(writer.get_matched_subscriptions)
            for _ in range(20):
                writer.write(Cdr(b"\0\1\0\0" + rng.bytes(size)))
                writer.write(Cdr(b"\0\1\0\0" + bytes(size)))
    poses = dds.ear("/initialpose", POSE)
    dds.robot("stand")
    wait_for(lambda: poses.received)
    assert_near(dds.truth(), pose_of(poses.received[-1]), 0.1, 0.05)
    assert "deserialization" in node.log  # logged by Cyclone DDS; no message reached Python
    assert "Traceback" not in node.log


@pytest.mark.slow
def test_a_map_that_is_not_latched_is_named_with_the_reason(dds):
    node = dds.node()
    dds.robot("stand", "--map", "volatile")
    wait_for(lambda: "/map: a publisher does not fit in durability" in node.log)
    assert node.log.count("/map: a publisher") == 1


@pytest.mark.slow
def test_a_map_of_four_million_cells_is_used(dds):
    cells = np.full((2000, 2000), -1, np.int8)
    cells[900:1100, 900:1200] = 0
    cells[[900, 1099], 900:1200] = 100
    grid = OccupancyGrid(cells, 0.05, SE2(-50.0, -50.0, 0.0))
    status = dds.ear("/localization_status", STATUS)
    sender = dds.latched_sender("/map", "nav_msgs/OccupancyGrid")
    sender.send(occupancy_grid(make, 0.0, "map", grid))
    dds.node()
    wait_for(lambda: "SEARCHING" in states(status))


@pytest.mark.slow
def test_robots_in_namespaces_are_separate(dds):
    ears = {}
    for name, script in (("robot1", "stand"), ("robot2", "kidnapped")):
        ears[name] = dds.ear(f"/{name}/amcl_pose", POSE)
        own_tf = ("-r", "/tf:=tf", "-r", "/tf_static:=tf_static")
        dds.node("--mode", "full", "--namespace", name, *own_tf)
        dds.robot(script, "--namespace", f"/{name}", truth=f"{name}.jsonl")
    for name, ear in ears.items():
        wait_for(lambda ear=ear: ear.received)
        first = ear.received[0]
        assert_near(dds.truth(f"{name}.jsonl"), pose_of(first), 0.1, 0.05)
    graphs = dds.ear_named(GRAPH.name, GRAPH.type_name)
    wait_for(lambda: len(graphs.received) == 2)
    places = {m.node_entities_info_seq[0].node_namespace for m in graphs.received}
    assert places == {"/robot1", "/robot2"}


@pytest.mark.slow
def test_discovery_follows_the_environment_variables_of_ros(dds):
    here = "<General><Interfaces><NetworkInterface name='lo'/></Interfaces></General>"
    near = {"ROS_LOCALHOST_ONLY": "1", "CYCLONEDDS_URI": here}
    alone = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "CYCLONEDDS_URI": here}
    quiet = here.replace("</General>", "<AllowMulticast>false</AllowMulticast></General>")
    peer = {"ROS_STATIC_PEERS": "127.0.0.1", "CYCLONEDDS_URI": quiet}
    graphs = dds.ear_named(GRAPH.name, GRAPH.type_name)

    def names():
        return {m.node_entities_info_seq[0].node_name for m in graphs.received}

    hidden = [
        dds.node("--name", "hidden", **alone),
        dds.node("--name", "elsewhere", **near, ROS_DOMAIN_ID=str(free_domain())),
    ]
    dds.node("--name", "near", **near)
    dds.node("--name", "peer", **peer)
    wait_for(lambda: len(names()) > 1 and all("no message on" in node.log for node in hidden))
    assert names() == {"near", "peer"}


@pytest.mark.slow
@pytest.mark.shared
def test_a_bag_of_a_real_robot_is_followed(dds, shared):
    case = shared / "cases" / "olin_mac1_9_23"
    poses = dds.ear("/amcl_pose", POSE)
    status = dds.ear("/localization_status", STATUS)
    reported = ("--map", str(case / "map.yaml"), "--mode", "full", "--base-frame", "base_link")
    node = dds.node(*reported)
    wait_for(lambda: "SEARCHING" in states(status))
    player = dds.player(shared / "bags" / "olin_ros2", 4.0, "scan", "tf", "tf_static")
    assert player.process.wait(300.0) == 0, player.log
    scans = np.load(case / "scans.npz")
    truth = dict(zip(np.round(scans["stamp"], 3), scans["true_pose"], strict=True))
    pairs = [(truth.get(round(to_seconds(m.header.stamp), 3)), pose_of(m)) for m in poses.received]
    errors = [np.hypot(t[0] - p[0], t[1] - p[1]) for t, p in pairs if t is not None]
    assert len(errors) > 20, node.log
    assert np.percentile(errors, 95) < 0.3  # of the laser, which sits 4 mm from the base


def test_without_cyclone_dds_the_error_names_the_package(monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith("firstfix.ros.dds")]:
        monkeypatch.delitem(sys.modules, name)
    for name in [name for name in sys.modules if name.partition(".")[0] == "cyclonedds"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    assert run(["dds"]) == 2
    assert "pip install 'firstfix[dds]'" in capsys.readouterr().err


def test_a_configuration_that_cyclone_dds_refuses_is_wrong_input(monkeypatch, capsys):
    monkeypatch.setenv("CYCLONEDDS_URI", "<Genral/>")
    monkeypatch.setenv("ROS_DOMAIN_ID", "231")
    assert run(["dds"]) == 2
    assert "CYCLONEDDS_URI" in capsys.readouterr().err


# What rmw_cyclonedds of Humble makes of ROS_LOCALHOST_ONLY=1.
HUMBLE = "<General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces></General>"
PEER = """
import sys, time
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsParticipant
from cyclonedds.domain import Domain, DomainParticipant
domain = Domain(int(sys.argv[1]), sys.argv[2])
participant = DomainParticipant(int(sys.argv[1]))
others = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
while all(sample.key == participant.guid for sample in others.read(10)):
    time.sleep(0.05)
"""


@pytest.mark.slow
@pytest.mark.parametrize("order", ["the robot first", "the robot last"])
def test_a_robot_of_humble_that_is_restricted_to_localhost_is_found(dds, order):
    environment = {"ROS_LOCALHOST_ONLY": "1", "ROS_DISTRO": "humble", "CYCLONEDDS_URI": ""}
    command = [sys.executable, "-c", PEER, str(dds.domain), HUMBLE]
    if order == "the robot first":
        robot = subprocess.Popen(command)
        time.sleep(2.0)
        dds.node(**environment)
    else:
        node = dds.node(**environment)
        wait_for(lambda: "no message on" in node.log)
        robot = subprocess.Popen(command)
    try:
        assert robot.wait(240.0) == 0
    finally:
        robot.kill()
        robot.wait()
