"""The life of the node, over a stand-in for rclpy: see its docstring for what that proves."""

import gc
import math
import signal
import sys
import threading
import weakref
from collections.abc import Iterator
from pathlib import Path

import pytest
from ros2_lab import T_ODOM_BASE, Lab, Robot, wait_until

from firstfix.core.angles import angle_error
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import to_planar, to_pose, to_transform
from firstfix.ros.parameters import parameters

POSE = "geometry_msgs/PoseWithCovarianceStamped"
STATUS = "diagnostic_msgs/DiagnosticArray"
HERE = SE2(3.0, 2.5, 0.4)


@pytest.fixture
def lab(monkeypatch: pytest.MonkeyPatch) -> Iterator[Lab]:
    made = Lab(monkeypatch)
    yield made
    made.end()


def is_near(message, truth: SE2) -> bool:
    pose = to_planar(to_pose(message))
    return math.hypot(pose.x - truth.x, pose.y - truth.y) < 0.1 and (
        angle_error(pose.yaw, truth.yaw) < 0.05
    )


def succeeds(lab: Lab, *results) -> bool:
    return all(result is lab.lifecycle.TransitionCallbackReturn.SUCCESS for result in results)


def test_a_robot_is_found_and_initialpose_is_published_once(
    lab: Lab, hall_plan: OccupancyGrid
) -> None:
    node = lab.node()
    robot = Robot(lab, hall_plan, HERE)
    reported = lab.subscribe("initialpose", POSE)
    status = lab.subscribe("localization_status", STATUS, is_latched=True)
    assert succeeds(lab, node.trigger_configure(), node.trigger_activate())
    robot.look_until(lambda: any(s.status[0].level == b"\0" for s in status))
    for _ in range(5):
        robot.look()
    assert len(reported) == 1
    assert is_near(reported[0], HERE)
    assert reported[0].header.frame_id == "map"
    assert any("LOCALIZED" in line.upper() for line in lab.world.lines("info"))
    assert not lab.world.lines("error")


def test_without_amcl_it_follows_the_robot(lab: Lab, hall_plan: OccupancyGrid) -> None:
    node = lab.node("-p", "mode:=full")
    robot = Robot(lab, hall_plan, HERE)
    poses = lab.subscribe("amcl_pose", POSE, is_latched=True)
    moved = lab.subscribe("/tf", "tf2_msgs/TFMessage", depth=100)
    clouds = lab.subscribe("particle_cloud", "nav2_msgs/ParticleCloud", is_sensor=True)
    assert succeeds(lab, node.trigger_configure(), node.trigger_activate())
    robot.look_until(lambda: poses and clouds)
    assert is_near(poses[-1], HERE)
    ours = [m.transforms[0] for m in moved if m.transforms[0].header.frame_id == "map"]
    T_map_odom = to_planar(to_transform(ours[-1]))
    found = T_map_odom @ T_ODOM_BASE
    assert math.hypot(found.x - HERE.x, found.y - HERE.y) < 0.1
    assert sum(particle.weight for particle in clouds[-1].particles) == pytest.approx(1.0)


def test_without_nav2_msgs_clouds_are_poses(
    monkeypatch: pytest.MonkeyPatch, hall_plan: OccupancyGrid
) -> None:
    lab = Lab(monkeypatch, optional=())
    node = lab.node("-p", "mode:=full")
    robot = Robot(lab, hall_plan, HERE)
    clouds = lab.subscribe("particle_cloud", "geometry_msgs/PoseArray", is_sensor=True)
    assert succeeds(lab, node.trigger_configure(), node.trigger_activate())
    robot.look_until(lambda: clouds)
    lab.end()
    missing = " ".join(lab.world.lines("info"))
    assert "without events/cliff: this ROS 2 has no kobuki/CliffEvent" in missing
    assert "without set_initial_pose" in missing
    assert "set_initial_pose" not in lab.world.services


def test_an_inactive_node_publishes_and_receives_nothing(
    lab: Lab, hall_plan: OccupancyGrid
) -> None:
    node = lab.node("-p", "mode:=full")
    robot = Robot(lab, hall_plan, HERE)
    poses = lab.subscribe("amcl_pose", POSE, is_latched=True)
    moved = lab.subscribe("/tf", "tf2_msgs/TFMessage", depth=100)
    node.trigger_configure()
    for _ in range(20):
        robot.look()
    node.trigger_activate()
    assert not poses
    robot.look_until(lambda: len(poses) > 2)
    node.trigger_deactivate()
    reported = len(poses), len([m for m in moved if m.transforms[0].header.frame_id == "map"])
    for _ in range(20):
        robot.look()
    node.trigger_activate()
    before = len(poses), len([m for m in moved if m.transforms[0].header.frame_id == "map"])
    assert before == reported
    robot.look_until(lambda: len(poses) > reported[0])
    assert is_near(poses[-1], HERE)


def test_latched_messages_are_received_before_activation(
    lab: Lab, hall_plan: OccupancyGrid
) -> None:
    node = lab.node()
    Robot(lab, hall_plan, HERE)
    node.trigger_configure()
    wait_until(lambda: any("SEARCHING" in line.upper() for line in lab.world.lines("info")))


def test_only_an_active_node_misses_scans(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("firstfix.ros.node._SILENCE_S", 0.05)
    node = lab.node()
    node.trigger_configure()
    (worker,) = [thread for thread in threading.enumerate() if thread.name == "firstfix"]
    worker.join(0.5)
    assert not lab.world.lines("warning")
    node.trigger_activate()
    wait_until(lambda: any("no message on scan" in w for w in lab.world.lines("warning")))


def test_cleanup_releases_all_and_the_node_can_be_configured_again(
    lab: Lab, hall_plan: OccupancyGrid
) -> None:
    node = lab.node()
    robot = Robot(lab, hall_plan, HERE)
    others = len(lab.world.ends)
    for transition in ("configure", "activate", "deactivate", "cleanup"):
        assert succeeds(lab, getattr(node, f"trigger_{transition}")())
    assert len(lab.world.ends) == others
    assert set(lab.world.services) == {"wait_until_localized"}  # as long as the node
    node.set_parameter("mode", "full")
    poses = lab.subscribe("amcl_pose", POSE, is_latched=True)
    assert succeeds(lab, node.trigger_configure(), node.trigger_activate())
    robot.look_until(lambda: poses)
    assert succeeds(lab, node.trigger_shutdown())
    assert len(lab.world.ends) == others + 1
    robot.look()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("mode:=fast", "bootstrap"),
        ("mode:=off", "bootstrap"),
        ("max_beams:=1", "max_beams"),
        ("z_hit:=1.5", "z_hit"),
        ("min_particles:=5000", "max_particles"),
        ("base_frame_id:=7", "base_frame_id"),
        ("initial_pose.x:=here", "initial_pose.x"),
        ("yaml_filename:=nowhere.yaml", "nowhere.yaml"),
        ("scan_topic:=front scan", "front scan"),
    ],
)
def test_a_bad_parameter_is_reported_in_one_line(lab: Lab, given: str, words: str) -> None:
    node = lab.node("-p", given)
    assert node.trigger_configure() is lab.lifecycle.TransitionCallbackReturn.FAILURE
    (line,) = lab.world.lines("error")
    assert words in line
    assert "\n" not in line
    assert node.state == "unconfigured"
    assert lab.world.ends == []


def test_a_bad_parameter_can_be_corrected(lab: Lab) -> None:
    node = lab.node("-p", "max_beams:=1")
    node.trigger_configure()
    node.set_parameter("max_beams", 30)
    assert succeeds(lab, node.trigger_configure())


def test_integers_are_accepted_for_lengths(lab: Lab) -> None:
    node = lab.node("-p", "laser_max_range:=12")
    assert succeeds(lab, node.trigger_configure())


def test_unknown_parameters_are_named(lab: Lab, tmp_path: Path) -> None:
    (tmp_path / "nav2.yaml").write_text(
        "firstfix:\n  ros__parameters:\n    use_sim_time: true\n    max_beam: 30\n"
        "    initial_pose: {x: 1.0, y: 2.0, z: 0.0, yaw: 0.0}\n    autostart: true\n"
    )
    node = lab.node("--params-file", str(tmp_path / "nav2.yaml"))
    assert succeeds(lab, node.trigger_configure())
    (line,) = lab.world.lines("warning")
    assert "max_beam" in line
    assert "max_beams" in line
    assert node.get_parameter("use_sim_time").value is True
    assert node.get_parameter("initial_pose.y").value == 2.0


def test_an_error_of_our_own_is_not_dropped(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    node = lab.node()
    monkeypatch.setattr(node, "create_service", None)
    assert node.trigger_configure() is lab.lifecycle.TransitionCallbackReturn.ERROR
    assert "Traceback" in lab.world.lines("error")[0]
    assert node.state == "unconfigured"
    assert lab.world.ends == []


def test_a_package_that_is_needed_is_named(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "tf2_msgs.msg")
    monkeypatch.delitem(sys.modules, "tf2_msgs")
    monkeypatch.setattr(sys, "path", [p for p in sys.path if "dist-packages" not in p])
    node = lab.node()
    assert node.trigger_configure() is lab.lifecycle.TransitionCallbackReturn.FAILURE
    assert "ros-$ROS_DISTRO-tf2-msgs" in lab.world.lines("error")[0]


def test_every_parameter_is_declared_with_its_meaning(lab: Lab) -> None:
    node = lab.node()
    for parameter in parameters():
        descriptor = node.describe_parameter(parameter.name)
        assert node.get_parameter(parameter.name).value == parameter.default
        assert descriptor.description == parameter.description
        assert not descriptor.read_only
    beams, hit = node.describe_parameter("max_beams"), node.describe_parameter("z_hit")
    assert (beams.integer_range[0].from_value, beams.integer_range[0].to_value) == (2, 20_000)
    assert (hit.floating_point_range[0].from_value, hit.floating_point_range[0].to_value) == (0, 1)
    assert node.describe_parameter("alpha1").additional_constraints == "at least 0"
    assert "full" in node.describe_parameter("mode").additional_constraints


def test_run_starts_by_itself_if_asked(lab: Lab, hall_plan: OccupancyGrid) -> None:
    reported = []

    def during_spin(node) -> None:
        assert node.name == "firstfix"
        robot = Robot(lab, hall_plan, HERE)
        reported.append(lab.subscribe("/pose", POSE))
        robot.look_until(lambda: reported[0])

    lab.world.during_spin = during_spin
    given = ["--ros-args", "-p", "autostart:=true", "-r", "initialpose:=/pose"]
    lab.ros2.run(given)
    assert is_near(reported[0][0], HERE)
    assert not lab.rclpy.ok()


def test_run_waits_for_a_manager_otherwise(lab: Lab) -> None:
    states = []
    lab.world.during_spin = lambda node: states.append(node.state)
    lab.ros2.run([])
    assert states == ["unconfigured"]


def test_an_impossible_transition_does_not_end_it(lab: Lab) -> None:
    states = []

    def during_spin(node) -> None:
        states.append(node.state)
        if len(states) == 1:
            node.trigger_activate()

    lab.world.during_spin = during_spin
    lab.ros2.run([])
    assert states == ["unconfigured"] * 2
    assert "no transition activate" in lab.world.lines("error")[0]


@pytest.mark.parametrize(
    "given",
    [["-p", "mode:=full"], ["_mode:=full"], ["--ros-args", "-p", "mode"], ["--ros-args", "-x"]],
)
def test_run_refuses_arguments_that_ros_would_ignore(lab: Lab, given: list[str]) -> None:
    with pytest.raises(InputError, match="--ros-args"):
        lab.ros2.run(given)
    assert not lab.rclpy.ok()


# ---- parameters while it runs


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("mode", "nonsense", "mode as one of bootstrap, full"),
        ("max_beams", "many", "max_beams"),
        ("min_particles", 5000, "min_particles up to max_particles"),
        ("recovery_alpha_fast", 0.1, "searching the whole map"),
    ],
)
def test_a_bad_value_is_refused_with_the_reason(lab: Lab, name: str, value, words: str) -> None:
    node = lab.node()
    before = node.get_parameter(name).value
    result = node.set_parameter(name, value)
    assert not result.successful
    assert words in result.reason
    assert "\n" not in result.reason
    assert node.get_parameter(name).value == before


def test_good_values_and_those_of_ros_are_accepted(lab: Lab) -> None:
    node = lab.node()
    for name, value in (("mode", "full"), ("use_sim_time", True), ("autostart", True)):
        assert node.set_parameter(name, value).successful
        assert node.get_parameter(name).value == value


# ---- bond


def test_an_active_node_sends_heartbeats_to_the_lifecycle_manager(lab: Lab) -> None:
    node = lab.node()
    beats = lab.subscribe("bond", "bond/Status")
    node.trigger_configure()
    assert not lab.world.timers
    node.trigger_activate()
    for beat in [*lab.world.timers] * 3:
        beat()
    assert [beat.active for beat in beats] == [True] * 4
    assert {beat.id for beat in beats} == {"firstfix"}
    assert len({beat.instance_id for beat in beats}) == 1
    assert (beats[0].heartbeat_timeout, beats[0].heartbeat_period) == (4.0, 0.1)
    node.trigger_deactivate()
    assert beats[-1].active is False
    assert not lab.world.timers
    node.trigger_activate()
    assert beats[-1].instance_id != beats[0].instance_id


def test_a_bond_timeout_of_zero_means_no_bond(lab: Lab) -> None:
    node = lab.node("-p", "bond_timeout:=0.0")
    beats = lab.subscribe("bond", "bond/Status")
    assert succeeds(lab, node.trigger_configure(), node.trigger_activate())
    assert not beats
    assert not lab.world.timers


def test_a_bad_bond_timeout_is_reported_in_one_line(lab: Lab) -> None:
    node = lab.node("-p", "bond_timeout:=-1.0")
    assert node.trigger_configure() is lab.lifecycle.TransitionCallbackReturn.FAILURE
    assert "bond_timeout in seconds" in lab.world.lines("error")[0]


# ---- memory


def test_cleanup_frees_memory(lab: Lab, hall_plan: OccupancyGrid) -> None:
    """At once: arrays of 25 MB do not trigger the collector of reference cycles."""
    node = lab.node("-p", "mode:=full")
    robot = Robot(lab, hall_plan, HERE)
    poses = lab.subscribe("amcl_pose", POSE, is_latched=True)
    assert succeeds(lab, node.trigger_configure(), node.trigger_activate())
    robot.look_until(lambda: poses)
    transport = node._transport
    kept = [weakref.ref(each) for each in (transport, transport._node, transport._node._localizer)]
    del transport
    gc.collect()
    gc.disable()
    try:
        assert succeeds(lab, node.trigger_deactivate(), node.trigger_cleanup())
        assert [reference() for reference in kept] == [None] * 3
    finally:
        gc.enable()


# ---- the end


def test_ctrl_c_twice_during_a_conversion_ends_it_cleanly(lab: Lab) -> None:
    def during_spin(node) -> None:
        assert node.trigger_configure() is lab.lifecycle.TransitionCallbackReturn.SUCCESS
        node.destroy_node = lambda: signal.raise_signal(signal.SIGINT)
        lab.rclpy.try_shutdown()  # as rclpy's own handler does
        signal.raise_signal(signal.SIGINT)
        raise RuntimeError("Unable to convert call argument '0' to Python object")

    lab.world.during_spin = during_spin
    before = signal.getsignal(signal.SIGINT)
    lab.ros2.run([])
    assert signal.getsignal(signal.SIGINT) is before


def test_an_error_while_ros_is_up_is_not_hidden(lab: Lab) -> None:
    def during_spin(node) -> None:
        raise RuntimeError("Unable to convert call argument '0' to Python object")

    lab.world.during_spin = during_spin
    with pytest.raises(RuntimeError, match="Unable"):
        lab.ros2.run([])
