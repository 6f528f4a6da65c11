"""What goes on, kept for viewers: filled by the thread that thinks, read by the one that serves."""

from __future__ import annotations

import statistics
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from firstfix.adapters.web.view import PlacedParticles, PlacedScan, ShownMap, View
from firstfix.core.odometry import Signal
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.formats.saved_pose import map_key
from firstfix.system.inputs import Input, NewMap, PoseHint, Reset
from firstfix.system.localizer import Localizer
from firstfix.system.outputs import Hypotheses, InitialPose, MotionRequest, Output, TrackedPose
from firstfix.system.transitions import State

MOST_EVENTS = 200

# Scans that wait for odometry of their stamp.
_MOST_SCANS = 40
_CPU_SCANS = 50


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened, for the timeline.

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


class Feed:
    """A watcher of a node: holds what viewers may see, whether there are any or not.

    It only takes down references: what viewers cost is paid where they are served.

    Parameters
    ----------
    map_name : str
        What the map is called.
    """

    def __init__(self, map_name: str) -> None:
        self._lock = threading.Lock()
        self._view = View()
        self._map_name = map_name
        self._map: ShownMap | None = None
        self._events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self._next_number = 0
        self._listeners: list[Callable[[], None]] = []
        self._scans: deque[LaserScan] = deque(maxlen=_MOST_SCANS)
        self._cpu_s: deque[float] = deque(maxlen=_CPU_SCANS)
        self._spent_s = 0.0
        self._looked_at_s = 0.0
        self._searching_since: float | None = None

    @property
    def view(self) -> View:
        """What there is to see now."""
        return self._view

    @property
    def map(self) -> ShownMap | None:
        """The map in use; None before the first."""
        return self._map

    def events(self, since: int = 0) -> list[Event]:
        """Return the last events whose number is ``since`` or more."""
        with self._lock:
            return [event for event in self._events if event.number >= since]

    def listen(self, changed: Callable[[], None]) -> None:
        """Call back, from any thread, whenever there is something new."""
        self._listeners.append(changed)

    def tell(self, kind: str, text: str) -> None:
        """Note an event."""
        with self._lock:
            self._note(self._view.stamp, kind, text)
        self._call_back()

    def know(self, truth: SE2) -> None:
        """Take down where a simulated robot truly is; its scan comes right after."""
        with self._lock:
            self._view = replace(self._view, truth=truth)

    def stand_still(self, *, paused: bool) -> None:
        """Take down whether the clock of a simulated robot stands still."""
        with self._lock:
            self._view = replace(self._view, paused=paused)
        self._call_back()

    def __call__(self, given: Input, outputs: list[Output], localizer: Localizer) -> None:
        """Take down what came in and what it led to; called by the thread that thinks."""
        self._count_cpu(given)
        if isinstance(given, LaserScan):
            self._scans.append(given)
            if self._view.state is State.SEARCHING and self._searching_since is None:
                self._searching_since = given.stamp
        with self._lock:
            self._note_input(given, localizer)
            for output in outputs:
                self._take(output, localizer)
        if outputs or isinstance(given, LaserScan):
            self._call_back()
        self._looked_at_s = time.thread_time()

    def _count_cpu(self, given: Input) -> None:
        self._spent_s += time.thread_time() - self._looked_at_s
        if isinstance(given, LaserScan):
            self._cpu_s.append(self._spent_s)
        if isinstance(given, LaserScan | NewMap):
            self._spent_s = 0.0

    def _note_input(self, given: Input, localizer: Localizer) -> None:
        if isinstance(given, NewMap) and localizer.locator is not None:
            grid = given.grid
            self._map = ShownMap(self._map_name, map_key(grid), grid, localizer.locator)
            size = f"{grid.width} x {grid.height} cells, {grid.free_area:.0f} m² free"
            self._note(given.stamp, "map", f"a map of {size}")
        elif isinstance(given, Signal) and given.kind.means_lifted:
            words = "begins" if given.active else "is over"
            self._note(given.stamp, "lifted", f"{given.kind.value.replace('_', ' ')} {words}")
        elif isinstance(given, PoseHint):
            at = given.T_map_base
            self._note(given.stamp, "hint", f"a person says: at ({at.x:.2f}, {at.y:.2f}) m")
        elif isinstance(given, Reset):
            self._note(given.stamp, "person", "told to search anew")

    def _take(self, output: Output, localizer: Localizer) -> None:
        """Put one output into the view."""
        view = self._view
        if isinstance(output, TrackedPose):
            belief, particles = view.belief, localizer.particles
            if particles is not None and (belief is None or belief.particles is not particles):
                belief = PlacedParticles(particles, output.T_map_base)
            self._view = replace(
                view,
                pose=output.T_map_base,
                covariance=output.covariance,
                hypotheses=(),
                motion=None,
                belief=belief,
                placed=self._placed(output.stamp, output.T_map_base),
            )
        elif isinstance(output, Hypotheses):
            placed = self._placed(output.stamp, output.places[0].pose)
            self._view = replace(view, hypotheses=output.places, motion=None, placed=placed)
        elif isinstance(output, MotionRequest):
            self._view = replace(view, motion=output)
        elif isinstance(output, InitialPose):
            self._note_found(output)
        else:
            changed = output.state is not view.state
            if changed:
                was_lost = view.state is State.LOCALIZED and output.state is State.SEARCHING
                kind = "lost" if was_lost else "state"
                self._note(output.stamp, kind, f"{output.state.value}: {output.reason}")
            cleared: dict[str, Any] = {}
            if output.state is not State.LOCALIZED:
                cleared = {"pose": None, "covariance": None, "belief": None}
            if output.state is State.SEARCHING:
                cleared |= {"hypotheses": (), "motion": None, "placed": None}
            self._view = replace(
                view,
                stamp=output.stamp,
                state=output.state,
                reason=output.reason,
                evidence=output.evidence,
                cpu_ms=1e3 * statistics.median(self._cpu_s) if self._cpu_s else None,
                **cleared,
            )

    def _placed(self, stamp: float, T_map_base: SE2) -> PlacedScan | None:
        scan = next((scan for scan in reversed(self._scans) if scan.stamp == stamp), None)
        return PlacedScan(scan, T_map_base) if scan is not None else self._view.placed

    def _note_found(self, found: InitialPose) -> None:
        at = found.T_map_base
        if self._searching_since is not None:
            # From the first scan to the one that settled it, and what that took to look at.
            took = found.stamp - self._searching_since + self._cpu_s[-1]
            self._view = replace(self._view, time_to_fix_s=took)
            self._searching_since = None
        self._note(found.stamp, "found", f"found at ({at.x:.2f}, {at.y:.2f}) m")

    def _note(self, stamp: float, kind: str, text: str) -> None:
        self._events.append(Event(self._next_number, stamp, kind, text))
        self._next_number += 1

    def _call_back(self) -> None:
        for changed in self._listeners:
            changed()
