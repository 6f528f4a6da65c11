"""The page of a real robot is served in a background thread."""

from __future__ import annotations

import threading
from pathlib import Path

import httpx
import numpy as np
import pytest
from live_lab import until
from recorder import Recorder
from site_lab import save_rooms, scan_in

from firstfix.core.errors import InputError
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import WORLDS
from firstfix.localizer.inputs import NewMap, Reset
from firstfix.ros.node_config import Mode, NodeConfig
from firstfix.web.access_control import AccessPolicy
from firstfix.web.background_page import BackgroundPage
from firstfix.web.server import listen, url_of

HOUSE = WORLDS["house"]()
HERE = SE2(3.0, 2.0, 0.5)


@pytest.fixture
def ways(recorder: Recorder, request: pytest.FixtureRequest):
    name = getattr(request, "param", "house")
    with (
        listen("127.0.0.1", 0) as listening,
        BackgroundPage("dds", name, AccessPolicy(), listening) as page,
        httpx.Client(base_url=url_of(listening), timeout=240.0) as api,
    ):
        until(lambda: page._server.started)
        yield page, api


def state(api: httpx.Client) -> str:
    return api.get("/v1/status").json()["state"]


def test_a_node_is_shown_and_controlled(ways, recorder: Recorder):
    page, api = ways
    assert state(api) == "NO_MAP"
    node = page.make_node(NodeConfig(mode=Mode.FULL), recorder)
    node.start()
    node.give(NewMap(0.0, HOUSE))
    until(lambda: state(api) == "SEARCHING")
    node.give(Odometry(1.0, SE2.identity()))
    node.give(Lidar().scan(HOUSE, HERE, np.random.default_rng(0), stamp=1.0))
    until(lambda: state(api) == "LOCALIZED")
    x, y, _ = api.get("/v1/status").json()["pose"]
    assert (x, y) == pytest.approx((HERE.x, HERE.y), abs=0.1)
    assert api.get("/v1/map").json()["name"] == "house"
    assert api.post("/v1/relocalize").status_code == 202
    until(lambda: state(api) == "SEARCHING")
    node.stop()


@pytest.mark.parametrize("ways", [""], indirect=True)
def test_the_map_of_a_site_is_shown_by_its_name(ways, recorder: Recorder, tmp_path: Path):
    page, api = ways
    node = page.make_node(NodeConfig(mode=Mode.FULL, site=f"{save_rooms(tmp_path)}"), recorder)
    node.start()
    assert api.get("/v1/map").status_code == 503
    for stamp, room in ((1.0, "first"), (9.0, "second")):
        node.give(Reset(stamp))
        node.give(Odometry(stamp, SE2.identity()))
        node.give(scan_in(room, SE2(3.9, 1.7, 0.6), stamp=stamp))
        until(lambda name=room: api.get("/v1/map").json().get("name") == name)
        until(lambda: state(api) == "LOCALIZED")
    node.stop()


def test_commands_before_the_node_is_configured_are_refused(ways):
    page, _ = ways
    with pytest.raises(InputError, match="configure"):
        page.give(NewMap(0.0, HOUSE))


def test_it_ends_with_its_context(recorder: Recorder):
    before = threading.active_count()
    with listen("127.0.0.1", 0) as listening, BackgroundPage("dds", "a", AccessPolicy(), listening):
        pass
    assert threading.active_count() == before
