"""The newest snapshot: written by the localizer's thread, read by the server's."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import map_key
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.outputs import Hypotheses, MotionRequest, Output, Status, TrackedPose
from firstfix.localizer.states import State
from firstfix.site.floors import AnyLocalizer
from firstfix.web.snapshot import (
    ActiveMap,
    AmclEstimate,
    ParticleCloud,
    RegisteredScan,
    SimulationStatus,
    Snapshot,
)
from firstfix.web.timeline import Event, Timeline
from firstfix.web.timing import TimingStatistics


class SnapshotStore:
    """Observer of a node: holds the newest snapshot and the timeline.

    It only stores references. Frames for viewers are encoded by the server's thread.

    Parameters
    ----------
    map_name : str
        Name of the map; empty: maps bring their own, as those of a site.
    """

    def __init__(self, map_name: str) -> None:
        self._lock = threading.Lock()
        self._snapshot = Snapshot()
        self.set_map_name(map_name)
        self._timeline = Timeline()
        self._timing = TimingStatistics()
        self._listeners: list[Callable[[], None]] = []

    @property
    def snapshot(self) -> Snapshot:
        """The newest snapshot."""
        return self._snapshot

    def events(self, since: int = 0) -> list[Event]:
        """Return the last events whose number is ``since`` or more."""
        with self._lock:
            return self._timeline.since(since)

    def subscribe(self, changed: Callable[[], None]) -> None:
        """Call a function, from any thread, after each change."""
        self._listeners.append(changed)

    def unsubscribe(self, changed: Callable[[], None]) -> None:
        """Stop calling a function."""
        self._listeners.remove(changed)

    def add_event(self, kind: str, text: str) -> None:
        """Add an event to the timeline."""
        with self._lock:
            self._timeline.add(self._snapshot.stamp, kind, text)
        self._notify()

    def set_truth(self, truth: SE2) -> None:
        """Set the true pose of a simulated robot, before its scan."""
        with self._lock:
            self._snapshot = replace(self._snapshot, truth=truth)

    def set_amcl(self, amcl: AmclEstimate | None) -> None:
        """Set what a plain AMCL beside the localizer believes; None if none runs."""
        with self._lock:
            self._snapshot = replace(self._snapshot, amcl=amcl)

    def skip_time(self) -> None:
        """Do not count the processor time of this thread since the last input."""
        self._timing.start_input()

    def set_simulation(self, simulation: SimulationStatus) -> None:
        """Set the status of the simulation."""
        with self._lock:
            self._snapshot = replace(self._snapshot, simulation=simulation)
        self._notify()

    def set_map_name(self, name: str) -> None:
        """Set the name of the next map; empty: maps bring their own, as those of a site."""
        self._map_name = name

    def __call__(self, given: Input, outputs: list[Output], localizer: AnyLocalizer) -> None:
        """Store the outputs for an input; called by the localizer's thread."""
        self._timing.end_input(given, outputs, self._snapshot.state)
        with self._lock:
            if isinstance(given, LaserScan):
                self._snapshot = replace(self._snapshot, stamp=given.stamp)
            self._timeline.add_input(given)
            if isinstance(given, NewMap):
                self._store_map(given, localizer)
            self._snapshot = replace(self._snapshot, belief=localizer.belief)
            for output in outputs:
                self._timeline.add_output(given, output)
                self._store_output(output, localizer)
        if outputs or isinstance(given, LaserScan):
            self._notify()
        self._timing.start_input()

    def _store_map(self, given: NewMap, localizer: AnyLocalizer) -> None:
        if localizer.matcher is not None:
            # A file name may have bytes that are not UTF-8, and JSON cannot have them.
            name = (self._map_name or given.map_id).encode(errors="replace").decode()
            active_map = ActiveMap(
                name, map_key(given.grid), given.grid, localizer.matcher, localizer.changes
            )
            self._snapshot = replace(self._snapshot, map=active_map)

    def _store_output(self, output: Output, localizer: AnyLocalizer) -> None:
        if isinstance(output, TrackedPose):
            self._snapshot = replace(
                self._snapshot,
                pose=output.T_map_base,
                covariance=output.covariance,
                hypotheses=(),
                motion=None,
                particles=self._cloud(localizer, output.T_map_base),
                scan=self._registered(localizer, output.T_map_base),
            )
        elif isinstance(output, Hypotheses):
            scan = self._registered(localizer, output.places[0].pose)
            self._snapshot = replace(
                self._snapshot, hypotheses=output.places, motion=None, scan=scan
            )
        elif isinstance(output, MotionRequest):
            self._snapshot = replace(self._snapshot, motion=output)
        elif isinstance(output, Status):
            self._store_status(output)

    def _store_status(self, status: Status) -> None:
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
            rivals=status.rivals,
            chosen_by=status.chosen_by,
            evidence=status.evidence,
            cpu_ms=self._timing.cpu_ms,
            time_to_fix_s=self._timing.time_to_fix_s,
            **cleared,
        )

    def _cloud(self, localizer: AnyLocalizer, T_map_base: SE2) -> ParticleCloud | None:
        before, particles = self._snapshot.particles, localizer.particles
        if particles is None:
            return None
        if before is not None and before.particles is particles:
            return before
        return ParticleCloud(particles, T_map_base)

    def _registered(self, localizer: AnyLocalizer, T_map_base: SE2) -> RegisteredScan | None:
        view = localizer.view
        return self._snapshot.scan if view is None else RegisteredScan(view.scans, T_map_base)

    def _notify(self) -> None:
        for changed in tuple(self._listeners):
            changed()
