"""The HTTP API over real connections: answers and refusals."""

from __future__ import annotations

import gzip
import io
import socket
from collections.abc import Iterator
from urllib.parse import urlsplit

import httpx
import msgspec
import pytest
from live_lab import Site, drive, fed
from PIL import Image

from firstfix.localizer.inputs import PoseHint, Reset
from firstfix.web.access_control import AccessPolicy
from firstfix.web.messages import Map
from firstfix.web.request_body import MOST_BYTES

JSON = {"content-type": "application/json"}


@pytest.fixture(scope="module")
def site() -> Iterator[Site]:
    begun = drive("house")
    begun.step(22)
    with fed(store=begun.store) as site:
        yield site


@pytest.fixture
def api(site: Site) -> Iterator[httpx.Client]:
    site.given.clear()
    with httpx.Client(base_url=site.url, timeout=240.0) as client:
        yield client


def detail(answer: httpx.Response, status: int) -> str:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert (problem["type"], problem["status"]) == ("about:blank", status)
    assert "Traceback" not in answer.text
    return problem["detail"]


def test_the_page_and_its_files(api):
    page = api.get("/")
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert page.headers["cache-control"] == "no-cache"
    assert api.get("/static/index.html").text == page.text
    again = api.get("/", headers={"if-none-match": page.headers["etag"]})
    assert again.status_code in {200, 304}


def test_the_status_is_that_of_the_snapshot(api, site):
    status = api.get("/v1/status").json()
    view = site.store.snapshot
    assert (status["type"], status["state"], status["stamp"]) == ("state", "LOCALIZED", view.stamp)
    assert status["pose"] == [view.pose.x, view.pose.y, view.pose.yaw]
    assert status["viewers"] == 0


def test_the_map(api, site):
    described = msgspec.json.encode(Map.of(site.store.snapshot.map))
    assert api.get("/v1/map").content == described


def test_the_picture_of_the_map(api, site):
    announced = api.get("/v1/map").json()["image"]
    answer = api.get(announced["url"])
    assert answer.headers["content-type"] == "image/png"
    assert Image.open(io.BytesIO(answer.content)).size == (announced["width"], announced["height"])
    again = api.get(announced["url"], headers={"if-none-match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    small = api.get("/v1/map.png?max=100", headers={"if-none-match": answer.headers["etag"]})
    assert small.status_code == 200
    assert max(Image.open(io.BytesIO(small.content)).size) <= 100


@pytest.mark.parametrize("most", ["0", "63", "-5", "1e3", "x", "", "９９", "123456", "nan"])
def test_a_wrong_image_size_is_refused(api, most):
    assert "max" in detail(api.get("/v1/map.png", params={"max": most}), 422)


def test_a_larger_image_size_is_limited(api):
    assert api.get("/v1/map.png?max=99999").content == api.get("/v1/map.png").content


def test_a_pose_becomes_a_hint(api, site):
    answer = api.post("/v1/pose", json={"x": 1, "y": 2.5, "yaw": -1})
    assert answer.status_code == 202
    (hint,) = site.given
    assert isinstance(hint, PoseHint)
    assert hint.T_map_base.as_array().tolist() == [1.0, 2.5, -1.0]


def test_relocalize(api, site):
    assert api.post("/v1/relocalize").status_code == 202
    assert isinstance(site.given[0], Reset)


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 400),
        (b"{", 400),
        (b"\xff\xfe", 400),
        (b'{"x": NaN, "y": 0, "yaw": 0}', 400),
        (b"[" * 5000, 422),
        (b'{"spare": ' + b"[" * 5000, 400),
        (b"[]", 422),
        (b"null", 422),
        (b'{"x": 1, "y": 2}', 422),
        (b'{"x": "1", "y": 2, "yaw": 3}', 422),
        (b'{"x": 1e999, "y": 2, "yaw": 3}', 422),
        (b'{"x": true, "y": 2, "yaw": 3}', 422),
        (b'{"x": ' + b"9" * 10_000 + b', "y": 2, "yaw": 3}', 422),
        (b" " * 20_000, 413),
    ],
)
def test_a_malformed_pose_is_refused(api, site, body, status):
    assert detail(api.post("/v1/pose", content=body, headers=JSON), status)
    assert site.given == []


@pytest.mark.parametrize(
    "kind", ["", "text/plain", "application/x-www-form-urlencoded", "multipart/form-data", "json"]
)
def test_other_media_types_are_refused(api, kind):
    # A form of another site could send these without being asked whether it may.
    content = b'{"x": 1, "y": 2, "yaw": 3}'
    answer = api.post("/v1/pose", content=content, headers={"content-type": kind})
    assert "application/json" in detail(answer, 415)
    assert answer.headers["accept"] == "application/json"


def test_compressed_bodies_are_refused(api):
    bomb = gzip.compress(b" " * 10_000_000)
    answer = api.post("/v1/locate", content=bomb, headers={**JSON, "content-encoding": "gzip"})
    assert "uncompressed" in detail(answer, 415)


def response_to(site: Site, request: bytes) -> bytes:
    """Send the beginning of a request, and return the response to it."""
    address = urlsplit(site.url)
    with socket.create_connection((address.hostname, address.port), 30) as client:
        client.sendall(b"POST /v1/pose HTTP/1.1\r\nHost: localhost\r\n" + request)
        return client.recv(1000)


def test_bodies_announced_as_too_long_are_refused(site):
    announced = b"Content-Type: application/json\r\nContent-Length: %d\r\n\r\n"
    assert b"413" in response_to(site, announced % (MOST_BYTES + 1))
    assert b"413" in response_to(site, announced % 10**19)
    assert b"400" in response_to(site, b"Content-Length: -5\r\n\r\n")


def test_bodies_that_become_too_long_are_refused(site):
    def endless() -> Iterator[bytes]:
        for _ in range(2 * MOST_BYTES // 65536):
            yield b" " * 65536

    try:
        answer = httpx.post(site.url + "v1/locate", content=endless(), headers=JSON, timeout=240.0)
    except (httpx.WriteError, httpx.ReadError):
        return  # the server closed the connection before the body was sent
    assert detail(answer, 413)


def test_slow_bodies_are_refused(site, monkeypatch):
    monkeypatch.setattr("firstfix.web.request_body.TIMEOUT_S", 0.2)
    kind = b"Content-Type: application/json\r\nContent-Length: 30\r\n\r\n"
    assert b"408" in response_to(site, kind + b'{"x": ')


def test_incomplete_bodies_do_no_harm(site):
    address = urlsplit(site.url)
    with socket.create_connection((address.hostname, address.port), 30) as broken:
        broken.sendall(
            b"POST /v1/pose HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            b'Content-Length: 30\r\n\r\n{"x": '
        )
    assert httpx.get(site.url + "v1/status").status_code == 200


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("POST", "/v1/status", "GET, HEAD"),
        ("DELETE", "/v1/map", "GET, HEAD"),
        ("GET", "/v1/pose", "POST"),
        ("GET", "/v1/locate", "POST"),
        ("OPTIONS", "/v1/pose", "POST"),
        ("PUT", "/", "GET, HEAD"),
    ],
)
def test_other_methods_are_refused(api, method, path, allowed):
    answer = api.request(method, path)
    detail(answer, 405)
    assert sorted(answer.headers["allow"].split(", ")) == allowed.split(", ")


@pytest.mark.parametrize("path", ["/", "/v1/status", "/v1/map", "/v1/map.png", "/openapi.json"])
def test_head_has_the_headers_of_get(api, path):
    head, answer = api.head(path), api.get(path)
    assert (head.status_code, head.content) == (200, b"")
    for name in ("content-type", "content-length"):
        assert head.headers[name] == answer.headers[name]


@pytest.mark.parametrize("path", ["/v1", "/v1/", "/v2/status", "/favicon.ico", "/docs", "/v1/live"])
def test_unknown_paths_are_not_found(api, path):
    assert detail(api.get(path), 404)


def test_requests_before_the_first_map_get_503():
    with fed() as site, httpx.Client(base_url=site.url) as api:
        assert api.get("/v1/status").json()["state"] == "NO_MAP"
        for method, path in (
            ("GET", "/v1/map"),
            ("GET", "/v1/map.png"),
            ("POST", "/v1/relocalize"),
            ("POST", "/v1/locate"),
        ):
            answer = api.request(method, path)
            assert "map" in detail(answer, 503)
            assert answer.headers["retry-after"]


def test_a_read_only_server_refuses_commands(site):
    with fed(AccessPolicy(may_steer=False), site.store) as watched:
        with httpx.Client(base_url=watched.url) as api:
            pose = {"x": 1, "y": 2, "yaw": 3}
            assert "read-only" in detail(api.post("/v1/pose", json=pose), 403)
            assert "read-only" in detail(api.post("/v1/relocalize"), 403)
            assert api.get("/v1/status").status_code == 200
        assert watched.given == []


def test_an_internal_error_discloses_nothing(site, monkeypatch, caplog):
    def broken(*_: object) -> None:
        raise RuntimeError("the password is hunter2")

    monkeypatch.setattr("firstfix.web.api.Status.of", broken)
    answer = httpx.get(site.url + "v1/status")
    assert "See its log" in detail(answer, 500)
    assert "hunter2" not in answer.text
    assert answer.headers["x-content-type-options"] == "nosniff"
