"""``serve`` and the live ``demo`` as people start and end them."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))  # site_lab

from site_lab import save_rooms
from websockets.sync.client import connect

Files = tuple[Path, Path]
PATIENCE_S = 240.0  # in a fresh checkout kernels are compiled first
TOKEN = "open-sesame"  # noqa: S105 - of a test


@contextmanager
def running(*arguments: object, **environment: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start a command, and give it with the URL that it prints."""
    # What runs in the background inherits that SIGINT is ignored: undo that first.
    script = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from firstfix.cli.app import main; main()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script, *(str(argument) for argument in arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={"PATH": "/usr/bin", "HOME": str(Path.home()), **environment},
    )
    assert process.stdout is not None
    try:
        url = None
        while url is None and (line := process.stdout.readline()):
            url = re.search(r"http://\S+", line)
        yield process, url.group() if url else ""
    finally:
        process.kill()
        process.communicate()


def status(url: str, **headers: str) -> dict[str, Any]:
    return httpx.get(url + "v1/status", headers=headers, timeout=PATIENCE_S).json()


def wait_for(url: str, state: str) -> dict[str, Any]:
    end = time.monotonic() + PATIENCE_S
    while (answer := status(url))["state"] != state:
        assert time.monotonic() < end, answer
        time.sleep(0.1)
    return answer


@pytest.mark.slow
def test_a_simulated_robot_is_served_until_ctrl_c() -> None:
    with running("serve", "house", "--port", 0) as (process, url):
        answer = wait_for(url, "LOCALIZED")
        assert answer["truth"] is not None
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE_S)
        assert (process.returncode, out, err) == (130, "", "")


@pytest.mark.slow
def test_the_robot_of_the_demo_waits_for_the_first_viewer() -> None:
    with running("demo", "--world", "house", "--port", 0) as (process, url):
        wait_for(url, "SEARCHING")
        time.sleep(1.0)
        assert status(url)["stamp"] == 0.0
        with connect(url.replace("http", "ws") + "v1/live") as viewer:
            while json.loads(viewer.recv(PATIENCE_S))["type"] != "hello":
                pass
            wait_for(url, "LOCALIZED")
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE_S)


@pytest.mark.slow
def test_a_map_of_ones_own_is_served_read_only_with_a_token(unique: Files) -> None:
    arguments = ("serve", unique[0], "--port", 0, "--read-only")
    with running(*arguments, FIRSTFIX_TOKEN=TOKEN) as (process, url):
        page, _, fragment = url.partition("#")
        assert fragment == f"token={TOKEN}"
        assert status(page)["status"] == 401
        bearer = {"Authorization": f"Bearer {TOKEN}"}
        assert status(page, **bearer)["viewers"] == 0
        assert httpx.post(page + "v1/relocalize", headers=bearer).status_code == 403
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE_S)
        assert TOKEN not in out + err  # in no log


@pytest.mark.slow
def test_a_simulated_robot_in_a_site_is_served_with_the_name_of_its_map(tmp_path: Path) -> None:
    with running("serve", "--site", save_rooms(tmp_path), "--port", 0) as (_, url):
        wait_for(url, "LOCALIZED")
        assert httpx.get(url + "v1/map").json()["name"] == "first"


def test_a_port_that_is_taken(cli) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        cli("serve", "house", "--port", port).assert_one_sentence(f"{port}", "in use", "--port")
        ended = cli("demo", "--world", "house", "--port", port)
        assert ended.status == 2
        assert f"{port}" in ended.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("house", "--host", "192.0.2.1"), ("--token", "192.0.2.1")),
        (("house", "--host", "192.0.2.1", "--token", TOKEN), ("192.0.2.1",)),
        (("house", "--token", "short"), ("8 characters",)),
        (("house", "scan:=front"), ("scan:=front", "--robot")),
        ((), ("either a map or --site",)),
        (("house", "--site", "floors"), ("either a map or --site",)),
        (("--site", "atlantis"), ("no folder or file", "atlantis")),
        (("atlantis",), ("office, rooms", "atlantis")),
        (("nomap.yaml",), ("no such file: nomap.yaml",)),
    ],
)
def test_what_cannot_be_served(cli, arguments: tuple[str, ...], words: tuple[str, ...]) -> None:
    cli("serve", *arguments).assert_one_sentence(*words)


def test_a_map_that_is_not_there(cli) -> None:
    pytest.importorskip("cyclonedds")
    cli("serve", "no.yaml", "--robot", "dds").assert_one_sentence("no.yaml")


def test_arguments_of_ros_that_are_none(cli, unique: Files) -> None:
    pytest.importorskip("cyclonedds")
    for arguments in (("-x", "y"), ("-p",), ("-p", "mode"), ("--params-file", "no.yaml")):
        ended = cli("serve", unique[0], "--robot", "dds", "--port", 0, "--", *arguments)
        assert ended.status == 2
        assert ended.err.startswith("firstfix: expected ")


def test_options_that_are_none(cli) -> None:
    for arguments in (("--robot", "fish"), ("--port", "70000"), ("--prot", "1")):
        assert cli("serve", "house", *arguments).status == 2


def test_a_robot_whose_ros_is_not_here(cli, unique: Files, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    monkeypatch.delitem(sys.modules, "firstfix.ros.ros2.node", raising=False)
    cli("serve", unique[0], "--robot", "ros2").assert_one_sentence("rclpy", "setup.bash")


def test_a_picture_of_the_demo_needs_headless(cli) -> None:
    cli("demo", "--plot", "a.png").assert_one_sentence("--headless", "a.png")


def test_a_browser_is_opened_only_on_a_display(monkeypatch, capsys) -> None:
    from firstfix.cli.serve import announce
    from firstfix.web.access_control import AccessPolicy
    from firstfix.web.server import listen

    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with listen("127.0.0.1", 0) as listening:
        announce(listening, AccessPolicy())
        assert opened == []
        monkeypatch.setenv("DISPLAY", ":0")
        announce(listening, AccessPolicy())
        assert opened == []  # in a pipe
        monkeypatch.setattr("sys.stdout.isatty", lambda: True)
        announce(listening, AccessPolicy(TOKEN))
    (url,) = opened
    assert url.endswith(f"#token={TOKEN}")
    assert url in capsys.readouterr().out
