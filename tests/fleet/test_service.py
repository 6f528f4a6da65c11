"""``firstfix fleet serve`` over HTTP, with its processes of this machine."""

from __future__ import annotations

import importlib.util
import io
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fleet_lab import FleetServer, as_message, scan_of
from prometheus_client.parser import text_string_to_metric_families
from required import missing

from firstfix.core.se2 import SE2
from firstfix.site.site import Site

POSE = SE2(3.9, 1.7, 0.6)


@pytest.fixture(scope="module")
def server(serve: Callable[..., FleetServer], rooms: Path) -> FleetServer:
    return serve(rooms, "--workers", "2", "--parts", "2", "--max-robots", "3").wait_until_ready()


def ask(server: FleetServer, **body: Any) -> dict[str, Any]:
    response = server.http.post("/v1/locate", json=body)
    assert response.status_code == 200, response.text
    return response.json()


def test_locate_gives_the_answer_of_the_site(server: FleetServer, rooms: Path) -> None:
    scan = scan_of("second", POSE)
    answer = ask(server, scans=[as_message(scan)])
    alone = Site.load(rooms).locate(scan).to_dict()
    assert (answer["verdict"], answer["map_id"]) == ("UNIQUE", "second")
    assert answer["pose"] == pytest.approx(list(POSE), abs=0.05)
    assert answer["pose"] == pytest.approx(alone["pose"], abs=1e-6)
    assert answer["searched"] == 4
    assert answer["maps"] == pytest.approx(alone["maps"], abs=0.02)


def test_a_bare_scan_and_a_file_are_the_same(server: FleetServer) -> None:
    scan = scan_of("first", POSE)
    message = as_message(scan)
    packed = io.BytesIO()
    np.savez(packed, **{k: np.asarray(v) for k, v in message.items()})
    bare = server.http.post("/v1/locate", json=message).json()
    file = server.http.post(
        "/v1/locate",
        content=packed.getvalue(),
        headers={"content-type": "application/octet-stream"},
    )
    assert bare["map_id"] == "first"
    assert file.json().get("pose") == pytest.approx(bare["pose"], abs=1e-3), file.text


def test_copies_are_listed_and_the_broken_map_is_named(server: FleetServer) -> None:
    answer = ask(server, scans=[as_message(scan_of("ground", POSE))])
    also = [other["map_id"] for other in answer["hypotheses"][0]["also"]]
    assert sorted([answer["map_id"], *also]) == ["copy", "ground"]
    assert answer["verdict"] == "UNIQUE"
    assert [fault[:14] for fault in answer["faults"]] == ["The map broken"]
    states = {each["map_id"]: each for each in server.http.get("/v1/maps").json()["maps"]}
    assert states["broken"]["fault"].startswith("The map broken cannot be used: ")
    assert [name for name, state in states.items() if state["ready"]] == [
        "copy",
        "first",
        "ground",
        "second",
    ]


def test_only_the_named_map_is_searched(server: FleetServer) -> None:
    message = as_message(scan_of("second", POSE))
    answer = server.http.post("/v1/locate?map=second", json=message).json()
    assert (answer["map_id"], answer["searched"]) == ("second", 1)
    refused = server.http.post("/v1/locate?map=broken", json=message)
    assert (refused.status_code, refused.json()["detail"][:14]) == (503, "The map broken")
    unknown = server.http.post("/v1/locate", json={"scans": [message], "map": "attic"})
    assert unknown.status_code == 404
    assert unknown.json()["detail"].startswith("There is no map 'attic' in this site.")


def test_a_prior_names_maps(server: FleetServer) -> None:
    message = as_message(scan_of("second", POSE))
    near = {"pose": list(POSE), "radius": 1.0}
    answer = ask(server, scans=[message], prior={"second": near, "first": None})
    assert answer["map_id"] == "second"
    refused = server.http.post("/v1/locate", json={"scans": [message], "zone": "attic"})
    assert refused.status_code == 422
    assert refused.json()["detail"].startswith("No map of this site has zones.")
    for prior, status in (({"attic": None}, 404), ({"second": {**near, "radius": -1.0}}, 422)):
        refused = server.http.post("/v1/locate", json={"scans": [message], "prior": prior})
        assert refused.status_code == status, refused.text


def test_views_of_a_robot_are_judged_together(server: FleetServer) -> None:
    # A sensor of 69 degrees sees too little from one pose.
    poses = [SE2(2.3, 2.1, 0.2 + 0.5 * i) for i in range(4)]
    views = []
    for pose in poses:
        message = as_message(scan_of("first", pose, beams=91, fov=1.2))
        answer = server.http.post(
            "/v1/robots/r1/scans", json={"scans": [message], "odometry": list(pose)}
        ).json()
        views.append((answer["views"], answer["verdict"]))
    assert [count for count, _ in views] == [1, 2, 3, 4]
    assert views[0][1] == "AMBIGUOUS"
    assert (answer["map_id"], answer["verdict"]) == ("first", "UNIQUE")
    assert server.http.get("/v1/robots/r1").json() == answer
    assert "r1" in server.http.get("/v1/robots").json()["robots"]
    assert server.http.delete("/v1/robots/r1").status_code == 204
    for method in ("GET", "DELETE"):
        gone = server.http.request(method, "/v1/robots/r1")
        assert (gone.status_code, gone.json()["detail"][:10]) == (404, "This robot")


def test_a_new_robot_takes_the_place_of_the_most_silent_one(server: FleetServer) -> None:
    body = {"scans": [as_message(scan_of("first", POSE))], "odometry": [0.0, 0.0, 0.0]}
    for name in ("a", "b", "c", "a", "d"):
        assert server.http.post(f"/v1/robots/{name}/scans", json=body).status_code == 200
    assert server.http.get("/v1/robots").json()["robots"] == ["a", "c", "d"]
    for name in ("a", "c", "d"):
        server.http.delete(f"/v1/robots/{name}")


def test_what_does_not_follow_the_last_view_is_refused_and_the_robot_begins_anew(
    server: FleetServer,
) -> None:
    scan = as_message(scan_of("first", POSE))
    for x, stamp, status, views in (
        (0.0, 5.0, 200, 1),
        (0.5, 6.0, 200, 2),
        (0.9, 2.0, 422, 0),  # older
        (1.3, 7.0, 200, 1),
    ):
        body = {"scans": [{**scan, "stamp": stamp}], "odometry": [x, 0.0, 0.0]}
        answer = server.http.post("/v1/robots/r2/scans", json=body)
        assert answer.status_code == status, answer.text
        assert answer.json().get("views", 0) == views
    blind = {"scans": [{**scan, "ranges": [None] * 360}], "odometry": [1.7, 0.0, 0.0]}
    answer = server.http.post("/v1/robots/r2/scans", json=blind).json()
    assert (answer["verdict"], answer["views"]) == ("NO_MATCH", 1), "and nothing is lost"
    server.http.delete("/v1/robots/r2")


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 400),
        (b"\xff\xfe", 400),
        (b"[" * 100_000, 422),
        (b"[]", 422),
        (b"{}", 422),
        (b'{"scans": []}', 422),
        (b'{"scans": [{"ranges": [1e999]}]}', 422),
        (b'{"scans": [{}], "prior": 3}', 422),
    ],
)
@pytest.mark.parametrize("path", ["/v1/locate", "/v1/robots/x/scans"])
def test_bad_bodies_are_refused_in_a_sentence(
    server: FleetServer, path: str, body: bytes, status: int
) -> None:
    response = server.http.post(path, content=body, headers={"content-type": "application/json"})
    assert response.headers["content-type"] == "application/problem+json"
    assert response.status_code == status
    assert response.json()["detail"].endswith(".")
    assert server.http.get("/v1/robots/x").status_code == 404


def test_other_hostile_requests_are_refused(server: FleetServer) -> None:
    message = as_message(scan_of("first", POSE))
    jump = {"scans": [message, message], "odometry": [[0, 0, 0], [1000, 0, 0]]}
    assert server.http.post("/v1/locate", json=jump).status_code == 422
    short = {"scans": [message, message], "odometry": [[0, 0, 0]]}
    assert server.http.post("/v1/locate", json=short).status_code == 422
    many = {"scans": [message] * 17}
    assert server.http.post("/v1/locate", json=many).status_code == 422
    huge = server.http.post(
        "/v1/locate", content=b" " * (5 << 20), headers={"content-type": "application/json"}
    )
    assert huge.status_code == 413
    assert server.http.post("/v1/locate", content=b"x").status_code == 415
    assert server.http.get("/v1/locate").status_code == 405
    assert server.http.get("/v1/robots/..%00").status_code in {404, 422}
    assert server.http.get(f"/v1/robots/{'x' * 65}").status_code == 422
    not_a_file = server.http.post(
        "/v1/locate", content=b"PK\3\4", headers={"content-type": "application/octet-stream"}
    )
    assert not_a_file.status_code == 422


def test_many_robots_at_once_are_all_answered(server: FleetServer) -> None:
    rooms = ["ground", "first", "second"] * 4
    bodies = [{"scans": [as_message(scan_of(room, POSE, seed=i))]} for i, room in enumerate(rooms)]
    with ThreadPoolExecutor(len(bodies)) as robots:
        answers = list(robots.map(lambda body: ask(server, **body), bodies))
    assert [answer["verdict"] for answer in answers] == ["UNIQUE"] * len(rooms)
    found = [answer["map_id"].replace("copy", "ground") for answer in answers]
    assert found == rooms


def test_a_killed_worker_is_replaced_and_nothing_is_wrong(server: FleetServer) -> None:
    body = {"scans": [as_message(scan_of("first", POSE))]}
    before = server.workers()
    assert len(before) == 2
    with ThreadPoolExecutor(5) as robots:
        asked = [robots.submit(server.http.post, "/v1/locate", json=body) for _ in range(10)]
        time.sleep(0.05)
        os.kill(before[0], signal.SIGKILL)
        responses = [each.result() for each in asked]
    for response in responses:
        assert response.status_code in {200, 503}
        if response.status_code == 200:
            assert response.json()["map_id"] == "first"
        else:
            assert "retry-after" in response.headers
    answer = ask(server, **body)
    assert (answer["verdict"], answer["map_id"]) == ("UNIQUE", "first")
    assert set(server.workers()) & set(before) == {before[1]}


def test_metrics(server: FleetServer) -> None:
    ask(server, scans=[as_message(scan_of("first", POSE))])
    text = server.http.get("/metrics").text
    values = {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }
    assert values["firstfix_maps", "prepared"] == 4
    assert values["firstfix_maps", "unusable"] == 1
    assert values["firstfix_verdicts_total", "UNIQUE"] >= 1
    assert values["firstfix_requests_total", "locate", "200"] >= 1
    assert values["firstfix_latency_seconds_count", "locate"] >= 1
    assert values["firstfix_queue",] == 0
    assert values["process_resident_memory_bytes",] > 1e7
    assert values["firstfix_worker_memory_bytes", "0"] > 1e7


@pytest.fixture(scope="module")
def guarded(serve: Callable[..., FleetServer], rooms: Path) -> FleetServer:
    return serve(rooms, "--workers", "1", "--token", "open-sesame")


def test_a_token_is_needed_but_for_the_state_and_the_page(guarded: FleetServer) -> None:
    server = guarded
    for path in ("/", "/static/fleet.js", "/static/fleet.css", "/healthz", "/openapi.json"):
        assert server.http.get(path).status_code == 200, path
    # Maps are not prepared yet, which is no error.
    assert server.http.get("/readyz").json().keys() >= {"ready", "prepared"}
    message = as_message(scan_of("first", POSE))
    for path in ("/v1/maps", "/v1/robots", "/metrics"):
        assert server.http.get(path).status_code == 401, path
    assert server.http.post("/v1/locate", json=message).status_code == 401
    bearer = {"authorization": "Bearer open-sesame"}
    early = server.http.post("/v1/locate", json=message, headers=bearer)
    assert early.status_code in {200, 503}
    if early.status_code == 503:
        assert early.json()["detail"].endswith("maps are not prepared yet. Try again later.")
        assert early.headers["retry-after"] == "1"


def test_the_document_has_all_routes(server: FleetServer) -> None:
    described = server.http.get("/openapi.json").json()
    schemas = described["components"]["schemas"]
    used = set(re.findall(r"#/components/schemas/(\w+)", server.http.get("/openapi.json").text))
    assert used == set(schemas)
    for path, item in described["paths"].items():
        for method in {"get", "post", "delete"} & set(item):
            answer = server.http.request(method, path.replace("{robot}", "nobody"))
            assert str(answer.status_code) in item[method]["responses"], (method, path)


@pytest.mark.slow
def test_schemathesis_finds_no_deviation_from_the_document(server: FleetServer) -> None:
    if importlib.util.find_spec("schemathesis") is None:
        missing("schemathesis", "no schemathesis: pip install schemathesis")
    arguments = (
        *("--seed", "1", "--max-examples", "10", "--generation-deterministic"),
        *("--workers", "1", "--no-color"),
        # For a schema, any bytes may be an .npz.
        *("--exclude-checks", "positive_data_acceptance"),
    )
    url = f"{server.http.base_url}".rstrip("/") + "/openapi.json"
    command = [sys.executable, "-m", "schemathesis.cli", "run", url]
    ended = subprocess.run(
        [*command, *arguments], capture_output=True, text=True, timeout=240, check=False
    )
    assert ended.returncode == 0, ended.stdout[-4000:] + ended.stderr[-2000:]
    assert "Tested: 9" in ended.stdout
    for name in server.http.get("/v1/robots").json()["robots"]:
        server.http.delete(f"/v1/robots/{name}")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--host", "0.0.0.0"], "expected a --token"),  # noqa: S104
        (["--workers", "3", "--parts", "2"], "3 workers cannot share 2 parts."),
        (["--token", "short"], "expected a token of at least 8 characters"),
        (["--ray-address", "127.0.0.1:1"], "--ray-address is of no use without --engine ray."),
    ],
)
def test_wrong_options_are_one_sentence(
    cli: Callable[..., tuple[int, str]], rooms: Path, options: list[str], sentence: str
) -> None:
    status, text = cli("fleet", "serve", rooms, *options)
    assert (status, text.count("\n")) == (2, 1)
    assert text.startswith(f"firstfix: {sentence}")


def test_the_end_leaves_no_process(guarded: FleetServer) -> None:
    workers = guarded.wait_until_ready().workers()
    assert workers
    assert guarded.stop() == 0
    deadline = time.monotonic() + 10.0
    while any(Path(f"/proc/{pid}").exists() for pid in workers):
        assert time.monotonic() < deadline
        time.sleep(0.05)
