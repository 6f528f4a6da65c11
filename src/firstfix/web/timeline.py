"""The timeline of the page."""

from __future__ import annotations

from collections import deque

from msgspec import Struct

from firstfix.core.odometry import Odometry, Signal
from firstfix.core.scan import LaserScan
from firstfix.localizer.inputs import Input, NewMap, PoseHint, Reset
from firstfix.localizer.outputs import InitialPose, Output, Status
from firstfix.localizer.states import State

MOST_EVENTS = 200

# Inputs that change the state and have an event of their own.
_WITH_OWN_EVENT = (NewMap, PoseHint)


class Event(Struct, frozen=True, tag_field="type", tag="event"):
    """Something that happened; also its message.

    Parameters
    ----------
    number : int
        Counted from 0.
    stamp : float
        Time, s.
    kind : str
        state, found, lost, hint, refused, lifted, map, person or warning.
    text : str
        One sentence.
    """

    number: int
    stamp: float
    kind: str
    text: str


class Timeline:
    """The last events. Not thread-safe."""

    def __init__(self) -> None:
        self._events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self._next_number = 0
        self._state = State.NO_MAP
        self._found: InitialPose | None = None

    def since(self, number: int) -> list[Event]:
        """Return the events whose number is `number` or more."""
        return [event for event in self._events if event.number >= number]

    def add(self, stamp: float, kind: str, text: str) -> None:
        """Add an event."""
        self._events.append(Event(self._next_number, stamp, kind, text))
        self._next_number += 1

    def add_input(self, given: Input) -> None:
        """Add a map or a hint."""
        if isinstance(given, NewMap):
            grid = given.grid
            size = f"{grid.width} x {grid.height} cells, {grid.free_area:.0f} m² free"
            name = f"{given.map_id}, " if given.map_id else ""
            self.add(given.stamp, "map", f"Map received: {name}{size}")
        elif isinstance(given, PoseHint):
            at = given.T_map_base
            self.add(given.stamp, "hint", f"Hint from {given.source}: ({at.x:.2f}, {at.y:.2f}) m")

    def add_output(self, given: Input, output: Output) -> None:
        """Add a change of state."""
        if isinstance(output, InitialPose):
            self._found = output
        elif isinstance(output, Status):
            before, self._state = self._state, output.state
            if self._found is not None:
                at, self._found = self._found.T_map_base, None
                where = f"({at.x:.2f}, {at.y:.2f}) m"
                self.add(output.stamp, "found", f"Localized at {where}: {output.reason}")
            elif before is not output.state and State.LIFTED in (before, output.state):
                self._add_lift(given, output)
            elif _is_rejection(given, before, output):
                self.add(output.stamp, "refused", _sentence(output.reason))
            elif before is not output.state and not isinstance(given, _WITH_OWN_EVENT):
                self._add_change(given, before, output)

    def _add_change(self, given: Input, before: State, status: Status) -> None:
        was_lost = before is State.LOCALIZED and status.state is State.SEARCHING
        was_lost &= not isinstance(given, Reset)
        kind = "lost" if was_lost else "state"
        self.add(status.stamp, kind, f"{status.state.value}: {status.reason}")

    def _add_lift(self, given: Input, status: Status) -> None:
        if status.state is State.LIFTED:
            sensor = given.kind.value.replace("_", " ") if isinstance(given, Signal) else "map"
            self.add(status.stamp, "lifted", f"Picked up: {sensor}")
        else:
            self.add(status.stamp, "lifted", "Set down")


def _is_rejection(given: Input, before: State, status: Status) -> bool:
    """Return whether a proposed pose was refused at once, or rejected by a scan."""
    if isinstance(given, PoseHint):
        return status.state not in {State.VERIFYING_HINT, State.LIFTED, State.NO_MAP}
    return before is State.VERIFYING_HINT and status.state is State.SEARCHING and _is_scan(given)


def _is_scan(given: Input) -> bool:
    return isinstance(given, LaserScan | Odometry)


def _sentence(reason: str) -> str:
    return reason[:1].upper() + reason[1:]
