"""Executing the commands of viewers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import Input, PoseHint, Reset
from firstfix.web.commands import (
    Carry,
    Command,
    CoverSensor,
    Decide,
    DriveTo,
    Kidnap,
    Pause,
    PickPlace,
    Relocalize,
    RunAmcl,
    SelectSensor,
    SelectWorld,
    SetPeople,
    SetPose,
    SimulationCommand,
)
from firstfix.web.messages import Menus
from firstfix.web.snapshot import AmclStart, SimulationStatus
from firstfix.web.snapshot_store import SnapshotStore

ABILITIES = (
    "goal",
    "carry",
    "people",
    "pause",
    "kidnap",
    "cover",
    "sensor",
    "world",
    "decide",
    "amcl",
)
_AMCL_EVENTS = {
    AmclStart.OFF: "Plain AMCL ended",
    AmclStart.POSE: "Plain AMCL runs beside it, from the last published pose",
    AmclStart.UNIFORM: "Plain AMCL runs beside it, from anywhere",
}


class ControllableRobot(Protocol):
    """A simulated robot that viewers of the page control."""

    @property
    def status(self) -> SimulationStatus:
        """World, sensor, and whether the clock is stopped or the sensor covered."""

    @property
    def worlds(self) -> tuple[str, ...]:
        """Names of the worlds."""

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensors."""

    def pause(self) -> None:
        """Stop the simulated clock."""

    def resume(self) -> None:
        """Resume the simulated clock."""

    def drive_to(self, x: float, y: float) -> None:
        """Drive to a point of the map, m."""

    def move(self, turn: float, ahead: float) -> None:
        """Turn on the spot (rad), then drive straight ahead (m)."""

    def carry_to(self, T_map_base: SE2) -> None:
        """Get picked up and set down at a pose."""

    def kidnap(self) -> SE2:
        """Teleport to a random pose with no signal, and return it."""

    def set_people(self, count: int) -> None:
        """Let people walk around the robot."""

    def cover_sensor(self, *, covered: bool) -> None:
        """Cover or uncover the sensor."""

    def select_sensor(self, name: str) -> None:
        """Exchange the sensor."""

    def select_world(self, name: str) -> None:
        """Restart the simulation in another world."""

    def run_amcl(self, start: AmclStart) -> None:
        """Run a plain AMCL beside the localizer, or end it."""


class CommandExecutor:
    """Passes commands to the localizer, and to the simulated robot if there is one.

    Parameters
    ----------
    store : SnapshotStore
        Has the time and the hypotheses.
    give : callable
        Takes an input for the localizer, from any thread.
    robot : ControllableRobot or None
        The simulated robot.
    """

    def __init__(
        self,
        store: SnapshotStore,
        give: Callable[[Input], None],
        robot: ControllableRobot | None = None,
    ) -> None:
        self._store = store
        self._give = give
        self._robot = robot
        if robot is not None:
            store.set_simulation(replace(robot.status, is_paused=False))

    @property
    def abilities(self) -> tuple[str, ...]:
        """Tags of the commands that only a simulated robot can execute; empty on a real one."""
        return () if self._robot is None else ABILITIES

    @property
    def menus(self) -> Menus | None:
        """The choices of a simulated robot; None for a real one."""
        robot = self._robot
        return None if robot is None else Menus(robot.worlds, robot.sensors)

    def execute(self, command: Command) -> None:
        """Execute a command; may take as long as planning a path.

        Raises
        ------
        InputError
            If it cannot be executed.
        """
        match command:
            case SetPose():
                self._give(PoseHint(self._store.snapshot.stamp, command.T_map_base))
            case PickPlace():
                self._pick(command.id)
            case Relocalize():
                self._store.add_event("person", "Relocalization requested")
                self._give(Reset(self._store.snapshot.stamp))
            case _ if self._robot is not None:
                self._control(self._robot, command)
            case DriveTo():
                raise InputError(
                    "Goals can be set here only in simulation. Use your navigation stack."
                )
            case _:
                raise InputError("This command works only with a simulated robot.")

    def _pick(self, hypothesis_id: int) -> None:
        snapshot = self._store.snapshot
        for place in snapshot.hypotheses:
            if place.id == hypothesis_id:
                hint = PoseHint(snapshot.stamp, place.pose, hypothesis_id=hypothesis_id)
                self._give(hint)
                return
        raise InputError("That place is no longer in the list. Pick one of the places shown.")

    def _control(self, robot: ControllableRobot, command: SimulationCommand) -> None:
        match command:
            case Pause(paused=paused):
                (robot.pause if paused else robot.resume)()
                event = "Simulation paused" if paused else "Simulation resumed"
            case DriveTo(x=x, y=y):
                robot.drive_to(x, y)
                event = f"Goal set: ({x:.2f}, {y:.2f}) m"
            case Decide():
                event = self._decide(robot)
            case Carry(x=x, y=y):
                robot.carry_to(command.T_map_base)
                event = f"Carried to ({x:.2f}, {y:.2f}) m"
            case Kidnap():
                pose = robot.kidnap()
                event = f"Kidnapped, with no signal: now at ({pose.x:.2f}, {pose.y:.2f}) m"
            case SetPeople(count=count):
                robot.set_people(count)
                event = f"{count} people walk around the robot"
            case CoverSensor(covered=covered):
                robot.cover_sensor(covered=covered)
                event = "Sensor covered" if covered else "Sensor uncovered"
            case SelectSensor(name=name):
                robot.select_sensor(name)
                event = f"Sensor: {name}"
            case SelectWorld(name=name):
                robot.select_world(name)
                event = f"World: {name}. The simulation restarts."
            case RunAmcl(start=start):
                robot.run_amcl(start)
                event = _AMCL_EVENTS[start]
        self._store.set_simulation(robot.status)
        self._store.add_event("person", event)

    def _decide(self, robot: ControllableRobot) -> str:
        motion = self._store.snapshot.motion
        if motion is None:
            raise InputError("There is no deciding motion now.")
        robot.move(motion.turn, motion.ahead)
        return f"Deciding motion: turn {math.degrees(motion.turn):.0f}°, drive {motion.ahead:.1f} m"
