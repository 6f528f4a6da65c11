"""Access control: host, origin, token, and security headers of every response."""

from __future__ import annotations

import http.client
import socket
from urllib.parse import urlsplit

import httpx
import pytest
from live_lab import Site, fed
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from firstfix.web.access_control import HARDENING, AccessPolicy, is_loopback
from firstfix.web.server import listen, url_of

TOKEN = "open-sesame"  # noqa: S105 - of a test
BEARER = {"authorization": f"Bearer {TOKEN}"}
POSE = {"x": 0.0, "y": 0.0, "yaw": 0.0}


@pytest.fixture(scope="module")
def site():
    with fed() as site:
        yield site


@pytest.fixture
def locked():
    # One for each test: wrong tokens are rate-limited.
    with fed(AccessPolicy(TOKEN)) as site:
        yield site


def raw(site: Site, method: str, path: str, headers: dict[str, str]) -> tuple[int, dict, bytes]:
    """Request a path as it is written; HTTP libraries would normalize it."""
    address = urlsplit(site.url)
    connection = http.client.HTTPConnection(address.hostname, address.port, timeout=240)
    connection.putrequest(method, path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, dict(answer.getheaders()), body


def refused(answer: httpx.Response, status: int) -> dict:
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert set(problem) == {"type", "title", "status", "detail"}
    assert problem["status"] == status
    return problem


@pytest.mark.parametrize("path", ["", "v1/status", "nothing", "static/nothing", "openapi.json"])
def test_every_response_has_security_headers(site: Site, path: str):
    answer = httpx.get(site.url + path)
    for name, value in HARDENING.items():
        assert answer.headers[name] == value
    assert "unsafe" not in answer.headers["content-security-policy"]
    assert "server" not in answer.headers


@pytest.mark.parametrize(
    "host", ["localhost", "localhost:1", "127.0.0.1:80", "[::1]:9", "127.1.2.3"]
)
def test_requests_to_names_of_this_machine_are_answered(site: Site, host: str):
    assert raw(site, "GET", "/v1/status", {"Host": host})[0] == 200


@pytest.mark.parametrize(
    "host",
    ["evil.example", "localhost.evil.example", "10.0.0.1", "", "[::1", "a@127.0.0.1.b", "x:y"],
)
def test_requests_to_other_names_are_refused(site: Site, host: str):
    status, headers, body = raw(site, "GET", "/v1/status", {"Host": host})
    assert status == 421
    assert b"127.0.0.1" in body
    assert headers["content-type"] == "application/problem+json"


def test_requests_to_other_names_need_the_token_on_a_public_address():
    with fed(AccessPolicy(TOKEN, loopback_only=False)) as site:
        host = {"Host": "robot.example"}
        assert raw(site, "GET", "/v1/status", host)[0] == 401
        assert raw(site, "GET", "/v1/status", host | {"Authorization": f"Bearer {TOKEN}"})[0] == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://localhost:1", "http://["]
)
def test_other_web_sites_can_neither_post_nor_watch(site: Site, origin: str):
    refused(httpx.post(site.url + "v1/relocalize", headers={"origin": origin}), 403)
    with pytest.raises(InvalidStatus) as refusal:
        connect(site.live, additional_headers={"Origin": origin}).__enter__()
    assert refusal.value.response.status_code == 403


def test_the_own_page_and_programs_can(site: Site):
    own = site.url[:-1]
    # There is no map yet, but only authorized clients may learn that.
    assert httpx.post(site.url + "v1/relocalize", headers={"origin": own}).status_code == 503
    assert httpx.post(site.url + "v1/relocalize").status_code == 503
    with connect(site.live, additional_headers={"Origin": own}) as viewer:
        assert viewer.recv(30)


def test_everything_but_the_page_needs_the_token(locked: Site):
    for path in ("v1/status", "v1/map.png", "openapi.json", "v1/nothing", "anything"):
        answer = httpx.get(locked.url + path)
        assert refused(answer, 401)["detail"] == "A token is needed."
        assert answer.headers["www-authenticate"] == "Bearer"
    assert httpx.get(locked.url).status_code == 200
    assert httpx.get(locked.url + "static/index.html").status_code == 200
    assert httpx.get(locked.url + "v1/status", headers=BEARER).status_code == 200


@pytest.mark.parametrize(
    "header",
    [
        "",
        "Bearer",
        "Bearer open-sesam",
        "Bearer open-sesame2",
        f"Basic {TOKEN}",
        "Bearer \xe9",
    ],
)
def test_a_wrong_token_is_refused(locked: Site, header: str):
    headers = {"authorization": header.encode("latin-1")}
    refused(httpx.get(locked.url + "v1/status", headers=headers), 401)
    refused(httpx.get(f"{locked.url}v1/status?token={TOKEN}"), 401)


def test_guesses_are_rate_limited():
    with fed(AccessPolicy(TOKEN)) as site, httpx.Client() as client:
        answers = [client.get(site.url + "v1/status").status_code for _ in range(30)]
        assert answers[0] == 401
        assert 429 in answers
        answer = client.get(site.url + "v1/status", headers=BEARER)
        if answer.status_code == 429:
            assert answer.headers["retry-after"] == "1"


@pytest.mark.parametrize(
    "path",
    [
        "/static/../server.py",
        "/static/..%2fserver.py",
        "/static/%2e%2e/server.py",
        "/static/..\\server.py",
        "/static/....//server.py",
        "/static//etc/passwd",
        "/static/%00",
        "/static/index.html%00.js",
        "/static/" + "../" * 20 + "etc/passwd",
        "/static/" + "a" * 5000,
        "/static",
        "//v1/status",
        "/v1/../v1/status/",
    ],
)
def test_files_outside_of_static_are_not_served(site: Site, path: str):
    status, headers, body = raw(site, "GET", path, {})
    assert status in {400, 404, 307}
    assert b"root:" not in body
    assert b"import" not in body
    if status != 307:
        assert headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "::1", "127.9.9.9"])
def test_loopback(host: str):
    assert is_loopback(host)


@pytest.mark.parametrize("host", ["", "192.0.2.1", "::", "192.168.0.1", "robot", "127.0.0.1.evil"])
def test_not_loopback(host: str):
    assert not is_loopback(host)


@pytest.mark.parametrize(
    ("host", "url"), [("127.0.0.1", "http://127.0.0.1:"), ("::1", "http://[::1]:")]
)
def test_the_url_of_an_address(host: str, url: str):
    with listen(host, 0) as listening:
        assert url_of(listening) == f"{url}{listening.getsockname()[1]}/"


def test_the_url_of_all_addresses_names_the_machine():
    class Everywhere:
        def getsockname(self) -> tuple[str, int]:
            return ".".join("0" * 4), 8642

    assert url_of(Everywhere()) == f"http://{socket.gethostname()}:8642/"


def test_a_token_may_have_any_characters():
    assert AccessPolicy("naïve-☃-token").accepts("naïve-☃-token")
    assert not AccessPolicy("naïve-☃-token").accepts("naive-☃-token")
    assert not AccessPolicy("token").accepts("token\udcff")
