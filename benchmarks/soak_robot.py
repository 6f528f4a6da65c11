"""The robot of `soak.py`: a simulated Kobuki over rospy, with disturbances in real time.

A line of JSON on its stdin is a command: ``{"do": "drop", "topics": ["scan"], "seconds": 3}``; the
methods of `Robot` named ``do_...`` are the commands. The file gets a line for each scan that is
sent (true pose, odometry, time of sending), and for each time that the robot is moved.
"""

from __future__ import annotations

import argparse
import heapq
import itertools
import json
import queue
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import rospy

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "robots"))

import ros1_robot
from play import BASE, LASER, report

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import to_seconds
from firstfix.io.ros_messages.outgoing import pose_with_covariance, transforms
from firstfix.lab.scenarios.phases import CarryTo, DriveTo, Manner, Slip, Stand
from firstfix.lab.scenarios.scenario import Scenario, start_simulation
from firstfix.lab.simulation.simulation import Moment, Simulation
from firstfix.lab.worlds.catalog import WORLDS, random_free_pose
from firstfix.ros.ros1.master import is_forgotten, register_anew
from firstfix.ros.ros1.types import make, message_class

# A carried robot must end up at least this far away.
FAR_M = 2.0
_MASTER_CHECK_S = 1.0
_SENSORS = ("scan", "/tf", "/tf_static", "events/cliff", "events/wheel_drop", "events/bumper")


def stay_known() -> None:
    """Register again with every new master, in a thread: rospy does not detect it."""

    def look() -> None:
        is_known = True
        while not rospy.is_shutdown():
            rospy.rostime.wallsleep(_MASTER_CHECK_S)
            if is_forgotten() or not is_known:
                is_known = register_anew([])

    threading.Thread(target=look, daemon=True).start()


class Wire:
    """Connection of the robot to ROS: drops, holds and delays messages; never reorders a topic."""

    def __init__(self) -> None:
        self._publishers = {
            topic: rospy.Publisher(
                topic,
                ros1_robot._kind(ros1_robot.TYPES[topic]),  # also a Kobuki's
                latch=topic == "/tf_static",
                queue_size=200,
                tcp_nodelay=True,
            )
            for topic in _SENSORS
        }
        self._kept: list[tuple[float, int, str, Any, Any]] = []
        self._number = itertools.count()
        self._last_due: dict[str, float] = {}
        self._troubles: list[tuple[str, list[str], float, float]] = []
        self.told: Any = None

    def trouble(self, kind: str, topics: list[str], seconds: float, delay_s: float = 0.0) -> None:
        """Start a fault: ``drop``, ``hold`` (all messages at once at the end) or ``late``."""
        self._troubles.append((kind, topics, time.time() + seconds, delay_s))

    def send(self, topic: str, message: Any, row: Any) -> None:
        """Send, delay or drop a message; ``row`` is written when it is sent."""
        now = due = time.time()
        self._troubles = [trouble for trouble in self._troubles if trouble[2] > now]
        for kind, topics, until, delay_s in self._troubles:
            if topic not in topics:
                continue
            if kind == "drop":
                return
            due = max(due, until if kind == "hold" else now + delay_s)
        due = self._last_due[topic] = max(due, self._last_due.get(topic, 0.0))
        heapq.heappush(self._kept, (due, next(self._number), topic, message, row))
        self.deliver()

    def deliver(self) -> None:
        """Send the delayed messages that are due."""
        while self._kept and self._kept[0][0] <= time.time():
            _, _, topic, message, row = heapq.heappop(self._kept)
            if rospy.is_shutdown():
                sys.exit()
            if row is not None:
                self.told(row | {"sent": time.time()})
            self._publishers[topic].publish(message)

    def wait_until(self, when: float) -> None:
        """Pass time."""
        self.deliver()
        while (now := time.time()) < when:
            first = self._kept[0][0] if self._kept else when
            time.sleep(max(0.0, min(when, first) - now))
            self.deliver()


class Robot:
    """A Kobuki in a building, with disturbances."""

    def __init__(self, grid: OccupancyGrid, start: SE2 | None, seed: int, lines: Any) -> None:
        self._grid = grid
        self._rng = np.random.default_rng(seed)
        self._lines = lines
        is_elsewhere = False
        try:
            self._simulation = self._wake(start, seed)
        except InputError:  # it was killed at an invalid pose, such as while it was carried
            self._simulation, is_elsewhere = self._wake(None, seed), True
        self._plot: Iterator[Moment] = iter(())
        self._wire = Wire()
        self._wire.told = self._tell
        self._person = rospy.Publisher(
            "initialpose", message_class("geometry_msgs/PoseWithCovarianceStamped"), queue_size=1
        )
        self._life = f"{seed}"
        self._clock_s = 0.0
        self._orders: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        next(Stand(1.0).run(self._wake(None, seed)))  # loads kernels before the clock starts
        if is_elsewhere:
            self._mark("teleport")

    def _wake(self, start: SE2 | None, seed: int) -> Simulation:
        return start_simulation(Scenario((), start=start), self._grid, seed)

    def listen(self) -> None:
        """Read commands from stdin, in a thread."""
        for line in sys.stdin:
            self._orders.put(json.loads(line))

    def live(self) -> None:
        """Run in real time until ROS ends it."""
        T_base_laser = Scenario(()).rig.lidars[0].T_base_laser
        self._wire.send("/tf_static", transforms(make, 0.0, BASE, LASER, T_base_laser), None)
        began = time.time() - self._simulation.stamp
        while not rospy.is_shutdown():
            while not self._orders.empty():
                order = self._orders.get()
                getattr(self, f"do_{order.pop('do')}")(**order)
            self._report(self._next_moment(), began)

    def _next_moment(self) -> Moment:
        while True:
            for moment in self._plot:
                return moment
            self._plot = self._wander()

    def _wander(self) -> Iterator[Moment]:
        with suppress(InputError):  # there may be no path from its place
            yield from DriveTo(seconds=90.0).run(self._simulation)
        yield from Stand(1.0).run(self._simulation)

    def _report(self, moment: Moment, began: float) -> None:
        odometry = next(event for event in moment.events if isinstance(event, Odometry))
        row = {
            "kind": "scan",
            "made": began + moment.stamp,
            "pose": moment.T_map_base.as_array().tolist(),
            "odom": odometry.T_odom_base.as_array().tolist(),
            "life": self._life,
            "phase": moment.phase,
        }

        def send(topic: str, message: Any) -> None:
            own = topic == "scan"
            stamp = to_seconds(message.header.stamp) if own else 0.0
            self._wire.send(topic, message, row | {"stamp": stamp} if own else None)

        # Also for scans that are not sent: a restarted robot continues at its last true pose.
        self._tell({"kind": "here", "pose": row["pose"]})
        for event in moment.events:
            self._wire.wait_until(began + event.stamp)
            report(event, began + self._clock_s, ros1_robot.make_any, send)

    def _tell(self, row: dict[str, Any]) -> None:
        self._lines.write(json.dumps(row) + "\n")

    def _mark(self, how: str, seconds: float = 0.0) -> None:
        now = time.time()
        self._tell({"kind": "moved", "how": how, "at": now, "until": now + seconds})

    def _elsewhere(self) -> SE2:
        here = self._simulation.robot.T_map_base
        while True:
            there = random_free_pose(self._grid, self._rng)
            if there.distance_to(here) > FAR_M:
                return there

    # ---- disturbances

    def do_wire(self, **trouble: Any) -> None:
        """Drop, hold or delay messages."""
        self._wire.trouble(**trouble)

    def do_clock(self, by: float) -> None:
        """Set the clock."""
        self._clock_s += by

    def do_people(self, count: int, manner: str) -> None:
        """Replace the people."""
        self._simulation.people.come(count, Manner(manner), self._simulation.robot.T_map_base)

    def do_teleport(self) -> None:
        """Teleport; no sensor reports it."""
        self._simulation.robot.place(self._elsewhere())
        self._mark("teleport")
        self._plot = Stand(1.0).run(self._simulation)

    def do_carry(self, seconds: float) -> None:
        """Be lifted, carried and set down; the wheel drop reports it."""
        self._mark("carry", seconds)
        carried = CarryTo(self._elsewhere(), seconds).run(self._simulation)
        self._plot = itertools.chain(carried, Stand(1.0).run(self._simulation))

    def do_push(self, metres: float, degrees: float) -> None:
        """Be pushed; the wheels do not turn."""
        self._mark("push", 0.5)
        pushed = Slip(metres, degrees).run(self._simulation)
        self._plot = itertools.chain(pushed, Stand(1.0).run(self._simulation))

    def do_hint(self) -> None:
        """Publish a wrong hint."""
        where = self._elsewhere()
        covariance = np.diag([0.25, 0.25, 0.07])
        self._person.publish(pose_with_covariance(make, 0.0, "map", where, covariance))


def main() -> None:
    """Run until ended."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("world", choices=WORLDS)
    parser.add_argument("seed", type=int)
    parser.add_argument("truth", type=Path)
    parser.add_argument("--start", type=float, nargs=3)
    options = parser.parse_args()
    rospy.init_node("robot")
    start = SE2(*options.start) if options.start else None
    with options.truth.open("a", encoding="utf-8", buffering=1) as lines:
        robot = Robot(WORLDS[options.world](), start, options.seed, lines)
        threading.Thread(target=robot.listen, daemon=True).start()
        stay_known()
        robot.live()


if __name__ == "__main__":
    main()
