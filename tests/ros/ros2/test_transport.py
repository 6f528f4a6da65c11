"""Services, events and the log of the node, over a stand-in for rclpy."""

import importlib
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ros2_lab import Lab, Robot, wait_until

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.io.ros_messages.incoming import to_planar, to_pose
from firstfix.io.ros_messages.outgoing import pose_with_covariance
from firstfix.ros.channels import PARTICLES, published_topics, subscribed_topics
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.transport import Severity

POSE = "geometry_msgs/PoseWithCovarianceStamped"
STATUS = "diagnostic_msgs/DiagnosticArray"
HERE, ELSEWHERE = SE2(3.0, 2.5, 0.4), SE2(7.5, 5.0, -1.5)


@pytest.fixture
def lab(monkeypatch: pytest.MonkeyPatch) -> Iterator[Lab]:
    made = Lab(monkeypatch)
    yield made
    made.end()


@pytest.fixture
def states(lab: Lab, hall_plan: OccupancyGrid) -> tuple[Robot, list[Any]]:
    """Give a robot that has been found, and a list of all status messages since."""
    node = lab.node()
    robot = Robot(lab, hall_plan, HERE)
    received = lab.subscribe("localization_status", STATUS, is_latched=True)
    node.trigger_configure()
    node.trigger_activate()
    robot.look_until(lambda: received and state_of(received[-1]) == "LOCALIZED")
    received.clear()
    return robot, received


def state_of(message) -> str:
    return next(v.value for v in message.status[0].values if v.key == "state").upper()


def is_there(message) -> bool:
    pose = to_planar(to_pose(message))
    return math.hypot(pose.x - ELSEWHERE.x, pose.y - ELSEWHERE.y) < 0.1


def test_a_search_can_be_asked_for(lab: Lab, states) -> None:
    robot, received = states
    lab.world.ask("reinitialize_global_localization")
    robot.look_until(lambda: any(state_of(m) == "SEARCHING" for m in received))
    robot.look_until(lambda: state_of(received[-1]) == "LOCALIZED")


def test_an_update_can_be_asked_for(lab: Lab, states) -> None:
    robot, received = states
    lab.world.ask("request_nomotion_update")
    robot.look_until(lambda: received)
    assert {state_of(m) for m in received} == {"LOCALIZED"}


@pytest.mark.parametrize("way", ["service", "topic"])
def test_a_person_can_give_a_hint(lab: Lab, states, way: str) -> None:
    robot, _ = states
    reported = lab.subscribe("initialpose", POSE)
    robot.T_map_base = ELSEWHERE
    hint = pose_with_covariance(robot.make, robot.stamp, "map", ELSEWHERE, 0.01 * np.eye(3))
    if way == "service":
        request = lab.types.find("srv", "nav2_msgs/SetInitialPose").Request(pose=hint)
        lab.world.ask("set_initial_pose", request)
    else:
        lab.advertise("initialpose", POSE).publish(hint)
    robot.look_until(lambda: any(message is not hint and is_there(message) for message in reported))


def test_a_wheel_drop_restarts_the_search(lab: Lab, states) -> None:
    robot, received = states
    reported = lab.subscribe("initialpose", POSE)
    wheel = lab.advertise("events/wheel_drop", "kobuki/WheelDropEvent")
    wheel.publish(robot.make("kobuki/WheelDropEvent", wheel=0, state=1))
    robot.T_map_base = ELSEWHERE
    wheel.publish(robot.make("kobuki/WheelDropEvent", wheel=0, state=0))
    robot.look_until(lambda: any(is_there(message) for message in reported))
    assert "SEARCHING" in {state_of(m) for m in received}


def test_a_map_can_be_loaded_and_another_one_from_the_map_server_is_followed(
    lab: Lab, hall_plan: OccupancyGrid, tmp_path: Path
) -> None:
    save_map(hall_plan, tmp_path / "floor1.yaml")
    shifted = replace(hall_plan, T_map_grid=SE2(10.0, 0.0, 0.0) @ hall_plan.T_map_grid)
    save_map(shifted, tmp_path / "floor2.yaml")
    load = lab.types.find("srv", "nav2_msgs/LoadMap")
    node = lab.node("-p", f"yaml_filename:={tmp_path / 'floor1.yaml'}", "-p", "mode:=full")
    robot = Robot(lab, hall_plan, HERE)
    order: list[Any] = []
    lab.listen("map_id", "std_msgs/String", lambda m: order.append(m.data), is_latched=True)
    lab.listen("amcl_pose", POSE, order.append, is_latched=True)
    node.trigger_configure()
    early = lab.world.ask("~/load_map", load.Request(map_url="nowhere"))
    assert early.result == 255
    # Its name is published before the node is active, and must not be lost.
    wait_until(lambda: any("SEARCHING" in line for line in lab.world.lines("info")))
    node.trigger_activate()
    robot.look_until(lambda: order and not isinstance(order[-1], str))
    done = lab.world.ask("~/load_map", load.Request(map_url=f"file://{tmp_path}/floor2.yaml"))
    assert (done.result, done.map.info.width) == (0, shifted.width)
    robot.look_until(lambda: "floor2" in order and not isinstance(order[-1], str))
    names = [each for each in order if isinstance(each, str)]
    assert names == ["floor1", "floor2"]
    assert order[0] == "floor1"
    in_first, in_second = order[order.index("floor2") - 1], order[order.index("floor2") + 1]
    assert to_planar(to_pose(in_first)).x == pytest.approx(HERE.x, abs=0.1)
    assert to_planar(to_pose(in_second)).x == pytest.approx(HERE.x + 10.0, abs=0.1)


def test_a_map_that_cannot_be_loaded_leaves_the_one_in_use(
    lab: Lab, hall_plan: OccupancyGrid, tmp_path: Path
) -> None:
    save_map(hall_plan, tmp_path / "hall.yaml")
    load = lab.types.find("srv", "nav2_msgs/LoadMap")
    node = lab.node("-p", f"yaml_filename:={tmp_path / 'hall.yaml'}")
    node.trigger_configure()
    node.trigger_activate()
    for url, result in (
        (str(tmp_path / "missing.yaml"), 1),
        ("package://maps/floor2.yaml", 1),
        ("\0", 1),
        (str(tmp_path / "hall.pgm"), 3),
    ):
        assert lab.world.ask("~/load_map", load.Request(map_url=url)).result == result
    (tmp_path / "hall.pgm").write_bytes(b"P5\n400 400\n255\n")
    request = load.Request(map_url=str(tmp_path / "hall.yaml"))
    assert lab.world.ask("~/load_map", request).result == 2
    assert len(lab.world.lines("warning")) == 5


def test_a_map_server_is_told_the_map_of_the_site(
    lab: Lab, hall_plan: OccupancyGrid, tmp_path: Path
) -> None:
    save_map(hall_plan, tmp_path / "ground.yaml")
    other = replace(hall_plan, cells=hall_plan.cells[::-1])
    save_map(other, tmp_path / "first.yaml")
    service, asked = "/map_server/load_map", []
    given = (f"site:={tmp_path}", f"load_map_service:={service}")
    node = lab.node(*(word for each in given for word in ("-p", each)))
    robot = Robot(lab, hall_plan, HERE)
    node.trigger_configure()
    node.trigger_activate()
    assert [end.topic for end in lab.world.ends].count("/map") == 1  # that of the map server
    robot.look_until(lambda: any(service in line for line in lab.world.lines("warning")))

    def load(request: Any, response: Any) -> Any:
        asked.append(request.map_url)
        response.result = 0
        return response

    lab.world.services[service] = (lab.types.find("srv", "nav2_msgs/LoadMap"), load)
    wait_until(lambda: asked)
    assert asked == [f"{tmp_path / 'ground.yaml'}"]


def test_only_a_node_that_loads_its_map_offers_to_load_another(lab: Lab) -> None:
    lab.node().trigger_configure()
    assert "~/load_map" not in lab.world.services


def test_a_behaviour_tree_can_wait_until_the_robot_is_localized(lab: Lab, states) -> None:
    robot, received = states
    with pytest.raises(StopIteration):
        lab.world.ask("wait_until_localized").send(None)
    lab.world.ask("reinitialize_global_localization")
    answer = lab.world.ask("wait_until_localized")
    answer.send(None)  # not yet: the search that was asked for has not begun
    robot.look_until(lambda: received and state_of(received[-1]) == "LOCALIZED")
    with pytest.raises(StopIteration) as end:
        answer.send(None)
    assert isinstance(end.value.value, lab.types.find("srv", "std_srvs/Empty").Response)
    lab.nodes[0].trigger_deactivate()
    lab.nodes[0].trigger_cleanup()
    late = lab.world.ask("wait_until_localized")
    late.send(None)
    late.close()


def test_services_that_come_too_early_have_no_effect(lab: Lab) -> None:
    lab.node().trigger_configure()
    lab.world.ask("reinitialize_global_localization")
    (line,) = lab.world.lines("warning")
    assert "reinitialize_global_localization has no effect" in line


def test_a_transport_logs_with_every_gravity(lab: Lab) -> None:
    transport = importlib.import_module("firstfix.ros.ros2.transport")
    made = transport.Ros2(lab.node(), NodeConfig())
    for severity in [*Severity, *Severity]:
        made.log(severity, severity.value)
    assert [how for how, _ in lab.world.log] == ["info", "warning", "error"] * 2


def test_messages_after_the_end_are_dropped(lab: Lab) -> None:
    transport = importlib.import_module("firstfix.ros.ros2.transport")
    config = NodeConfig()
    made = transport.Ros2(lab.node(), config)
    topic = published_topics(config, made.particles)[0]
    message = lab.types.find("msg", topic.type_name)()
    made.close()
    made.publish(topic, message)
    assert made.subscriber_count(topic) == 0
    again = transport.Ros2(lab.nodes[0], config)
    lab.nodes[0].on_activate(None)
    lab.rclpy.try_shutdown()
    again.activate()
    again.publish(topic, message)
    assert again.subscriber_count(topic) == 0


def test_qualities_of_service_are_those_of_nav2(lab: Lab) -> None:
    config = NodeConfig()
    topics = [*subscribed_topics(config).values(), *published_topics(config, PARTICLES)]
    found = {}
    for topic in topics:
        quality = lab.types.quality(topic)
        found[topic.name] = quality.depth, quality.reliability.name, quality.durability.name
    assert found == {
        "scan": (5, "BEST_EFFORT", "VOLATILE"),
        "map": (1, "RELIABLE", "TRANSIENT_LOCAL"),
        "/tf": (100, "RELIABLE", "VOLATILE"),
        "/tf_static": (100, "RELIABLE", "TRANSIENT_LOCAL"),
        "odom": (5, "BEST_EFFORT", "VOLATILE"),
        "initialpose": (10, "RELIABLE", "VOLATILE"),
        "position_fix": (10, "RELIABLE", "VOLATILE"),
        "events/cliff": (10, "RELIABLE", "VOLATILE"),
        "events/wheel_drop": (10, "RELIABLE", "VOLATILE"),
        "events/bumper": (10, "RELIABLE", "VOLATILE"),
        "kidnapped": (10, "RELIABLE", "VOLATILE"),
        "map_id": (1, "RELIABLE", "TRANSIENT_LOCAL"),
        "hypotheses": (1, "RELIABLE", "TRANSIENT_LOCAL"),
        "hypothesis_markers": (10, "RELIABLE", "VOLATILE"),
        "localized": (1, "RELIABLE", "TRANSIENT_LOCAL"),
        "localization_status": (1, "RELIABLE", "TRANSIENT_LOCAL"),
    }
