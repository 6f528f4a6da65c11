"""A whole node on real messages, with its real worker; only the wire is a recorder."""

import re
import threading
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from recorder import Recorder, Speaker, wait_for

from firstfix.core.errors import InputError, MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.io.ros_messages.incoming import to_planar, to_pose
from firstfix.io.ros_messages.outgoing import occupancy_grid, pose_with_covariance
from firstfix.localizer.inputs import NewMap, PoseHint, Reset
from firstfix.localizer.states import State
from firstfix.ros import node as node_module
from firstfix.ros.channels import AMCL_POSE, INITIAL_POSE, MAP_ID, STATUS, Channel
from firstfix.ros.node import Node
from firstfix.ros.node_config import Mode, NodeConfig
from firstfix.ros.services import Request
from firstfix.ros.transport import Severity

THERE = SE2(4.0, 3.0, 1.0)


@pytest.fixture
def robot(ros2, hall_plan):
    return Speaker(ros2, hall_plan, THERE)


# ---- found, and handed over


def test_a_robot_is_found_from_its_first_scan(run, robot, recorder):
    running = run()
    running.introduce(robot)
    (message,) = wait_for(lambda: recorder.on(INITIAL_POSE))
    reported = to_pose(message)
    assert to_planar(reported).distance_to(THERE) < 0.1
    assert reported.stamp == robot.stamp
    wait_for(lambda: running.state is State.LOCALIZED)
    assert recorder.logged(Severity.WARNING) == recorder.logged(Severity.ERROR) == []


def test_the_same_in_messages_of_ros_1(run, wire, hall_plan):
    recorder = Recorder(wire)
    run(recorder).introduce(Speaker(wire, hall_plan, THERE))
    (message,) = wait_for(lambda: recorder.on(INITIAL_POSE))
    assert to_planar(to_pose(message)).distance_to(THERE) < 0.1


def test_its_own_pose_is_not_a_hint(run, robot, recorder):
    running = run()
    running.introduce(robot)
    (own,) = wait_for(lambda: recorder.on(INITIAL_POSE))
    for _ in range(3):
        running.receive(Channel.INITIAL_POSE, own)
        robot.move()
        robot.report(running.receive)
    running.wait_until_handled(LaserScan, 2)
    assert running.given(PoseHint) == []
    assert running.state is State.LOCALIZED
    assert len(recorder.on(INITIAL_POSE)) == 1


def test_the_pose_of_a_person_is_a_hint(run, robot, ros2):
    running = run(mode=Mode.FULL)
    running.introduce(robot)
    running.receive(
        Channel.INITIAL_POSE, pose_with_covariance(ros2.make, 0.0, "map", THERE, np.eye(3))
    )
    running.wait_until_handled(PoseHint)
    robot.move()
    robot.report(running.receive)
    wait_for(lambda: running.state is State.LOCALIZED and len(running.given(LaserScan)) > 1)


def test_a_request_to_search_anew_is_followed(run, robot):
    running = run(mode=Mode.FULL)
    running.introduce(robot)
    wait_for(lambda: running.state is State.LOCALIZED)
    running.receive(Channel.RESET)
    running.wait_until_handled(Reset)
    robot.move()
    robot.report(running.receive)
    wait_for(lambda: running.state is State.LOCALIZED)


def test_a_clock_set_back_is_survived(run, robot, recorder):
    running = run(mode=Mode.FULL)
    running.introduce(robot)
    wait_for(lambda: running.state is State.LOCALIZED)
    robot.stamp = 5.0
    robot.report(running.receive)
    wait_for(lambda: [m for m in recorder.on(AMCL_POSE) if to_pose(m).stamp == 5.0])
    assert recorder.logged(Severity.WARNING) == ["time went back by 95.0 s: starting over"]


# ---- threads


def test_a_burst_loses_no_odometry_and_the_newest_scan_is_used(run, robot):
    running = run(start=False, mode=Mode.FULL)
    running.introduce(robot)
    for i in range(1000):
        robot.move(SE2(0.0, 0.0, 0.001), 0.01)
        running.receive(Channel.TF, robot.tf())
        if i % 10 == 9:
            running.receive(Channel.SCAN, robot.scan())
    running.node.start()
    running.wait_until_handled(LaserScan)
    assert [given.stamp for given in running.given(Odometry)] == pytest.approx(
        [100.0 + 0.01 * i for i in range(1001)]
    )
    assert [given.stamp for given in running.given(LaserScan)] == [robot.stamp]
    wait_for(lambda: running.state is State.LOCALIZED)


def test_callbacks_of_many_threads_are_served_by_one(run, robot, recorder):
    running = run(mode=Mode.FULL)
    running.introduce(robot)
    wait_for(lambda: running.state is State.LOCALIZED)

    def ask() -> None:
        for _ in range(50):
            running.receive(Channel.UPDATE)
            running.receive(Channel.SCAN, robot.scan())

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    wait_for(lambda: sum(not isinstance(g, LaserScan) for g, _ in running.handled) >= 202)
    assert recorder.threads == {"firstfix"}
    assert recorder.logged(Severity.ERROR) == []


def test_it_can_be_stopped_before_between_and_after(run):
    run(start=False).node.stop()
    for _ in range(3):
        running = run()
        running.node.stop()
        running.node.stop()
        assert not running.node._worker.is_alive()
    running.receive(Channel.RESET)  # of a callback that came too late


def test_stopping_waits_for_the_input_in_progress_and_starts_no_other(run, robot, monkeypatch):
    monkeypatch.setattr(node_module, "_STOP_S", 60.0)  # its limit is tested below
    running = run(mode=Mode.FULL)
    running.introduce(robot)
    for _ in range(200):
        running.receive(Channel.RESET)
    running.node.stop()
    assert not running.node._worker.is_alive()
    handled = len(running.handled)
    assert handled < 200
    running.receive(Channel.RESET)
    assert len(running.handled) == handled


def test_stopping_has_a_time_limit(run, robot, recorder, monkeypatch):
    monkeypatch.setattr(node_module, "_STOP_S", 0.05)
    begun, go_on = threading.Event(), threading.Event()

    def observe(given, outputs, localizer):
        begun.set()
        go_on.wait(240.0)

    node = Node(NodeConfig(), recorder, [observe])
    node.start()
    node.receive(Channel.MAP, robot.map())
    assert begun.wait(240.0)
    node.stop()
    assert node._worker.is_alive()
    go_on.set()
    node._worker.join(60.0)
    assert not node._worker.is_alive()


# ---- maps


def test_a_map_of_its_own_is_read_at_the_start(run, robot, recorder, hall_plan, tmp_path):
    save_map(hall_plan, tmp_path / "hall.yaml")
    running = run(yaml_filename=str(tmp_path / "hall.yaml"))
    running.receive(Channel.TF_STATIC, robot.fixed())
    robot.report(running.receive)
    (message,) = wait_for(lambda: recorder.on(INITIAL_POSE))
    assert to_planar(to_pose(message)).distance_to(THERE) < 0.1


def broken_maps(folder):
    yaml = "image: no.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
    yaml += "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (folder / "no_image.yaml").write_text(yaml)
    (folder / "no_map.yaml").write_text("nothing")
    empty = OccupancyGrid(np.zeros((20, 20), np.int8), 0.05)
    save_map(empty, folder / "no_walls.yaml")
    (folder / "cut.yaml").write_text(yaml.replace("no.pgm", "cut.pgm"))
    (folder / "cut.pgm").write_bytes(b"P5\n400 400\n255\n" + bytes(1000))
    return ["missing.yaml", "no_image.yaml", "no_map.yaml", "no_walls.yaml", "cut.yaml", "."]


def test_a_map_that_cannot_be_used_is_refused_at_the_start(run, recorder, tmp_path):
    for name in broken_maps(tmp_path):
        node = run(start=False, yaml_filename=str(tmp_path / name)).node
        with pytest.raises(MapError):
            node.start()
        node.stop()
    assert recorder.lines == []


def test_a_map_that_cannot_be_searched_leaves_the_one_in_use(run, robot, recorder, ros2):
    running = run(mode=Mode.FULL)
    running.introduce(robot)
    wait_for(lambda: running.state is State.LOCALIZED)
    empty = OccupancyGrid(np.zeros((20, 20), np.int8), 0.05)
    running.receive(Channel.MAP, occupancy_grid(ros2.make, 3.0, "map", empty))
    running.receive(Channel.MAP, robot.map())
    robot.move()
    robot.report(running.receive)
    running.wait_until_handled(LaserScan, 2)
    assert len(running.given(NewMap)) == 1
    assert running.state is State.LOCALIZED
    assert "a map with walls and free space" in recorder.logged(Severity.WARNING)[0]


def test_the_name_of_the_map_comes_before_any_pose_in_it(run, robot, recorder, ros2, hall_plan):
    running = run(mode=Mode.FULL, map_id="lobby")
    running.introduce(robot)
    wait_for(lambda: running.state is State.LOCALIZED)
    running.receive(Channel.MAP, robot.map())  # a map server repeats its map
    moved = replace(hall_plan, T_map_grid=SE2(5.0, 0.0, 0.0))
    running.receive(Channel.MAP, occupancy_grid(ros2.make, 3.0, "map", moved))
    running.wait_until_handled(NewMap, 2)
    robot.move()
    robot.report(running.receive)
    wait_for(lambda: len(running.given(LaserScan)) > 1 and running.state is State.LOCALIZED)
    first, second = (message.data for message in recorder.on(MAP_ID))
    assert first == "lobby"
    assert re.fullmatch("[0-9a-f]{12}", second)
    order = [topic for topic, _ in recorder.published if topic in (MAP_ID, AMCL_POSE)]
    assert order[:2] == [MAP_ID, AMCL_POSE]
    assert order.index(AMCL_POSE, order.index(MAP_ID, 1)) > order.index(MAP_ID, 1)


def test_a_map_and_a_pose_in_it_can_be_set(run, robot, recorder):
    running = run(mode=Mode.FULL)
    hint = pose_with_covariance(robot.wire.make, 0.0, "map", THERE, np.eye(3))
    request = SimpleNamespace(map=robot.map(), initial_pose=hint)
    assert running.node.answer(Request.SET_MAP, request) == {"success": True}
    running.wait_until_handled(PoseHint)
    assert len(running.given(NewMap)) == 1


def test_settings_out_of_their_range_make_no_node():
    with pytest.raises(InputError):
        NodeConfig(status_rate=-1.0)


def test_when_scans_stop_the_status_becomes_stale_once(run, robot, recorder):
    running = run(mode=Mode.FULL, scan_timeout=0.2)
    running.introduce(robot)
    wait_for(lambda: [m for m in recorder.on(STATUS) if m.status[0].level == 3])
    wait_for(lambda: running.state is State.LOCALIZED)
    (warning,) = recorder.logged(Severity.WARNING)
    assert warning.startswith("STALE: no scan for ")
    robot.move()
    robot.report(running.receive)
    wait_for(lambda: recorder.on(STATUS)[-1].status[0].level == 0)
