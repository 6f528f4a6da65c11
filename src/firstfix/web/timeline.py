"""What has happened, for the timeline of the page."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from firstfix.core.odometry import Signal
from firstfix.localizer.inputs import Input, NewMap, PoseHint, Reset
from firstfix.localizer.outputs import InitialPose, Output, Status
from firstfix.localizer.states import State

MOST_EVENTS = 200

# Inputs that change the state and have an event of their own.
_WITH_OWN_EVENT = (NewMap, PoseHint)


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened.

    Parameters
    ----------
    number : int
        Counted from 0.
    stamp : float
        When, s.
    kind : str
        state, found, lost, hint, lifted, map, person or warning.
    text : str
        What, in words.
    """

    number: int
    stamp: float
    kind: str
    text: str


class Timeline:
    """The last events; one thread at a time."""

    def __init__(self) -> None:
        self._events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self._next_number = 0
        self._state = State.NO_MAP
        self._found: InitialPose | None = None

    def since(self, number: int) -> list[Event]:
        """Return those whose number is this or more."""
        return [event for event in self._events if event.number >= number]

    def note(self, stamp: float, kind: str, text: str) -> None:
        """Add an event."""
        self._events.append(Event(self._next_number, stamp, kind, text))
        self._next_number += 1

    def note_input(self, given: Input) -> None:
        """Add what came in, if it was no everyday matter."""
        if isinstance(given, NewMap):
            grid = given.grid
            size = f"{grid.width} x {grid.height} cells, {grid.free_area:.0f} m² free"
            self.note(given.stamp, "map", f"a map of {size}")
        elif isinstance(given, PoseHint):
            at = given.T_map_base
            self.note(given.stamp, "hint", f"somebody says: at ({at.x:.2f}, {at.y:.2f}) m")

    def note_output(self, given: Input, output: Output) -> None:
        """Add what an input led to, if that is news."""
        if isinstance(output, InitialPose):
            self._found = output
        elif isinstance(output, Status):
            before, self._state = self._state, output.state
            if self._found is not None:
                at, self._found = self._found.T_map_base, None
                where = f"({at.x:.2f}, {at.y:.2f}) m"
                self.note(output.stamp, "found", f"found at {where}: {output.reason}")
            elif before is not output.state and State.LIFTED in (before, output.state):
                self._note_lift(given, output)
            elif before is not output.state and not isinstance(given, _WITH_OWN_EVENT):
                self._note_change(given, before, output)

    def _note_change(self, given: Input, before: State, status: Status) -> None:
        was_lost = before is State.LOCALIZED and status.state is State.SEARCHING
        was_lost &= not isinstance(given, Reset)
        kind = "lost" if was_lost else "state"
        self.note(status.stamp, kind, f"{status.state.value}: {status.reason}")

    def _note_lift(self, given: Input, status: Status) -> None:
        if status.state is State.LIFTED:
            sensor = given.kind.value.replace("_", " ") if isinstance(given, Signal) else "map"
            self.note(status.stamp, "lifted", f"picked up: {sensor}")
        else:
            self.note(status.stamp, "lifted", "set down")
