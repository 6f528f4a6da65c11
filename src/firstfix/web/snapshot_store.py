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
from firstfix.web.snapshot import ActiveMap, ParticleCloud, RegisteredScan, Snapshot
from firstfix.web.timeline import Event, Timeline
from firstfix.web.timing import TimingStatistics

# Scans that wait for odometry of their stamp.
_MOST_SCANS = 40


class SnapshotStore:
    """A watcher of a node: holds what viewers may see, whether there are any or not.

    It takes down references and some figures: what viewers cost is paid where they are served.

    Parameters
    ----------
    map_name : str
        What the map is called.
    """

    def __init__(self, map_name: str) -> None:
        self._lock = threading.Lock()
        self._snapshot = Snapshot()
        self._map_name = map_name
        self._timeline = Timeline()
        self._timing = TimingStatistics()
        self._scans: deque[LaserScan] = deque(maxlen=_MOST_SCANS)
        self._listeners: list[Callable[[], None]] = []

    @property
    def snapshot(self) -> Snapshot:
        """What there is to see now."""
        return self._snapshot

    def events(self, since: int = 0) -> list[Event]:
        """Return the last events whose number is ``since`` or more."""
        with self._lock:
            return self._timeline.since(since)

    def subscribe(self, changed: Callable[[], None]) -> None:
        """Call back, from any thread, whenever there is something new."""
        self._listeners.append(changed)

    def unsubscribe(self, changed: Callable[[], None]) -> None:
        """Call back no more."""
        self._listeners.remove(changed)

    def add_event(self, kind: str, text: str) -> None:
        """Note an event that the localizer does not know of."""
        with self._lock:
            self._timeline.note(self._snapshot.stamp, kind, text)
        self._call_back()

    def set_truth(self, truth: SE2) -> None:
        """Take down where a simulated robot truly is; its scan comes right after."""
        with self._lock:
            self._snapshot = replace(self._snapshot, truth=truth)

    def set_paused(self, *, paused: bool) -> None:
        """Take down whether the clock of a simulated robot stands still."""
        with self._lock:
            self._snapshot = replace(self._snapshot, paused=paused)
        self._call_back()

    def __call__(self, given: Input, outputs: list[Output], localizer: Localizer) -> None:
        """Take down what came in and what it led to; called by the thread that thinks."""
        self._timing.count(given, outputs, self._snapshot.state)
        with self._lock:
            if isinstance(given, LaserScan):
                self._scans.append(given)
                self._snapshot = replace(self._snapshot, stamp=given.stamp)
            self._timeline.note_input(given)
            if isinstance(given, NewMap):
                self._take_map(given, localizer)
            for output in outputs:
                self._timeline.note_output(given, output)
                self._take(output, localizer)
        if outputs or isinstance(given, LaserScan):
            self._call_back()
        self._timing.leave()

    def _take_map(self, given: NewMap, localizer: Localizer) -> None:
        if localizer.matcher is not None:
            key = map_key(given.grid)
            active_map = ActiveMap(self._map_name, key, given.grid, localizer.matcher)
            self._snapshot = replace(self._snapshot, map=active_map)

    def _take(self, output: Output, localizer: Localizer) -> None:
        """Put one output into the snapshot."""
        if isinstance(output, TrackedPose):
            self._snapshot = replace(
                self._snapshot,
                pose=output.T_map_base,
                covariance=output.covariance,
                hypotheses=(),
                motion=None,
                particles=self._cloud(localizer, output.T_map_base),
                scan=self._registered(output.stamp, output.T_map_base),
            )
        elif isinstance(output, Hypotheses):
            scan = self._registered(output.stamp, output.places[0].pose)
            self._snapshot = replace(
                self._snapshot, hypotheses=output.places, motion=None, scan=scan
            )
        elif isinstance(output, MotionRequest):
            self._snapshot = replace(self._snapshot, motion=output)
        elif isinstance(output, Status):
            self._take_status(output)

    def _take_status(self, status: Status) -> None:
        cleared: dict[str, Any] = {}
        if status.state is not State.LOCALIZED:
            cleared = {"pose": None, "covariance": None, "particles": None}
        if status.state in {State.NO_MAP, State.SEARCHING, State.LIFTED}:
            cleared |= {"hypotheses": (), "motion": None, "scan": None}
        self._snapshot = replace(
            self._snapshot,
            stamp=status.stamp,
            state=status.state,
            reason=status.reason,
            evidence=status.evidence,
            cpu_ms=self._timing.cpu_ms,
            time_to_fix_s=self._timing.time_to_fix_s,
            **cleared,
        )

    def _cloud(self, localizer: Localizer, T_map_base: SE2) -> ParticleCloud | None:
        before, particles = self._snapshot.particles, localizer.particles
        if particles is None:
            return None
        if before is not None and before.particles is particles:
            return before
        return ParticleCloud(particles, T_map_base)

    def _registered(self, stamp: float, T_map_base: SE2) -> RegisteredScan | None:
        scan = next((scan for scan in reversed(self._scans) if scan.stamp == stamp), None)
        return RegisteredScan(scan, T_map_base) if scan is not None else self._snapshot.scan

    def _call_back(self) -> None:
        for changed in tuple(self._listeners):
            changed()
