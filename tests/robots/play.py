"""A simulated robot that reports to a transport in real time, as a real one would."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import Make, laser_scan, transforms
from firstfix.lab.scenarios.scenario import Scenario, run

ODOM, BASE, LASER = "odom", "base_footprint", "laser"
KOBUKI = {
    SignalKind.CLIFF: ("events/cliff", "kobuki/CliffEvent", {"sensor": 1, "bottom": 0}),
    SignalKind.WHEEL_DROP: ("events/wheel_drop", "kobuki/WheelDropEvent", {"wheel": 0}),
    SignalKind.BUMPER: ("events/bumper", "kobuki/BumperEvent", {"bumper": 1}),
}

Publish = Callable[[str, Any], None]


def play(
    scenario: Scenario, grid: OccupancyGrid, seed: int, make: Make, publish: Publish, truth: Path
) -> None:
    """Play a scenario, stamped by the wall clock, and write the true pose of each scan.

    A line of the file is ``[stamp, x, y, yaw]``. A robot that is to report later than now begins
    when its scenario is ready: kernels of the simulation may have to be compiled first.
    """
    next(run(scenario, grid, seed))
    began = time.time()
    with truth.open("a", encoding="utf-8", buffering=1) as lines:
        for moment in run(scenario, grid, seed):
            for event in moment.events:
                time.sleep(max(0.0, began + event.stamp - time.time()))
                report(event, began, make, publish)
            pose = moment.T_map_base.as_array().tolist()
            lines.write(json.dumps([began + moment.stamp, *pose]) + "\n")


def report(
    event: LaserScan | Odometry | Signal, began: float, make: Make, publish: Publish
) -> None:
    """Publish one event."""
    stamp = began + event.stamp
    if isinstance(event, Odometry):
        publish("/tf", transforms(make, stamp, ODOM, BASE, event.T_odom_base))
    elif isinstance(event, Signal):
        topic, kind, fields = KOBUKI[event.kind]
        publish(topic, make(kind, **fields, state=int(event.active)))
    else:
        message = laser_scan(make, LASER, event)
        message.header = transforms(make, stamp, LASER, "", SE2.identity()).transforms[0].header
        publish("scan", message)
