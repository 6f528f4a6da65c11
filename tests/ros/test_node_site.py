"""A node whose robot is in one of several maps."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from recorder import Speaker, wait_for

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.localizer.inputs import MapHint
from firstfix.localizer.states import State
from firstfix.ros.channels import AMCL_POSE, MAP, MAP_ID, Channel, published_topics, subscriptions
from firstfix.ros.node_config import Mode, NodeConfig
from firstfix.ros.services import Request, ros1_services, ros2_services

THERE = SE2(4.0, 3.0, 1.0)


@pytest.fixture
def site(tmp_path: Path, hall_plan: OccupancyGrid) -> str:
    save_map(hall_plan, tmp_path / "ground.yaml")
    flipped = OccupancyGrid(hall_plan.cells[::-1], hall_plan.resolution, hall_plan.T_map_grid)
    save_map(flipped, tmp_path / "first.yaml")
    return str(tmp_path)


def test_the_map_is_named_then_published_then_the_pose(run, ros2, recorder, hall_plan, site):
    running = run(mode=Mode.FULL, site=site)
    running.introduce(Speaker(ros2, hall_plan, THERE))
    wait_for(lambda: recorder.on(AMCL_POSE))
    assert [message.data for message in recorder.on(MAP_ID)] == ["ground"]
    sent = [topic.name for topic, _ in recorder.published]
    assert sent.index(MAP_ID.name) < sent.index(MAP.name) < sent.index(AMCL_POSE.name)
    (published,) = (message for topic, message in recorder.published if topic == MAP)
    assert (published.info.height, published.info.width) == hall_plan.cells.shape
    assert 100 in np.asarray(published.data)
    wait_for(lambda: running.state is State.LOCALIZED)


def test_a_lift_may_name_the_map(run, ros2, site):
    running = run(site=site)
    running.receive(Channel.MAP_HINT, ros2.make("std_msgs/String", data="first"))
    running.wait_until_handled(MapHint)
    assert running.given(MapHint)[0].map_id == "first"


def test_a_map_server_loads_the_map_in_place_of_the_node(run, ros2, recorder, hall_plan, site):
    running = run(mode=Mode.FULL, site=site, load_map_service="/map_server/load_map")
    running.introduce(Speaker(ros2, hall_plan, THERE))
    wait_for(lambda: recorder.on(AMCL_POSE) and recorder.map_server)
    assert recorder.map_server == [("/map_server/load_map", f"{Path(site) / 'ground.yaml'}")]
    assert [message.data for message in recorder.on(MAP_ID)] == ["ground"]
    assert not [topic for topic, _ in recorder.published if topic.name == MAP.name]


def test_a_request_for_a_map_of_the_site_is_a_hint(run, site):
    running = run(site=site)
    done = running.node.answer(Request.LOAD_MAP, SimpleNamespace(map_url=f"{site}/first.yaml"))
    assert done["result"] == 0
    running.wait_until_handled(MapHint)
    assert running.given(MapHint)[0].map_id == "first"
    save_map(OccupancyGrid(np.zeros((50, 50), np.int8), 0.05), Path(site) / "sub.yaml")
    other = SimpleNamespace(map_url=f"{site}/sub.yaml")
    assert running.node.answer(Request.LOAD_MAP, other)["result"] != 0


@pytest.mark.parametrize("services", [ros1_services, ros2_services])
def test_a_node_with_a_site_offers_to_load_its_maps(services):
    names = [service.name for service in services(NodeConfig(site="floors"))]
    assert "~/load_map" in names
    assert "~/load_map" not in [service.name for service in services(NodeConfig())]


def test_a_map_server_without_a_site_is_refused():
    with pytest.raises(InputError, match="load_map_service is for the maps of a site"):
        NodeConfig(load_map_service="/map_server/load_map")


def test_a_site_owns_the_map_topic():
    config = NodeConfig(site="floors", map_topic="plan")
    assert Channel.MAP not in dict(subscriptions(config))
    assert Channel.MAP_HINT in dict(subscriptions(config))
    assert [topic.name for topic in published_topics(config, AMCL_POSE)][:2] == ["map_id", "plan"]


def test_a_site_beside_a_map_file_is_refused():
    with pytest.raises(InputError, match="both set"):
        NodeConfig(site="floors", yaml_filename="map.yaml")


def test_a_site_that_is_not_there_is_refused(run, tmp_path):
    with pytest.raises(InputError, match="no folder or file"):
        run(site=str(tmp_path / "none"))
