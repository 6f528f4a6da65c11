"""POST /v1/locate answers as the library does, and refuses everything else."""

from __future__ import annotations

import concurrent.futures
import io
import json
import threading
import zipfile
from collections.abc import Iterator

import httpx
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from live_lab import Site, drive, fed, until

from firstfix.core.scan import LaserScan
from firstfix.lab.live.simulated_robot import SENSORS
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.web.locate_queue import MOST_WAITING

JSON = {"content-type": "application/json"}
NPZ = {"content-type": "application/octet-stream"}
NAMES = ("angle_min", "angle_increment", "range_min", "range_max")


@pytest.fixture(scope="module")
def site() -> Iterator[Site]:
    begun = drive("house")
    begun.step(22)
    with fed(store=begun.store) as site:
        yield site


@pytest.fixture
def api(site: Site) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=site.url, timeout=240.0) as client:
        yield client


@pytest.fixture
def scan(site: Site) -> LaserScan:
    return site.store.snapshot.scan.scan


def as_json(scan: LaserScan) -> dict:
    ranges = [float(r) if np.isfinite(r) else None for r in scan.ranges]
    sensor = {name: getattr(scan, name) for name in NAMES}
    return {"ranges": ranges, **sensor, "T_base_laser": scan.T_base_laser.as_array().tolist()}


def as_npz(scan: LaserScan, **changed: object) -> bytes:
    file = io.BytesIO()
    arrays = {name: getattr(scan, name) for name in NAMES} | {"ranges": scan.ranges}
    np.savez(file, **arrays | {"T_base_laser": scan.T_base_laser.as_array()} | changed)
    return file.getvalue()


def without_time(answer: dict) -> dict:
    return {key: value for key, value in answer.items() if key != "elapsed_s"}


def test_the_answer_is_that_of_the_library(api, site, scan):
    expected = site.store.snapshot.map.matcher.locate(scan).to_dict()
    answer = api.post("/v1/locate", json=as_json(scan)).json()
    assert answer["verdict"] == "UNIQUE"
    assert set(answer) == set(expected)
    np.testing.assert_allclose(answer["pose"], expected["pose"], atol=1e-6)
    sent = api.post("/v1/locate", content=as_npz(scan), headers=NPZ).json()
    assert without_time(sent) == without_time(expected)
    assert site.store.snapshot.pose is not None  # and the robot is where it was
    assert site.given == []


def test_the_map_may_be_named(api, scan):
    body = as_json(scan)
    assert api.post("/v1/locate", json=body | {"map": "house"}).status_code == 200
    assert api.post("/v1/locate?map=house", json=body).status_code == 200
    for answer in (
        api.post("/v1/locate", json=body | {"map": "cellar"}),
        api.post("/v1/locate?map=cellar", json=body),
        api.post("/v1/locate?map=cellar", content=as_npz(scan), headers=NPZ),
    ):
        assert answer.status_code == 404
        assert "house" in answer.json()["detail"]


def test_a_scan_without_returns_is_no_match(api, scan):
    answer = api.post("/v1/locate", json=as_json(scan) | {"ranges": [None] * 90})
    assert answer.status_code == 200
    assert (answer.json()["verdict"], answer.json()["pose"]) == ("NO_MATCH", None)


@pytest.mark.parametrize(
    "wrong",
    [
        {"ranges": []},
        {"ranges": None},
        {"ranges": "1,2"},
        {"ranges": [[1.0]]},
        {"ranges": [1.0, "2"]},
        {"ranges": [1.0, True]},
        {"ranges": [1.0] * 100_001},
        {"angle_increment": 0.0},
        {"angle_increment": 1.0},
        {"angle_min": "0"},
        {"range_min": -1.0},
        {"range_max": 0.05},
        {"range_max": None},
        {"T_base_laser": [1, 2]},
        {"T_base_laser": [1, 2, None]},
        {"T_base_laser": {"x": 1}},
        {"map": 7},
        {"T_base_lazer": [0, 0, 0]},
    ],
)
def test_a_malformed_scan_is_refused_in_one_sentence(api, scan, wrong):
    answer = api.post("/v1/locate", json=as_json(scan) | wrong)
    assert answer.status_code == 422, answer.text
    assert len(answer.json()["detail"]) < 500


def test_several_scans_with_odometry_and_a_prior_are_located_together(api, site, scan):
    x, y, _ = site.store.snapshot.pose
    second = as_json(scan) | {"stamp": 0.1, "sensor": "rear", "T_base_laser": [0.0, 0.0, 0.0]}
    body = {
        "scans": [as_json(scan) | {"sensor": "front"}, second],
        "T_odom_base": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        "prior": {"near": [[x, y, 0.0]], "radius": 3.0},
        "map": "house",
    }
    answer = api.post("/v1/locate", json=body).json()
    assert answer["verdict"] == "UNIQUE"
    assert answer["probability_without_prior"] > 0.9
    np.testing.assert_allclose(answer["pose"][:2], [x, y], atol=0.1)
    assert api.post("/v1/locate", json=body | {"map": "cellar"}).status_code == 404


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"scans": []}, "scans"),
        ({"scans": {}}, "scans"),
        ({"T_odom_base": []}, "one pose for each scan"),
        ({"T_odom_base": [[9.0, 0.0, 0.0]]}, None),
        ({"prior": {"near": [[1e5, 0.0, 0.0]]}}, "outside"),
        ({"prior": {"near": [[0.0, 0.0]]}}, "near"),
        ({"prior": {"radius": -1.0}}, "radius"),
        ({"prior": {"region": [[0.0, 0.0], [1.0, 1.0]]}}, "three corners"),
        ({"prior": {"zone": "hall"}}, "zone"),
        ({"prior": {"fix": {"pose": [1, 1, 0], "covariance": [[-1, 0, 0]] * 3}}}, "covariance"),
        ({"scan": []}, "scan"),
    ],
)
def test_a_malformed_query_is_refused_in_one_sentence(api, scan, wrong, words):
    answer = api.post("/v1/locate", json={"scans": [as_json(scan)]} | wrong)
    if words is None:
        assert answer.status_code == 200  # the frame of the odometry does not matter
        return
    assert answer.status_code == 422, answer.text
    assert words in answer.json()["detail"]


@pytest.mark.parametrize("missing", ["ranges", *NAMES])
def test_each_field_is_required(api, scan, missing):
    body = as_json(scan)
    del body[missing]
    assert missing in api.post("/v1/locate", json=body).json()["detail"]


def zipped(name: str, content: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, content)
    return file.getvalue()


def test_hostile_archives_are_refused(api, scan):
    pickled = io.BytesIO()
    np.savez(pickled, ranges=np.array([{"a": 1}], object), allow_pickle=True)
    header = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': (9"
    bomb = header + b"0" * 40 + b",), }"
    for body in (
        b"",
        b"PK",
        as_npz(scan)[:-30],
        pickled.getvalue(),
        zipped("ranges.npy", bytes(50_000_000)),
        zipped("ranges.npy", bomb),
        as_npz(scan, ranges=np.zeros((2, 90))),
        as_npz(scan, ranges=np.zeros(3_000_000, np.float64)[:0]),
        as_npz(scan, range_max=np.nan),
        as_npz(scan, T_base_laser=np.full(3, np.inf)),
    ):
        answer = api.post("/v1/locate", content=body, headers=NPZ)
        assert answer.status_code == 422, (answer.status_code, body[:20])
        assert answer.headers["content-type"] == "application/problem+json"


def test_a_zip_bomb_is_refused_before_it_is_unpacked(api):
    file = io.BytesIO()
    np.savez_compressed(file, ranges=np.zeros(1_000_000))  # 8 MB in 8 kB
    answer = api.post("/v1/locate", content=file.getvalue(), headers=NPZ)
    assert answer.status_code == 422
    assert "bytes" in answer.json()["detail"]


numbers = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=3)
)
anything = st.recursive(numbers, lambda inner: st.lists(inner, max_size=4), max_leaves=8)
bodies = st.dictionaries(st.sampled_from(["ranges", *NAMES, "T_base_laser", "map"]), anything)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(bodies, st.booleans())
def test_any_body_is_refused_or_answered(api, scan, body, completed):
    body = as_json(scan) | body if completed else body
    content = json.dumps(body).replace("Infinity", "1e999")
    answer = api.post("/v1/locate", content=content, headers=JSON)
    assert answer.status_code in {200, 404, 422, 429}, answer.text


def test_a_few_requests_wait_and_the_rest_get_503(api, site, scan, monkeypatch):
    begun, go = threading.Event(), threading.Event()
    matcher = site.store.snapshot.map.matcher
    right = type(matcher).locate

    def slow(self, scans, odometry, prior):
        begun.set()
        assert go.wait(240.0)
        return right(self, scans, odometry, prior)

    monkeypatch.setattr(type(matcher), "locate", slow)
    with concurrent.futures.ThreadPoolExecutor(10) as pool:
        first = pool.submit(api.post, "/v1/locate", json=as_json(scan))
        assert begun.wait(240.0)
        others = [pool.submit(api.post, "/v1/locate", json=as_json(scan)) for _ in range(9)]
        early = until(
            lambda: len(done := [f for f in others if f.done()]) >= 9 - MOST_WAITING and done
        )
        for future in early:
            assert future.result().status_code == 503
            assert future.result().headers["retry-after"] == "1"
        assert api.get("/v1/status").status_code == 200  # other requests do not wait
        go.set()
        statuses = [future.result().status_code for future in [first, *others]]
    assert statuses.count(200) == 1 + MOST_WAITING


def test_many_poses_of_a_house_are_found_through_the_api(api, site):
    grid = site.store.snapshot.map.grid
    (lidar,) = next(iter(SENSORS.values())).lidars
    rng = np.random.default_rng(0)
    for pose in random_free_poses(grid, rng, 5, 0.5):
        scan = lidar.scan(grid, pose, rng)
        answer = api.post("/v1/locate", json=as_json(scan)).json()
        assert answer["verdict"] in {"UNIQUE", "AMBIGUOUS"}
        if answer["verdict"] == "UNIQUE":
            assert np.hypot(*np.subtract(answer["pose"][:2], [pose.x, pose.y])) < 0.2
