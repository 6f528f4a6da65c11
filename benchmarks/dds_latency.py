"""Time the node on plain DDS: from first scan to initialpose, then from scan to amcl_pose for long.

A robot drives in circles, as fast as a Kobuki, with a sensor of 720 beams at 40 Hz. The node is a
process of its own, as users start it. Nothing leaves the machine: loopback only, and a domain of
its own. Latency is from before the scan is written to after the pose was read. Prints one line a
measurement; while it drives, one line a minute with the memory of the node.

    python benchmarks/dds_latency.py ../shared/cases/willow_a/map.yaml [--seconds 600] [--runs 5]
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from cyclonedds.domain import Domain, DomainParticipant

from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import load_map
from firstfix.io.ros_messages.incoming import to_seconds
from firstfix.io.ros_messages.outgoing import laser_scan, occupancy_grid, transforms
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import WORLDS, random_free_pose
from firstfix.ros.channels import (
    AMCL_POSE,
    INITIAL_POSE,
    TF,
    Channel,
    Delivery,
    Topic,
    subscribed_topics,
)
from firstfix.ros.dds.endpoints import EventThread, Receiver, Sender
from firstfix.ros.dds.types import decode, make
from firstfix.ros.names import Names
from firstfix.ros.node_config import NodeConfig

LOOPBACK = (
    "<General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
)
DOMAIN = 1 + os.getpid() % 100

SPEED_M_S, RADIUS_M, CLEARANCE_M = 0.5, 1.0, 1.5
ODOM, BASE, LASER = "odom", "base_footprint", "laser"
HEARD = subscribed_topics(NodeConfig())
CLOUD = Topic("particle_cloud", "nav2_msgs/ParticleCloud", Delivery.SENSOR)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map", type=Path, nargs="?", help="map's YAML; without it, a drawn office")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=40.0, help="scans a second")
    parser.add_argument("--beams", type=int, default=720)
    parser.add_argument("--runs", type=int, default=5, help="how often the robot is found anew")
    parser.add_argument("--cloud", action="store_true", help="subscribe to the particles")
    options = parser.parse_args()
    grid = load_map(options.map) if options.map else WORLDS["office"]()
    robot = Robot(grid, options.beams, options.rate)
    print(f"{grid.width} x {grid.height} cells, {options.beams} beams, {options.rate:g} Hz")
    find(robot, options.runs)
    drive(robot, options.seconds, options.cloud)


class Robot:
    """Scans on a circle, made beforehand, and what publishes them."""

    def __init__(self, grid: OccupancyGrid, beams: int, rate: float) -> None:
        lidar, rng = Lidar(beams=beams), np.random.default_rng(0)
        centre = random_free_pose(grid, rng, CLEARANCE_M)
        count = round(math.tau * RADIUS_M / SPEED_M_S * rate)
        ring = [math.tau * i / count for i in range(count)]
        self.poses = [centre @ SE2(0.0, 0.0, a) @ SE2(RADIUS_M, 0.0, math.pi / 2) for a in ring]
        self.scans = [lidar.scan(grid, pose, rng) for pose in self.poses]
        self.period_s = 1.0 / rate
        self._domain = Domain(DOMAIN, LOOPBACK)
        self.participant = DomainParticipant(DOMAIN)
        sent = (Channel.SCAN, Channel.TF, Channel.KIDNAPPED)
        self.senders = {channel: self._sender(HEARD[channel]) for channel in sent}
        self.fixed = [self._sender(HEARD[Channel.TF_STATIC]), self._sender(HEARD[Channel.MAP])]
        self.fixed[0].send(transforms(make, 0.0, BASE, LASER, SE2.identity()))
        self.fixed[1].send(occupancy_grid(make, 0.0, "map", grid))

    def report(self, index: int) -> float:
        """Publish odometry and scan of now; return their stamp."""
        stamp = round(time.time(), 6)
        index %= len(self.poses)
        tf = transforms(make, stamp, ODOM, BASE, self.poses[index])
        message = laser_scan(make, LASER, stamped(self.scans[index], stamp))
        self.senders[Channel.TF].send(tf)
        self.senders[Channel.SCAN].send(message)
        return stamp

    def kidnap(self) -> None:
        """Be lifted and put down where it was."""
        for value in (True, False):
            self.senders[Channel.KIDNAPPED].send(make("std_msgs/Bool", data=value))

    def _sender(self, topic: Topic) -> Sender:
        return Sender(self.participant, topic, dds_name(topic))


def stamped(scan: LaserScan, stamp: float) -> LaserScan:
    return replace(scan, stamp=stamp)


def dds_name(topic: Topic) -> str:
    return "rt" + Names().resolve(topic.name)


class Poses:
    """When the pose of each stamp arrived."""

    def __init__(self, robot: Robot, topic: Topic) -> None:
        self.arrived: dict[float, float] = {}
        self._receiver = Receiver(robot.participant, topic, dds_name(topic))
        self._kind = topic.type_name
        self._changed = threading.Event()
        self._thread = EventThread(robot.participant, [self._receiver.news], self._take, print)

    def wait(self) -> float:
        """Return when the next one arrives."""
        self._changed.clear()
        if not self._changed.wait(60.0):
            sys.exit("no pose came")
        return time.time()

    def close(self) -> None:
        """Listen no more."""
        self._thread.close()

    def _take(self) -> None:
        now = time.time()
        for data in self._receiver.take():
            message: Any = decode(self._kind, data)
            self.arrived[round(to_seconds(message.header.stamp), 6)] = now
        self._changed.set()


class NodeProcess:
    """The node."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "firstfix", "dds", *arguments]
        here = os.environ | {"CYCLONEDDS_URI": LOOPBACK, "ROS_DOMAIN_ID": f"{DOMAIN}"}
        self._process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=here)
        self._log = self._process.stderr or ()
        for line in self._log:
            if "SEARCHING" in line:
                break
        threading.Thread(target=self._echo, daemon=True).start()

    def memory_mb(self) -> float:
        """Resident memory."""
        status = Path(f"/proc/{self._process.pid}/status").read_text(encoding="ascii")
        return int(status.partition("VmRSS:")[2].split()[0]) / 1024

    def cpu_s(self) -> float:
        """Processor time so far."""
        fields = Path(f"/proc/{self._process.pid}/stat").read_text(encoding="ascii").split()
        return (int(fields[13]) + int(fields[14])) / os.sysconf("SC_CLK_TCK")

    def end(self) -> None:
        """Interrupt it."""
        self._process.send_signal(signal.SIGINT)
        print(f"node ended with {self._process.wait(60)}")

    def _echo(self) -> None:
        for line in self._log:
            if "WARN" in line or "Traceback" in line or "ERROR" in line:
                print("node:", line.rstrip())


def find(robot: Robot, runs: int) -> None:
    poses = Poses(robot, INITIAL_POSE)
    node = NodeProcess()
    taken = []
    for run in range(runs):
        time.sleep(1.0)  # so that nothing is left of the run before
        if run:
            robot.kidnap()
            time.sleep(0.2)
        stamp = robot.report(0)
        taken.append(1e3 * (poses.wait() - stamp))
    print(f"first scan to initialpose  {', '.join(f'{ms:.0f}' for ms in taken)} ms")
    node.end()
    poses.close()


def drive(robot: Robot, seconds: float, looked_at: bool) -> None:  # noqa: FBT001
    poses = Poses(robot, AMCL_POSE)
    moves = Receiver(robot.participant, TF, dds_name(TF))
    cloud = Poses(robot, CLOUD) if looked_at else None
    node = NodeProcess("--mode", "full")
    warm = round(5.0 / robot.period_s)
    sent, memory, began, cpu = [], [], time.monotonic(), 0.0
    for i in range(warm + round(seconds / robot.period_s)):
        time.sleep(max(0.0, began + i * robot.period_s - time.monotonic()))
        sent.append(robot.report(i))
        if i == warm:
            cpu = node.cpu_s()
        if i >= warm and (i - warm) % round(60.0 / robot.period_s) == 0:
            memory.append(node.memory_mb())
            print(f"after {i * robot.period_s:5.0f} s: {memory[-1]:.1f} MB", flush=True)
    used = (node.cpu_s() - cpu) / seconds
    time.sleep(1.0)
    memory.append(node.memory_mb())
    sent = sent[warm:]
    late = 1e3 * np.array([poses.arrived[s] - s for s in sent if s in poses.arrived])
    median, p99, worst = np.percentile(late, [50.0, 99.0, 100.0])
    third = len(late) // 3
    print(
        f"scan to amcl_pose          median {median:.1f}, p99 {p99:.1f}, worst {worst:.1f} ms; "
        f"{len(late)} of {len(sent)} scans"
    )
    print(
        f"lag                        median of the first third {np.median(late[:third]):.1f}, "
        f"of the last {np.median(late[-third:]):.1f} ms"
    )
    print(f"memory                     {memory[0]:.1f} MB, at the end {memory[-1]:.1f} MB")
    print(f"processor                  {100 * used:.0f} % of a core")
    print(f"load of the machine        {os.getloadavg()[0]:.1f}")
    node.end()
    poses.close()
    if cloud is not None:
        cloud.close()
    del moves


if __name__ == "__main__":
    main()
