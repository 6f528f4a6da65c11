"""``firstfix serve`` with a simulated robot, a real broker and a fleet control."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest
from live_lab import until

pytestmark = pytest.mark.slow

SCRIPT = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from firstfix.cli.app import main; main()"
)


def test_a_simulated_robot_in_a_fleet(broker: Any, listen: Callable[..., Any]):
    fleet = listen(broker, "vda5050/v3/ACME/0001")
    names = ["--manufacturer", "ACME", "--serial-number", "0001", "--map-id", "house@2"]
    options = ["--port", "0", "--vda5050", broker.url, *names, "--vda5050-version", "3.0.0"]
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, "serve", "house", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        found = until(
            lambda: [s for s in fleet.of("state") if s["mobileRobotPosition"]["localized"]],
            "the robot to be found",
        )[0]
        position = found["mobileRobotPosition"]
        assert found["maps"] == [{"mapId": "house", "mapVersion": "2", "mapStatus": "ENABLED"}]
        where = {name: position[name] for name in ("x", "y", "theta", "mapId")}
        fleet.act("initializePosition", "a", **where, lastNodeId="n1")
        done = until(
            lambda: [
                action
                for state in fleet.of("state")
                for action in state["instantActionStates"]
                if action["actionStatus"] in ("FINISHED", "FAILED")
            ],
            "the end of the action",
        )[0]
        assert done["actionStatus"] == "FINISHED", done
        until(lambda: fleet.of("visualization"), "a pose")
    finally:
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=240.0)
    assert process.returncode == 130  # interrupted
    assert err == f"VDA 5050: connected to {broker.url}\n"
    until(lambda: fleet.of("connection")[-1]["connectionState"] == "OFFLINE", "the end")
