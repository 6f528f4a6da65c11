"""Incidents over real connections: saved, listed, downloaded, replayed."""

from __future__ import annotations

import httpx
import numpy as np
import pytest
from live_lab import served

from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.io.incident_files import IncidentFolder, load_incident
from firstfix.lab.live.replayed_incident import ReplayedIncident
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.incident_document import from_document
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.states import State
from firstfix.ros.incident_keeper import IncidentKeeper
from firstfix.web.access_control import AccessPolicy
from firstfix.web.command_executor import CommandExecutor
from firstfix.web.page import Page
from firstfix.web.snapshot_store import SnapshotStore


@pytest.fixture
def keeper(tmp_path, hall_plan):
    keeper, localizer = IncidentKeeper(30.0, IncidentFolder(tmp_path), print), Localizer()
    scan = Lidar(beams=90).scan(hall_plan, SE2(4.0, 3.0, 1.0), np.random.default_rng(1), 1.0)
    for given in (NewMap(0.0, hall_plan), Odometry(1.0, SE2.identity()), scan):
        keeper(given, localizer.handle(given), localizer)
    yield keeper
    keeper.close()


def page_of(keeper, access=None) -> Page:
    store = SnapshotStore("test")
    executor = CommandExecutor(store, lambda _: None)
    return Page("ros2", store, executor, access or AccessPolicy(), incidents=lambda: keeper)


def test_an_incident_is_saved_listed_and_downloaded(keeper, tmp_path, hall_plan):
    with served(page_of(keeper)) as url, httpx.Client(base_url=url) as client:
        assert client.get("/v1/incidents").json() == {"incidents": []}
        answer = client.post("/v1/incidents")
        assert answer.status_code == 201
        saved = answer.json()
        (listed,) = client.get("/v1/incidents").json()["incidents"]
        assert (listed["name"], listed["url"]) == (saved["name"], saved["url"])
        assert listed["cause"] == "requested"
        content = client.get(saved["url"]).content
        assert len(content) == listed["bytes"]
        (tmp_path / "copy.npz").write_bytes(content)
        for name in ("copy.npz", "..%2Fcopy.npz", "incident-20261130T101502123Z-lost-pose.npz"):
            assert client.get(f"/v1/incidents/{name}").status_code == 404
    incident = from_document(*load_incident(tmp_path / "copy.npz")).incident
    assert len(incident.inputs) == 2

    replayed = ReplayedIncident(incident, "hall", AccessPolicy(may_steer=False))
    replayed.start()
    replayed._thread.join()
    assert replayed.page.store.snapshot.state is State.LOCALIZED
    assert replayed.page.store.events()[-1].text.endswith("(repeated; identical to the last bit)")
    replayed.stop()


def test_what_cannot_be_saved_is_a_problem(keeper):
    read_only = page_of(keeper, AccessPolicy(may_steer=False))
    for page, status in ((read_only, 403), (page_of(None), 409)):
        with served(page) as url:
            answer = httpx.post(f"{url.rstrip('/')}/v1/incidents")
        assert answer.status_code == status
        assert answer.headers["content-type"] == "application/problem+json"
    assert keeper.folder.files() == []
