"""Everybody who looks on: what is new is made once and shown to all, newest wins."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable
from contextlib import suppress

from firstfix.web.binary_frames import particles_frame, scan_frame
from firstfix.web.messages import as_text, event_message, state_message
from firstfix.web.snapshot import Snapshot
from firstfix.web.snapshot_store import SnapshotStore
from firstfix.web.timeline import MOST_EVENTS

# Viewers see what a robot of 20 Hz says at once: a little less than its period.
PERIOD_S = 0.045
MOST_VIEWERS = 64

Frame = str | bytes

_log = logging.getLogger(__name__)


class Viewer:
    """What waits to be sent to one viewer: a frame of each kind, and some events."""

    def __init__(self) -> None:
        self._slots: dict[str, Frame] = {}
        self._texts: deque[str] = deque(maxlen=MOST_EVENTS)
        self._news = asyncio.Event()

    def show(self, kind: str, frame: Frame) -> None:
        """Put a frame in the place of the last of its kind."""
        self._slots[kind] = frame
        self._news.set()

    def tell(self, text: str) -> None:
        """Queue what should not be replaced; the oldest goes when there is too much."""
        self._texts.append(text)
        self._news.set()

    def refuse(self, detail: str) -> None:
        """Say why something that the viewer asked for is not done."""
        self.tell(as_text({"type": "error", "detail": detail}))

    async def next(self) -> list[Frame]:
        """Wait for something, and take all of it, in the order in which it makes sense."""
        await self._news.wait()
        self._news.clear()
        hello = self._slots.pop("hello", None)
        frames = [*([hello] if hello is not None else []), *self._texts, *self._slots.values()]
        self._texts.clear()
        self._slots.clear()
        return frames


class Broadcaster:
    """All viewers, and the task that shows them what is new.

    Parameters
    ----------
    store : SnapshotStore
        What there is to be seen.
    hello : callable
        Describes the robot and a map to a viewer.
    greet : callable
        Called when the first viewer comes.
    """

    def __init__(
        self, store: SnapshotStore, hello: Callable[[], str], greet: Callable[[], None]
    ) -> None:
        self._store = store
        self._hello = hello
        self._greet = greet
        self._is_greeted = False
        self._viewers: set[Viewer] = set()
        self._changed = asyncio.Event()
        self._shown = Snapshot()
        self._next_event = 0

    def __len__(self) -> int:
        return len(self._viewers)

    async def run(self) -> None:
        """Show what is new, at most so many times a second, until cancelled."""
        loop = asyncio.get_running_loop()

        def wake() -> None:
            with suppress(RuntimeError):  # the server has just ended
                loop.call_soon_threadsafe(self._changed.set)

        self._store.subscribe(wake)
        try:
            while True:
                await self._changed.wait()
                self._changed.clear()
                if self._viewers:
                    self._try_to_show_news()
                await asyncio.sleep(PERIOD_S)
        finally:
            self._store.unsubscribe(wake)

    def join(self) -> Viewer | None:
        """Let a viewer in, and show all that there is; None if there are too many already."""
        if len(self) >= MOST_VIEWERS:
            return None
        self._show_news()
        viewer = Viewer()
        self._viewers.add(viewer)
        viewer.show("hello", self._hello())
        for kind, frame in self._frames(self._shown, None).items():
            viewer.show(kind, frame)
        self._changed.set()  # the others see that there is one more
        if not self._is_greeted:
            self._is_greeted = True
            self._greet()
        return viewer

    def leave(self, viewer: Viewer) -> None:
        """Let a viewer go."""
        self._viewers.discard(viewer)
        self._changed.set()

    def _try_to_show_news(self) -> None:
        try:
            self._show_news()
        except Exception:  # noqa: BLE001 - viewers who see nothing more would not know why
            _log.exception("what there is to be seen could not be shown")

    def _show_news(self) -> None:
        before, snapshot = self._shown, self._store.snapshot
        self._shown = snapshot
        if snapshot.map is not before.map:
            self._show("hello", self._hello())
        for event in self._store.events(self._next_event):
            self._next_event = event.number + 1
            text = as_text(event_message(event))
            for viewer in self._viewers:
                viewer.tell(text)
        for kind, frame in self._frames(snapshot, before).items():
            self._show(kind, frame)

    def _show(self, kind: str, frame: Frame) -> None:
        for viewer in self._viewers:
            viewer.show(kind, frame)

    def _frames(self, snapshot: Snapshot, before: Snapshot | None) -> dict[str, Frame]:
        """Make the frames that differ from those of a snapshot before; all if there was none."""
        frames: dict[str, Frame] = {"state": as_text(state_message(snapshot, len(self)))}
        if before is None or before.scan is not snapshot.scan:
            frames["scan"] = scan_frame(snapshot.scan, snapshot.map)
        if (
            before is None
            or before.particles is not snapshot.particles
            or before.pose != snapshot.pose
        ):
            frames["particles"] = particles_frame(snapshot.particles, snapshot.pose, snapshot.stamp)
        return frames
