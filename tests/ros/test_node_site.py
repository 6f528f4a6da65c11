"""A node whose robot is in one of several maps."""

from __future__ import annotations

from pathlib import Path

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
