"""Broadcasting snapshots: each frame is made once for all viewers, and the newest wins."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable
from contextlib import suppress

from firstfix.web.binary_frames import belief_frame, particles_frame, scan_frame
from firstfix.web.messages import Refusal, Status, encode_text
from firstfix.web.snapshot import Snapshot
from firstfix.web.snapshot_store import SnapshotStore
from firstfix.web.timeline import MOST_EVENTS

# A little less than the period of a robot at 20 Hz, so that each of its scans is sent at once.
PERIOD_S = 0.045
MOST_VIEWERS = 64

Frame = str | bytes

_log = logging.getLogger(__name__)


class Viewer:
    """The send buffer of one viewer: the newest frame of each kind, and the last events."""

    def __init__(self) -> None:
        self._newest: dict[str, Frame] = {}
        self._texts: deque[str] = deque(maxlen=MOST_EVENTS)
        self._filled = asyncio.Event()

    def replace(self, kind: str, frame: Frame) -> None:
        """Buffer a frame instead of the last one of its kind."""
        self._newest[kind] = frame
        self._filled.set()

    def append(self, text: str) -> None:
        """Buffer a message that must not be replaced; beyond the limit the oldest is dropped."""
        self._texts.append(text)
        self._filled.set()

    def refuse(self, detail: str, command: str | None = None) -> None:
        """Report why a command of the viewer was not executed; `command` is its tag, if known."""
        self.append(encode_text(Refusal(detail, command)))

    async def next(self) -> list[Frame]:
        """Wait until there is something, and take everything in the order of sending."""
        await self._filled.wait()
        self._filled.clear()
        hello = self._newest.pop("hello", None)
        frames = [*([hello] if hello is not None else []), *self._texts, *self._newest.values()]
        self._texts.clear()
        self._newest.clear()
        return frames


class Broadcaster:
    """The connected viewers, and the task that sends them what is new.

    Parameters
    ----------
    store : SnapshotStore
        What is sent.
    hello : callable
        Returns the first message to a viewer.
    on_first_viewer : callable
        Called when the first viewer connects.
    """

    def __init__(
        self,
        store: SnapshotStore,
        hello: Callable[[], str],
        on_first_viewer: Callable[[], None],
    ) -> None:
        self._store = store
        self._hello = hello
        self._on_first_viewer = on_first_viewer
        self._had_viewers = False
        self._viewers: set[Viewer] = set()
        self._changed = asyncio.Event()
        self._sent = Snapshot()
        self._sent_heat = b""
        self._next_event = 0

    def __len__(self) -> int:
        return len(self._viewers)

    async def run(self) -> None:
        """Broadcast what is new, at most once per period, until cancelled."""
        loop = asyncio.get_running_loop()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop has just been closed
                loop.call_soon_threadsafe(self._changed.set)

        self._store.subscribe(wake)
        try:
            while True:
                await self._changed.wait()
                self._changed.clear()
                if self._viewers:
                    self._try_to_broadcast()
                await asyncio.sleep(PERIOD_S)
        finally:
            self._store.unsubscribe(wake)

    def join(self) -> Viewer | None:
        """Add a viewer and send it everything; None if there are too many."""
        if len(self) >= MOST_VIEWERS:
            return None
        self._broadcast()
        viewer = Viewer()
        self._viewers.add(viewer)
        viewer.replace("hello", self._hello())
        for kind, frame in self._frames(self._sent, None).items():
            viewer.replace(kind, frame)
        self._changed.set()  # the count of viewers has changed
        if not self._had_viewers:
            self._had_viewers = True
            self._on_first_viewer()
        return viewer

    def leave(self, viewer: Viewer) -> None:
        """Remove a viewer."""
        self._viewers.discard(viewer)
        self._changed.set()

    def _try_to_broadcast(self) -> None:
        try:
            self._broadcast()
        except Exception:  # noqa: BLE001 - the next snapshot may work
            _log.exception("A snapshot could not be sent to the viewers.")

    def _broadcast(self) -> None:
        before, snapshot = self._sent, self._store.snapshot
        self._sent = snapshot
        if snapshot.map is not before.map:
            self._replace("hello", self._hello())
        for event in self._store.events(self._next_event):
            self._next_event = event.number + 1
            text = encode_text(event)
            for viewer in self._viewers:
                viewer.append(text)
        for kind, frame in self._frames(snapshot, before).items():
            self._replace(kind, frame)

    def _replace(self, kind: str, frame: Frame) -> None:
        for viewer in self._viewers:
            viewer.replace(kind, frame)

    def _frames(self, snapshot: Snapshot, before: Snapshot | None) -> dict[str, Frame]:
        """Encode what differs from an earlier snapshot; everything if there was none."""
        frames: dict[str, Frame] = {"state": encode_text(Status.of(snapshot, len(self)))}
        if before is None or before.scan is not snapshot.scan:
            frames["scan"] = scan_frame(snapshot.scan, snapshot.map)
        moved = before is None or before.pose != snapshot.pose
        if moved or before is None or before.particles is not snapshot.particles:
            frames["particles"] = particles_frame(snapshot.particles, snapshot.pose, snapshot.stamp)
        if before is None or before.belief is not snapshot.belief:
            heat = belief_frame(snapshot.belief, snapshot.map)
            if before is None or heat != self._sent_heat:  # it changes less often than the belief
                frames["belief"] = self._sent_heat = heat
        return frames
