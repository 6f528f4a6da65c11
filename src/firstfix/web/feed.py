"""What goes on, kept for viewers: filled by the thread that thinks, read by the one that serves."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import map_key
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Hypotheses, MotionRequest, Output, Status, TrackedPose
from firstfix.localizer.states import State
from firstfix.web.meters import Meters
from firstfix.web.timeline import Event, Timeline
from firstfix.web.view import PlacedParticles, PlacedScan, ShownMap, View

# Scans that wait for odometry of their stamp.
_MOST_SCANS = 40


class Feed:
    """A watcher of a node: holds what viewers may see, whether there are any or not.

    It takes down references and some figures: what viewers cost is paid where they are served.

    Parameters
    ----------
    map_name : str
        What the map is called.
    """

    def __init__(self, map_name: str) -> None:
        self._lock = threading.Lock()
        self._view = View()
        self._map_name = map_name
        self._timeline = Timeline()
        self._meters = Meters()
        self._scans: deque[LaserScan] = deque(maxlen=_MOST_SCANS)
        self._listeners: list[Callable[[], None]] = []

    @property
    def view(self) -> View:
        """What there is to see now."""
        return self._view

    def events(self, since: int = 0) -> list[Event]:
        """Return the last events whose number is ``since`` or more."""
        with self._lock:
            return self._timeline.since(since)

    def listen(self, changed: Callable[[], None]) -> None:
        """Call back, from any thread, whenever there is something new."""
        self._listeners.append(changed)

    def hang_up(self, changed: Callable[[], None]) -> None:
        """Call back no more."""
        self._listeners.remove(changed)

    def tell(self, kind: str, text: str) -> None:
        """Note an event that the localizer does not know of."""
        with self._lock:
            self._timeline.note(self._view.stamp, kind, text)
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
        is_lifted = self._timeline.is_lifted
        self._meters.count(given, outputs, self._view.state, is_lifted=is_lifted)
        with self._lock:
            if isinstance(given, LaserScan):
                self._scans.append(given)
                self._view = replace(self._view, stamp=given.stamp)
            self._timeline.note_input(given)
            if isinstance(given, NewMap):
                self._take_map(given, localizer)
            for output in outputs:
                self._timeline.note_output(given, output)
                self._take(output, localizer)
        if outputs or isinstance(given, LaserScan):
            self._call_back()
        self._meters.leave()

    def _take_map(self, given: NewMap, localizer: Localizer) -> None:
        if localizer.matcher is not None:
            key = map_key(given.grid)
            shown = ShownMap(self._map_name, key, given.grid, localizer.matcher)
            self._view = replace(self._view, map=shown)

    def _take(self, output: Output, localizer: Localizer) -> None:
        """Put one output into the view."""
        if isinstance(output, TrackedPose):
            self._view = replace(
                self._view,
                pose=output.T_map_base,
                covariance=output.covariance,
                hypotheses=(),
                motion=None,
                belief=self._belief(localizer, output.T_map_base),
                placed=self._placed(output.stamp, output.T_map_base),
            )
        elif isinstance(output, Hypotheses):
            placed = self._placed(output.stamp, output.places[0].pose)
            self._view = replace(self._view, hypotheses=output.places, motion=None, placed=placed)
        elif isinstance(output, MotionRequest):
            self._view = replace(self._view, motion=output)
        elif isinstance(output, Status):
            self._take_status(output)

    def _take_status(self, status: Status) -> None:
        cleared: dict[str, Any] = {}
        if status.state is not State.LOCALIZED:
            cleared = {"pose": None, "covariance": None, "belief": None}
        if status.state in {State.SEARCHING, State.NO_MAP}:
            cleared |= {"hypotheses": (), "motion": None, "placed": None}
        self._view = replace(
            self._view,
            stamp=status.stamp,
            state=status.state,
            reason=status.reason,
            evidence=status.evidence,
            cpu_ms=self._meters.cpu_ms,
            time_to_fix_s=self._meters.time_to_fix_s,
            **cleared,
        )

    def _belief(self, localizer: Localizer, T_map_base: SE2) -> PlacedParticles | None:
        before, particles = self._view.belief, localizer.particles
        if particles is None:
            return None
        if before is not None and before.particles is particles:
            return before
        return PlacedParticles(particles, T_map_base)

    def _placed(self, stamp: float, T_map_base: SE2) -> PlacedScan | None:
        scan = next((scan for scan in reversed(self._scans) if scan.stamp == stamp), None)
        return PlacedScan(scan, T_map_base) if scan is not None else self._view.placed

    def _call_back(self) -> None:
        for changed in tuple(self._listeners):
            changed()
