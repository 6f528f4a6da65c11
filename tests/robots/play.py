"""A simulated robot that reports to a transport in real time, as a real one would."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from recorder import point_cloud

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import Make, laser_scan, transforms
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.rigs import Rig

ODOM, BASE, LASER = "odom", "base_footprint", "laser"
# Topic and frame of each sensor: of the only one, or of the script `sensors`.
TOPICS = {
    "": ("scan", LASER),
    "sensor 1": ("front/scan", "front"),
    "sensor 2": ("rear/scan", "rear"),
    "sensor 3": ("points", "lidar"),
}
POINTS_Z_M = 0.5
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


def places(make: Make, rig: Rig) -> Any:
    """Return the fixed transforms of all sensors in one message."""
    frames = [frame for _, frame in TOPICS.values()]
    frames = frames[:1] if len(rig.lidars) == 1 else frames[1:]
    parts = [
        transforms(make, 0.0, BASE, frame, lidar.T_base_laser).transforms[0]
        for frame, lidar in zip(frames, rig.lidars, strict=True)
    ]
    return make("tf2_msgs/TFMessage", transforms=parts)


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
        topic, frame = TOPICS[event.sensor]
        head = transforms(make, stamp, frame, "", SE2.identity()).transforms[0].header
        if topic == "points":
            xy = event.points() - event.T_base_laser.as_array()[:2]  # of a sensor without yaw
            points = np.column_stack([xy, np.full(len(xy), POINTS_Z_M)])
            publish(topic, point_cloud(make, head, points))
        else:
            message = laser_scan(make, frame, event)
            message.header = head
            publish(topic, message)
