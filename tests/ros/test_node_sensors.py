"""A node with several sensors, and with zones."""

import math

import numpy as np
import pytest
from recorder import BASE, LASER, Speaker

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.io.ros_messages.outgoing import transforms
from firstfix.localizer.inputs import NewMap, Reset
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


def layer_of(plan, path, rows=slice(None)):
    """Write that all walls are gone."""
    save_map(OccupancyGrid(np.zeros_like(plan.cells[rows]), plan.resolution, plan.T_map_grid), path)
    return str(path)


def test_what_has_changed_is_known_in_any_map_of_these_cells(run, ros2, hall_plan, tmp_path):
    robot = Speaker(ros2, hall_plan, SE2(4.0, 3.0, 1.0))
    node = run(changes_layer=layer_of(hall_plan, tmp_path / "changes.yaml"))
    node.receive(Channel.MAP, robot.map())
    node.wait_until_handled(NewMap)
    assert node.given(NewMap)[0].grid.changed.any()
    robot.world = OccupancyGrid(hall_plan.cells[:-10], hall_plan.resolution, hall_plan.T_map_grid)
    node.receive(Channel.MAP, robot.map())
    node.wait_until_handled(NewMap, 2)
    assert node.given(NewMap)[1].grid.changed is None
    (line,) = node.recorder.logged(Severity.WARNING)
    assert "changes_layer is not used" in line


def test_changes_of_another_map_file_are_refused_at_the_start(run, hall_plan, map_file, tmp_path):
    layer = layer_of(hall_plan, tmp_path / "changes.yaml", slice(10, None))
    node = run(start=False, yaml_filename=str(map_file), changes_layer=layer)
    with pytest.raises(InputError, match="another map"):
        node.node.start()
