"""Time the node of ROS 1 on a real master: to initialpose at first, to amcl_pose for long.

The node is a process of its own, as users start it, with its kernels and its map ready. First, a
robot is localized at many random places of the map: after the service that restarts the search, one
scan is sent, and the answer is timed. Then a robot drives in circles, as fast as a Kobuki; odometry
and scan of one time are sent together. A time is from before a scan is sent to after the answer has
arrived. Prints one line per measurement.

    python benchmarks/ros1_latency.py ../shared/maps/navigation_tutorials__willow-full-0.05.yaml \
        [--seconds 600] [--places 40] [--beams 720] [--rate 40]

Needs the Python that has rospy, and roscore in the PATH.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import rospy

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "robots"))

from ros1_lab import Lab, Program

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import load_map
from firstfix.io.ros_messages.incoming import to_seconds
from firstfix.io.ros_messages.outgoing import laser_scan, occupancy_grid, transforms
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import WORLDS, random_free_pose
from firstfix.ros.ros1.types import Empty, make, message_class

POSE = "geometry_msgs/PoseWithCovarianceStamped"
SPEED_M_S, RADIUS_M, CLEARANCE_M = 0.5, 1.0, 1.5
ODOM, BASE, LASER = "odom", "base_footprint", "laser"
# At some places, several fit: then no pose comes.
PATIENCE_S = 1.0
WARM_S = 10.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map", type=Path, nargs="?", help="map's YAML; without it, a drawn office")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--places", type=int, default=40)
    parser.add_argument("--beams", type=int, default=720)
    parser.add_argument("--rate", type=float, default=40.0, help="scans a second")
    options = parser.parse_args()
    grid = load_map(options.map) if options.map else WORLDS["office"]()
    with tempfile.TemporaryDirectory() as folder:
        lab = Lab(Path(folder))
        lab.master.start()
        os.environ |= lab.master.environment
        try:
            robot = Robot(grid, options.beams)
            print(f"{grid.width} x {grid.height} cells, {options.beams} beams, {options.rate:g} Hz")
            find(lab, robot, options.places)
            drive(lab, robot, options.rate, options.seconds)
        finally:
            lab.end()


class Robot:
    """Publishes, and records the time of arrival and the stamp of each pose."""

    def __init__(self, grid: OccupancyGrid, beams: int) -> None:
        rospy.init_node("robot", disable_signals=True)
        self.grid = grid
        self.rng = np.random.default_rng(0)
        self._lidar = Lidar(beams=beams)
        self._tf = _publisher("/tf", "tf2_msgs/TFMessage")
        self._scan = _publisher("scan", "sensor_msgs/LaserScan")
        self._fixed = _publisher("/tf_static", "tf2_msgs/TFMessage", latch=True)
        self._map = _publisher("map", "nav_msgs/OccupancyGrid", latch=True)
        self._fixed.publish(transforms(make, 0.0, BASE, LASER, SE2.identity()))
        self._map.publish(occupancy_grid(make, 0.0, "map", grid))

    def look_from(self, T_map_base: SE2) -> Any:
        """Return a scan as a message, without a stamp."""
        scan = self._lidar.scan(self.grid, T_map_base, self.rng)
        return laser_scan(make, LASER, replace(scan, stamp=0.0))

    def report(self, T_odom_base: SE2, scan: Any) -> float:
        """Publish odometry and a scan of now; return their stamp."""
        now = transforms(make, time.time(), ODOM, BASE, T_odom_base)
        scan.header.stamp = now.transforms[0].header.stamp
        self._tf.publish(now)
        self._scan.publish(scan)
        return to_seconds(scan.header.stamp)


class Poses:
    """When the pose of each stamp arrived."""

    def __init__(self, topic: str) -> None:
        self.arrived: dict[float, float] = {}
        self._came = threading.Condition()
        rospy.Subscriber(topic, message_class(POSE), self._take, tcp_nodelay=True)

    def wait(self, stamp: float) -> float | None:
        """Return when the pose of a stamp arrives; None if it does not."""
        with self._came:
            self._came.wait_for(lambda: stamp in self.arrived, PATIENCE_S)
            return self.arrived.get(stamp)

    def _take(self, message: Any) -> None:
        now = time.time()
        with self._came:
            self.arrived[to_seconds(message.header.stamp)] = now
            self._came.notify()


def _publisher(topic: str, kind: str, *, latch: bool = False) -> rospy.Publisher:
    return rospy.Publisher(topic, message_class(kind), latch=latch, tcp_nodelay=True, queue_size=10)


def find(lab: Lab, robot: Robot, places: int) -> None:
    poses = Poses("initialpose")
    node = lab.node()
    node.wait_for_output("SEARCHING")
    forget = rospy.ServiceProxy("reinitialize_global_localization", Empty)
    taken, untold = [], 0
    for _ in range(places):
        scan = robot.look_from(random_free_pose(robot.grid, robot.rng, 0.3))
        forget()
        time.sleep(0.3)
        sent = time.time()
        arrived = poses.wait(robot.report(SE2.identity(), scan))
        if arrived is None:
            untold += 1
        else:
            taken.append(1e3 * (arrived - sent))
    node.end()
    first, *_ = taken
    print(
        f"first scan to initialpose  the very first {first:.0f} ms; median {np.median(taken):.0f}, "
        f"worst {max(taken):.0f} ms of {len(taken)} places; {untold} ambiguous"
    )


def drive(lab: Lab, robot: Robot, rate: float, seconds: float) -> None:
    centre = random_free_pose(robot.grid, robot.rng, CLEARANCE_M)
    count = round(math.tau * RADIUS_M / SPEED_M_S * rate)
    turns = [math.tau * i / count for i in range(count)]
    ring = [centre @ SE2(0.0, 0.0, a) @ SE2(RADIUS_M, 0.0, math.pi / 2) for a in turns]
    scans = [robot.look_from(pose) for pose in ring]

    poses = Poses("amcl_pose")
    node = lab.node("_mode:=full")
    node.wait_for_output("SEARCHING")
    meter = Meter(node)
    sent: dict[float, float] = {}
    began = time.time()
    for i in range(round((WARM_S + seconds) * rate)):
        time.sleep(max(0.0, began + i / rate - time.time()))
        before = time.time()
        sent[robot.report(ring[i % count], scans[i % count])] = before
        meter.read(before - began)
    time.sleep(1.0)
    node.end()

    counted = {stamp: at for stamp, at in sent.items() if at - began > WARM_S}
    late = [1e3 * (poses.arrived[s] - at) for s, at in counted.items() if s in poses.arrived]
    median, p99, worst = np.percentile(late, [50.0, 99.0, 100.0])
    third = len(late) // 3
    print(
        f"scan to amcl_pose          median {median:.1f}, p99 {p99:.1f}, worst {worst:.1f} ms; "
        f"{len(late)} of {len(counted)} scans in {seconds:.0f} s"
    )
    print(
        f"                           median of the first third {np.median(late[:third]):.1f}, "
        f"of the last {np.median(late[-third:]):.1f} ms"
    )
    meter.show()


class Meter:
    """Memory and processor time of the node."""

    def __init__(self, node: Program) -> None:
        self._node = node
        self._readings: list[tuple[float, float, float]] = []

    def read(self, seconds: float) -> None:
        """Read both, once a second."""
        if not self._readings or seconds - self._readings[-1][0] >= 1.0:
            self._readings.append((seconds, self._node.memory_mb, self._node.cpu_s))

    def show(self) -> None:
        """Print what became of them."""
        seconds, memory, cpu = np.array([r for r in self._readings if r[0] > WARM_S]).T
        first, last = memory[seconds < seconds[0] + 60.0], memory[seconds > seconds[-1] - 60.0]
        print(
            f"memory of the node         {np.mean(first):.1f} MB in the first minute, "
            f"{np.mean(last):.1f} MB in the last; most {memory.max():.1f} MB"
        )
        share = (cpu[-1] - cpu[0]) / (seconds[-1] - seconds[0])
        load = os.getloadavg()[0]
        print(f"processor of the node      {share:.0%} of a core; load of the machine {load:.1f}")


if __name__ == "__main__":
    main()
