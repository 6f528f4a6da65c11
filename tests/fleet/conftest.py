"""A running fleet service: real processes, real HTTP."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))  # site_lab, required

from fleet_lab import FleetServer
from site_lab import ROOMS, draw, save_rooms

from firstfix.cli.app import run
from firstfix.io.maps.map_server import save_map


@pytest.fixture(scope="session")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a site of three rooms, a copy of one, and a broken map."""
    folder = save_rooms(tmp_path_factory.mktemp("fleet"))
    save_map(draw(ROOMS["ground"]), folder / "copy.yaml")
    save_map(draw(ROOMS["first"]), folder / "broken.yaml")
    (folder / "broken.pgm").write_bytes(b"P5 9 9 255 too short")
    return folder


@pytest.fixture(scope="module")
def serve(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., FleetServer]]:
    """Give a function that starts a service; it is stopped after the module."""
    started: list[FleetServer] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FIRSTFIX_CACHE_DIR", str(tmp_path_factory.getbasetemp() / "fleet-cache"))

        def start(*arguments: str | Path) -> FleetServer:
            started.append(FleetServer(*arguments))
            return started[-1]

        yield start
    for server in started:
        if server.process.poll() is None:
            server.stop()


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str]]:
    """Run a command line in this process; give its status and what it wrote to stderr."""

    def call(*arguments: object) -> tuple[int, str]:
        status = run([str(argument) for argument in arguments])
        return status, capsys.readouterr().err

    return call


@pytest.fixture
def free_port() -> int:
    """Give a port that nothing listens on."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return int(listening.getsockname()[1])
