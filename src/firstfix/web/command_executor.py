"""Carrying out what viewers ask for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import Input, PoseHint, Reset
from firstfix.web.commands import Command
from firstfix.web.snapshot_store import SnapshotStore

ABILITIES = ("goal", "carry", "people", "pause")


class ControllableRobot(Protocol):
    """A simulated robot that viewers of the page can move."""

    def pause(self) -> None:
        """Stop the simulated time."""

    def go_on(self) -> None:
        """Let the simulated time run again."""

    def drive_to(self, x: float, y: float) -> None:
        """Drive to a point of the map, m."""

    def carry_to(self, T_map_base: SE2) -> None:
        """Lift the robot and set it down elsewhere."""

    def meet(self, people: int) -> None:
        """Let people walk around the robot."""


class CommandExecutor:
    """Tells the localizer, and the simulated robot if there is one, what people want.

    Parameters
    ----------
    store : SnapshotStore
        Knows the time and the hypotheses.
    give : callable
        Hands an input to the localizer; from any thread.
    robot : ControllableRobot or None
        Who can be sent about.
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
        """Which orders can be carried out besides those that every robot can."""
        return () if self._robot is None else ABILITIES

    def execute(self, order: Command) -> None:
        """Carry out an order; may take as long as planning a way.

        Raises
        ------
        InputError
            If that cannot be done.
        """
        given = order.given
        if order.kind == "pose":
            self._hint(SE2(**given))
        elif order.kind == "pick":
            self._hint(self._hypothesis(given["index"]))
        elif order.kind == "relocalize":
            self._store.add_event("person", "asked to search anew")
            self._give(Reset(self._store.snapshot.stamp))
        elif self._robot is None:
            raise InputError(
                expected="a simulated robot",
                received="a real one",
                remedy="steer it as it is usually steered",
            )
        else:
            self._steer(self._robot, order)

    def _hint(self, T_map_base: SE2) -> None:
        self._give(PoseHint(self._store.snapshot.stamp, T_map_base))

    def _hypothesis(self, index: int) -> SE2:
        places = self._store.snapshot.hypotheses
        if index >= len(places):
            raise InputError(
                expected=f"one of {len(places)} hypotheses",
                received=f"index {index}",
                remedy="the last state lists them",
            )
        return places[index].pose

    def _steer(self, robot: ControllableRobot, order: Command) -> None:
        given = order.given
        if order.kind == "pause":
            (robot.pause if given["paused"] else robot.go_on)()
            self._store.set_paused(paused=given["paused"])
            self._store.add_event("person", "pause" if given["paused"] else "go on")
        elif order.kind == "goal":
            robot.drive_to(given["x"], given["y"])
            self._store.add_event("person", f"sent to ({given['x']:.2f}, {given['y']:.2f}) m")
        elif order.kind == "carry":
            robot.carry_to(SE2(**given))
            self._store.add_event("person", f"carried to ({given['x']:.2f}, {given['y']:.2f}) m")
        else:
            robot.meet(given["count"])
            self._store.add_event("person", f"{given['count']} people around the robot")
