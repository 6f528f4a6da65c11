"""A node with several sensors, and with zones."""

import math

import pytest
from recorder import BASE, LASER, Speaker

from firstfix.core.errors import InputError
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.io.ros_messages.outgoing import transforms
from firstfix.localizer.inputs import Reset
from firstfix.localizer.states import State
from firstfix.ros.channels import Channel
from firstfix.ros.transport import Severity


def test_two_lasers_find_the_robot_together(run, ros2, hall_plan):
    robot = Speaker(ros2, hall_plan, SE2(4.0, 3.0, 1.0))
    node = run(scan_topics="scan rear/scan")
    node.receive(Channel.MAP, robot.map())
    node.receive(Channel.TF_STATIC, robot.fixed())
    rear = transforms(ros2.make, 0.0, BASE, "rear", SE2(0.0, 0.0, math.pi / 2))
    node.receive(Channel.TF_STATIC, ros2.sent(rear))
    for n in range(1, 6):
        robot.move()
        robot.report(node.receive)
        node.receive(Channel.SCAN, robot.scan("rear"))
        node.wait_until_handled(LaserScan, 2 * n)
    assert {scan.sensor for scan in node.given(LaserScan)} == {LASER, "rear"}
    assert node.recorder.logged(Severity.ERROR) == []


@pytest.fixture
def map_file(hall_plan, tmp_path):
    save_map(hall_plan, tmp_path / "hall.yaml")
    zones = "zones: {here: [[2, 1], [6, 1], [6, 5], [2, 5]], far: [[900, 0], [901, 0], [901, 1]]}"
    (tmp_path / "hall.zones.yaml").write_text(zones)
    return tmp_path / "hall.yaml"


def test_a_search_begins_in_the_zones(run, ros2, hall_plan, map_file):
    robot = Speaker(ros2, hall_plan, SE2(4.0, 3.0, 1.0))
    node = run(yaml_filename=str(map_file), zones="here")
    node.wait_until_handled(Reset)
    node.receive(Channel.TF_STATIC, robot.fixed())
    robot.report(node.receive)
    node.wait_until_handled(LaserScan)
    assert node.state is State.LOCALIZED


@pytest.mark.parametrize(
    ("zones", "words"), [("nowhere", "There is no zone nowhere"), ("here far", "free space")]
)
def test_a_zone_that_is_not_there_is_refused_at_the_start(run, map_file, zones, words):
    node = run(start=False, yaml_filename=str(map_file), zones=zones)
    with pytest.raises(InputError, match=words):
        node.node.start()
