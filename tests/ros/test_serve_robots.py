"""``serve`` with robots on real networks: ROS 1 with its master, and DDS."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from live_lab import until

from firstfix.io.maps.map_server import save_map
from firstfix.lab.worlds.catalog import WORLDS

pytestmark = pytest.mark.slow

# In a fresh checkout kernels are compiled first.
PATIENCE_S = 240.0


@pytest.fixture
def office(tmp_path: Path) -> str:
    save_map(WORLDS["office"](), tmp_path / "office.yaml")
    return str(tmp_path / "office.yaml")


def command(office: str, robot: str, *arguments: str) -> list[str]:
    options = ["serve", office, "--robot", robot, "--port", "0"]
    return [sys.executable, "-m", "firstfix", *options, "--", *arguments]


def url_in(log: Callable[[], str]) -> str:
    found = until(lambda: re.search(r"http://[^\s#]+", log()), "the URL", PATIENCE_S)
    return found.group()


def localize_three_times(url: str) -> None:
    """Localize, then again after a hint and after a reset."""
    with httpx.Client(base_url=url, timeout=240.0) as api:

        def status() -> dict[str, Any]:
            return api.get("/v1/status").json()

        until(lambda: status()["state"] == "LOCALIZED", "the robot to be found", PATIENCE_S)
        assert api.get("/v1/map").json()["name"] == "office"
        first = status()
        assert first["truth"] is None
        assert first["particles"] > 0
        found_at = first["stamp"]
        x, y, yaw = first["pose"]
        assert api.post("/v1/pose", json={"x": x, "y": y, "yaw": yaw}).status_code == 202
        until(lambda: (s := status())["state"] == "LOCALIZED" and s["stamp"] > found_at)
        assert api.post("/v1/relocalize").status_code == 202
        until(lambda: (s := status())["state"] == "LOCALIZED" and s["stamp"] > found_at + 1.0)


def test_a_robot_of_ros_1(ros1: Any, office: str):
    ros1.robot("stand")
    node = ros1.start(*command(office, "ros1", "_mode:=full"))
    localize_three_times(url_in(lambda: node.output))
    node.end()
    assert node.wait() == 0
    assert "Traceback" not in node.output


def test_a_robot_of_dds(dds: Any, office: str):
    dds.robot("stand")
    node = dds._start(command(office, "dds", "-p", "mode:=full"), {})
    localize_three_times(url_in(lambda: node.log))
    assert node.end() == 0
    assert "Traceback" not in node.log
