"""A fleet on a real Ray cluster of several local nodes, one of which is killed."""

from __future__ import annotations

import asyncio
import importlib.util
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fleet_lab import FleetServer, as_message, narrow_views, scan_of
from required import missing

from firstfix.belief.prior import Near
from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.se2 import SE2
from firstfix.fleet.fleet import Fleet, NotReadyError
from firstfix.fleet.jobs import ShardedSite, spread
from firstfix.io.maps.site_yaml import read_site
from firstfix.site.query import SiteQuery
from firstfix.site.site_belief import SiteBelief

pytestmark = [
    pytest.mark.slow,
    pytest.mark.cluster,
    # Ray leaves sockets and files to the end of the process.
    pytest.mark.filterwarnings("ignore"),
]

LOCAL = "127.0.0.1"
POSE = SE2(3.9, 1.7, 0.6)
BACK_S = 90.0
HERE = {"node_ip_address": LOCAL, "include_dashboard": False}


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Give a cluster: a head without cores, and two nodes that have room for two workers each."""
    if importlib.util.find_spec("ray") is None:
        missing("ray", "no Ray: pip install 'firstfix[ray]'")
    # Nothing is reported, and drivers stay at the loopback address; both are read at import.
    os.environ.update(RAY_USAGE_STATS_ENABLED="0", RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER="0")
    from ray.cluster_utils import Cluster

    soon = {"health_check_period_ms": 1000, "health_check_failure_threshold": 3}
    cluster = Cluster(
        initialize_head=True, head_node_args={"num_cpus": 0, "_system_config": soon, **HERE}
    )
    for _ in range(2):
        cluster.add_node(num_cpus=2, wait=False, **HERE)
    cluster.wait_for_nodes()
    yield cluster
    cluster.shutdown()


async def answer(fleet: Fleet, room: str) -> str | None:
    """Return the map of an answer; None if there is an error that says to try again."""
    try:
        return (await fleet.locate(SiteQuery.of(scan_of(room, POSE)))).map_id
    except NotReadyError:
        return None


def test_queries_survive_the_loss_of_a_node(
    cluster: Any, rooms: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    from firstfix.fleet.ray_engine import RayEngine

    shards = spread(read_site(rooms).maps, 2)
    prepared = tmp_path_factory.getbasetemp() / "fleet-cache" / "sites"
    engine = RayEngine(ShardedSite(rooms, shards, prepared, 10**9), cluster.address)
    asked = ["first", "second"] * 10
    outside = SiteQuery.of(
        [scan_of("first", POSE)] * 2, prior={"first": Near(SE2(99.0, 0.0, 0.0), 1.0)}
    )

    async def drive() -> None:
        fleet = Fleet(engine, shards)
        await fleet.prepare()
        assert (len(fleet.prepared), list(fleet.faults)) == (4, ["broken"])
        assert [await answer(fleet, room) for room in asked[:2]] == asked[:2]
        with pytest.raises(InputError, match="expected a prior on the map"):
            await fleet.locate(outside)
        belief = SiteBelief()
        for view in narrow_views("first"):
            result, belief = await fleet.follow(belief, view)
        assert (result.verdict, result.map_id) == (Verdict.UNIQUE, "first")

        running = [asyncio.create_task(answer(fleet, room)) for room in asked]
        await asyncio.sleep(0.05)
        node = next(iter(cluster.worker_nodes))
        await asyncio.to_thread(cluster.remove_node, node, allow_graceful=False)
        for room, task in zip(asked, running, strict=True):
            assert await task in {room, None}
        # The maps of the lost node come back on the other one.
        until = time.monotonic() + BACK_S
        while await answer(fleet, "second") != "second":
            assert time.monotonic() < until
        assert [await answer(fleet, room) for room in asked[:2]] == asked[:2]
        assert fleet.lost_jobs > 0

    try:
        asyncio.run(asyncio.wait_for(drive(), 3.0 * BACK_S))
    finally:
        engine.close()
        cluster.add_node(num_cpus=2, **HERE)  # two workers and a front need three cores


def test_the_service_runs_on_a_cluster(
    cluster: Any, serve: Callable[..., FleetServer], rooms: Path
) -> None:
    address = cluster.address
    server = serve(
        rooms, "--engine", "ray", "--ray-address", address, "--workers", "2", "--parts", "2"
    )
    server.wait_until_ready()
    body = {"scans": [as_message(scan_of("second", POSE))]}
    found = server.http.post("/v1/locate", json=body).json()
    assert (found["verdict"], found["map_id"], found["searched"]) == ("UNIQUE", "second", 4)
    assert server.stop() == 0


def test_a_cluster_that_is_away_is_one_sentence(cli: Callable[..., Any], rooms: Path) -> None:
    if importlib.util.find_spec("ray") is None:
        missing("ray", "no Ray: pip install 'firstfix[ray]'")
    address = "127.0.0.1:1"
    status, text = cli("fleet", "serve", rooms, "--engine", "ray", "--ray-address", address)
    assert status == 2
    assert text.startswith("firstfix: The Ray cluster at '127.0.0.1:1' does not answer.")
    assert text.count("\n") == 1


def test_ray_serve_has_the_same_service(
    cluster: Any, rooms: Path, monkeypatch: pytest.MonkeyPatch, free_port: int
) -> None:
    import httpx
    import ray
    from ray import serve

    from firstfix.fleet.ray_serve import build

    monkeypatch.delenv("FIRSTFIX_TOKEN", raising=False)
    with pytest.raises(InputError, match="Set FIRSTFIX_TOKEN"):
        build({"site": str(rooms), "workers": "2"})
    with pytest.raises(InputError, match="Pass site=PATH"):
        build({"site": str(rooms)})
    monkeypatch.setenv("FIRSTFIX_TOKEN", "open-sesame")
    ray.init(cluster.address, log_to_driver=False)
    try:
        serve.start(http_options={"host": LOCAL, "port": free_port})
        serve.run(build({"site": str(rooms), "workers": "2"}))
        bearer = {"authorization": "Bearer open-sesame"}
        with httpx.Client(base_url=f"http://{LOCAL}:{free_port}", timeout=60.0) as http:
            until = time.monotonic() + BACK_S
            while http.get("/readyz").status_code != 200:
                assert time.monotonic() < until
                time.sleep(0.2)
            body = {"scans": [as_message(scan_of("second", POSE))]}
            assert http.post("/v1/locate", json=body).status_code == 401
            found = http.post("/v1/locate", json=body, headers=bearer).json()
            assert (found["verdict"], found["map_id"]) == ("UNIQUE", "second")
            for room in ("second", "first", "second"):  # by the replica that holds the map
                body = {"scans": [as_message(scan_of(room, POSE))], "map": room}
                found = http.post("/v1/locate", json=body, headers=bearer).json()
                assert (found["verdict"], found["map_id"], found["searched"]) == ("UNIQUE", room, 1)
            refused = http.post("/v1/locate", json={}, headers=bearer)
            assert refused.headers["content-type"] == "application/problem+json"
    finally:
        serve.shutdown()
        ray.shutdown()
