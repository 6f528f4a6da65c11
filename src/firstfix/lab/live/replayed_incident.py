"""An incident on the live page: its inputs, at the speed at which they came."""

from __future__ import annotations

import threading
from contextlib import suppress

from firstfix.core.errors import InputError
from firstfix.fields.cache import cache_folder
from firstfix.localizer.incident import Incident
from firstfix.localizer.incident_document import repeat
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.outputs import MapSwitched
from firstfix.site.checkpoint import any_localizer_at_start
from firstfix.site.floors import SiteLocalizer
from firstfix.site.site import Site
from firstfix.web.access_control import AccessPolicy
from firstfix.web.command_executor import CommandExecutor
from firstfix.web.page import Page
from firstfix.web.snapshot_store import SnapshotStore

# A longer pause between two inputs is cut short, s.
_LONGEST_PAUSE_S = 2.0


class ReplayedIncident:
    """Plays an incident once, from the first viewer on. The page keeps what it showed.

    Parameters
    ----------
    incident : Incident
        The incident.
    name : str
        Name of the map on the page.
    access : AccessPolicy
        Who may see the page; nobody may steer.
    site : Site, optional
        The maps of an incident in a site.

    Raises
    ------
    InputError
        If the state in the incident is damaged.
    """

    def __init__(
        self, incident: Incident, name: str, access: AccessPolicy, site: Site | None = None
    ) -> None:
        self._incident = incident
        self._localizer = any_localizer_at_start(incident, site, cache_folder())
        self._store = SnapshotStore(name if site is None else "")
        self._is_ended = threading.Event()
        self._thread = threading.Thread(target=self._play, name="replay", daemon=True)
        executor = CommandExecutor(self._store, _refuse)
        self.page = Page("replay", self._store, executor, access, on_first_viewer=self.start)
        matcher, named = self._localizer.matcher, incident.map
        if named is None and matcher is not None and isinstance(self._localizer, SiteLocalizer):
            named = NewMap(incident.stamp, matcher.fields.grid, f"{self._localizer.map_id}")
        if named is not None:
            self._store(named, [], self._localizer)

    def start(self) -> None:
        """Play; a second call has no effect."""
        if not self._thread.is_alive() and not self._is_ended.is_set():
            with suppress(RuntimeError):  # it has already played
                self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._is_ended.set()
        if self._thread.is_alive():
            self._thread.join()

    def _play(self) -> None:
        before, different = None, 0
        try:
            for step in repeat(self._incident, self._localizer):
                stamp = step.given.stamp
                pause = 0.0 if before is None else min(_LONGEST_PAUSE_S, stamp - before)
                before = stamp
                if self._is_ended.wait(max(0.0, pause)):
                    return
                for output in step.outputs:
                    if isinstance(output, MapSwitched):
                        named = NewMap(output.stamp, output.grid, output.map_id)
                        self._store(named, [], self._localizer)
                self._store(step.given, step.outputs, self._localizer)
                different += not step.is_identical
        except InputError as error:
            self._store.add_event("warning", f"{error}")
            return
        cause, reason = self._incident.cause.value, self._incident.reason
        result = "identical to the last bit" if not different else f"{different} outputs differ"
        self._store.add_event("incident", f"{cause}: {reason} (repeated; {result})")


def _refuse(_: Input) -> None:
    raise InputError("This is a replay of what has happened. Nothing in it can be changed.")
