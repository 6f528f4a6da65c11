"""Executing the commands of viewers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import Input, PoseHint, Reset
from firstfix.web.commands import (
    Carry,
    Command,
    DriveTo,
    Pause,
    PickPlace,
    Relocalize,
    SetPeople,
    SetPose,
    SimulationCommand,
)
from firstfix.web.snapshot_store import SnapshotStore

ABILITIES = ("goal", "carry", "people", "pause")


class ControllableRobot(Protocol):
    """A simulated robot that viewers of the page control."""

    def pause(self) -> None:
        """Stop the simulated clock."""

    def go_on(self) -> None:
        """Resume the simulated clock."""

    def drive_to(self, x: float, y: float) -> None:
        """Drive to a point of the map, m."""

    def carry_to(self, T_map_base: SE2) -> None:
        """Lift the robot and set it down at a pose."""

    def meet(self, people: int) -> None:
        """Let people walk around the robot."""


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

    @property
    def abilities(self) -> tuple[str, ...]:
        """Tags of the commands that only a simulated robot can execute; empty on a real one."""
        return () if self._robot is None else ABILITIES

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
                (robot.pause if paused else robot.go_on)()
                self._store.set_paused(paused=paused)
                event = "Simulation paused" if paused else "Simulation resumed"
            case DriveTo(x=x, y=y):
                robot.drive_to(x, y)
                event = f"Goal set: ({x:.2f}, {y:.2f}) m"
            case Carry(x=x, y=y):
                robot.carry_to(command.T_map_base)
                event = f"Carried to ({x:.2f}, {y:.2f}) m"
            case SetPeople(count=count):
                robot.meet(count)
                event = f"{count} people walk around the robot"
        self._store.add_event("person", event)
