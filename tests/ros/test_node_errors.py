"""Errors in a node with its worker: invalid messages, missing topics, internal errors."""

from types import SimpleNamespace

import numpy as np
import pytest
from recorder import Recorder, Speaker, wait_for

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import to_pose
from firstfix.io.ros_messages.outgoing import occupancy_grid
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.states import State
from firstfix.ros import node as node_module
from firstfix.ros.channels import AMCL_POSE, STATUS, Channel
from firstfix.ros.node_config import Mode
from firstfix.ros.transport import Severity

THERE = SE2(4.0, 3.0, 1.0)


@pytest.fixture
def robot(ros2, hall_plan):
    return Speaker(ros2, hall_plan, THERE)


class Broken(Recorder):
    """A transport that fails for one topic."""

    def publish(self, topic, message):
        if topic is STATUS:
            raise RuntimeError("the wire is cut")
        super().publish(topic, message)


def test_an_internal_error_does_not_end_the_node_and_is_logged_once(run, robot, ros2, monkeypatch):
    monkeypatch.setattr(node_module, "_REPEAT_S", 1000.0)
    recorder = Broken(ros2)
    running = run(recorder, mode=Mode.FULL)
    running.introduce(robot)
    for _ in range(5):
        robot.move()
        robot.report(running.receive)
        wait_for(lambda: [m for m in recorder.on(AMCL_POSE) if to_pose(m).stamp == robot.stamp])
        running.receive(Channel.RESET)
    (error,) = recorder.logged(Severity.ERROR)
    assert error.startswith("an error of firstfix itself:\nTraceback")
    assert "the wire is cut" in error


def test_a_localizer_that_fails_is_replaced_and_searches_the_same_map(
    run, robot, recorder, monkeypatch
):
    running = run(mode=Mode.FULL)
    running.introduce(robot)
    wait_for(lambda: running.state is State.LOCALIZED)
    handle = Localizer.handle

    def fail_once(self, given):
        monkeypatch.setattr(Localizer, "handle", handle)
        del self._in_map  # half-changed
        raise ZeroDivisionError("by chance")

    monkeypatch.setattr(Localizer, "handle", fail_once)
    running.receive(Channel.UPDATE)
    wait_for(lambda: running.state is State.SEARCHING)
    wait_for(lambda: len(recorder.logged(Severity.ERROR)) == 2)
    reported, traceback = recorder.logged(Severity.ERROR)
    assert reported == "the localizer failed and was reset: searching the whole map again"
    assert "by chance" in traceback
    robot.move()
    robot.report(running.receive)
    wait_for(lambda: running.state is State.LOCALIZED)


def test_a_localizer_that_fails_on_a_new_map_keeps_the_old_one(run, robot, ros2, monkeypatch):
    running = run(mode=Mode.FULL)
    running.introduce(robot)
    wait_for(lambda: running.state is State.LOCALIZED)
    handle = Localizer.handle
    other = OccupancyGrid(np.rot90(robot.world.cells).copy(), robot.world.resolution)

    def fail_on_another(self, given):
        if isinstance(given, NewMap) and given.grid.width == other.width:
            raise ZeroDivisionError("by chance")
        return handle(self, given)

    monkeypatch.setattr(Localizer, "handle", fail_on_another)
    running.receive(Channel.MAP, ros2.sent(occupancy_grid(ros2.make, 2.0, "map", other)))
    wait_for(lambda: running.state is State.SEARCHING)
    robot.move()
    robot.report(running.receive)
    wait_for(lambda: running.state is State.LOCALIZED)


def test_invalid_messages_are_logged_in_one_sentence_and_do_not_end_the_node(run, robot, recorder):
    running = run(mode=Mode.FULL)
    running.introduce(robot)
    bad = robot.scan()
    bad.range_max = 0.0
    running.receive(Channel.SCAN, bad)
    warning = wait_for(lambda: recorder.logged(Severity.WARNING))[0]
    assert warning.startswith("expected a range_max above range_min, received")
    robot.report(running.receive)
    wait_for(lambda: running.state is State.LOCALIZED)


def test_each_warning_is_rate_limited(run, robot, recorder, monkeypatch):
    monkeypatch.setattr(node_module, "_REPEAT_S", 1000.0)
    running = run()
    running.receive(Channel.MAP, robot.map())
    for i in range(20):
        robot.move()
        running.receive(Channel.TF, robot.tf())
        running.receive(Channel.SCAN, robot.scan("lidar"))  # a frame without a transform
        bad = robot.map()
        bad.info.width = i  # each time another sentence
        running.receive(Channel.MAP, bad)
        running.receive(Channel.UPDATE)
        wait_for(lambda n=i + 1: len(running.given(Odometry)) == n)
    about_maps, about_scans = sorted(recorder.logged(Severity.WARNING), reverse=True)
    assert about_maps.startswith("expected 0 x 160 cells")
    assert about_scans.startswith("1 scans dropped so far; the pose of the laser is unknown")


def test_warnings_come_again_when_their_time_is_over(run, recorder, monkeypatch):
    monkeypatch.setattr(node_module, "_REPEAT_S", 0.0)
    running = run()
    for _ in range(3):
        running.receive(Channel.CLIFF, SimpleNamespace(data="no event"))
    wait_for(lambda: len(recorder.logged(Severity.WARNING)) == 3)


def test_topics_without_messages_are_named_although_others_have_some(
    run, robot, recorder, monkeypatch
):
    monkeypatch.setattr(node_module, "_SILENCE_S", 0.05)
    running = run()

    def speak():
        robot.move(seconds=0.01)
        running.receive(Channel.TF, robot.tf())
        return len(recorder.logged(Severity.WARNING)) >= 2

    wait_for(speak)
    assert sorted(recorder.logged(Severity.WARNING)) == [
        "no message on map (nav_msgs/OccupancyGrid) for 0 s",
        "no message on scan (sensor_msgs/LaserScan) for 0 s",
    ]


def test_scans_that_need_no_conversion_are_used_too(run, robot, recorder, monkeypatch, hall_plan):
    monkeypatch.setattr(node_module, "_SILENCE_S", 0.2)
    running = run(mode=Mode.FULL)
    running.node.give(NewMap(0.0, hall_plan))
    running.node.give(Odometry(1.0, SE2.identity()))
    for _ in range(10):
        running.node.give(LaserScan(np.ones(9, np.float32), 0.0, 0.1, 0.1, 5.0, stamp=1.0))
        running.wait_until_handled(LaserScan)
    assert len(running.given(NewMap)) == 1
    assert not any("scan" in text for text in recorder.logged(Severity.WARNING))
