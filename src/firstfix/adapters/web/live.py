"""One WebSocket for each viewer: what is new is made once and sent to all, newest wins."""

from __future__ import annotations

import asyncio
import json
from collections import deque
from collections.abc import Callable
from contextlib import suppress

from starlette.websockets import WebSocket, WebSocketDisconnect

from firstfix.adapters.web.feed import MOST_EVENTS, Feed
from firstfix.adapters.web.frames import (
    as_text,
    event_object,
    particles_frame,
    scan_frame,
    state_object,
)
from firstfix.adapters.web.orders import order_of
from firstfix.adapters.web.steering import Steering
from firstfix.adapters.web.view import ShownMap, View
from firstfix.core.errors import InputError

PERIOD_S = 0.05
MOST_VIEWERS = 64

Frame = str | bytes


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

    async def next(self) -> list[Frame]:
        """Wait for something, and take all of it, in the order in which it makes sense."""
        await self._news.wait()
        self._news.clear()
        hello = self._slots.pop("hello", None)
        frames = [*([hello] if hello is not None else []), *self._texts, *self._slots.values()]
        self._texts.clear()
        self._slots.clear()
        return frames


class Hub:
    """All viewers, and the task that shows them what is new.

    Parameters
    ----------
    feed : Feed
        What there is to be seen.
    hello : callable
        Describes the robot and a map to a viewer.
    """

    def __init__(self, feed: Feed, hello: Callable[[], str]) -> None:
        self._feed = feed
        self._hello = hello
        self._viewers: set[Viewer] = set()
        self._changed = asyncio.Event()
        self._shown_map: ShownMap | None = None
        self._shown: View | None = None
        self._next_event = 0

    def __len__(self) -> int:
        return len(self._viewers)

    async def run(self) -> None:
        """Show what is new, at most so many times a second, until cancelled."""
        loop = asyncio.get_running_loop()
        self._feed.listen(lambda: loop.call_soon_threadsafe(self._changed.set))
        while True:
            await self._changed.wait()
            self._changed.clear()
            if self._viewers:
                self._show_news()
            await asyncio.sleep(PERIOD_S)

    def join(self) -> Viewer:
        """Let a viewer in, and show all that there is."""
        viewer = Viewer()
        self._show_news()
        self._viewers.add(viewer)
        viewer.show("hello", self._hello())
        for kind, frame in self._frames(None).items():
            viewer.show(kind, frame)
        self._changed.set()  # the others see that there is one more
        return viewer

    def leave(self, viewer: Viewer) -> None:
        """Let a viewer go."""
        self._viewers.discard(viewer)
        self._changed.set()

    def _show_news(self) -> None:
        if self._feed.map is not self._shown_map:
            self._shown_map, self._shown = self._feed.map, None
            hello = self._hello()
            for viewer in self._viewers:
                viewer.show("hello", hello)
        events = self._feed.events(self._next_event)
        for event in events:
            text = as_text(event_object(event))
            self._next_event = event.number + 1
            for viewer in self._viewers:
                viewer.tell(text)
        frames = self._frames(self._shown)
        self._shown = self._feed.view
        for viewer in self._viewers:
            for kind, frame in frames.items():
                viewer.show(kind, frame)

    def _frames(self, before: View | None) -> dict[str, Frame]:
        """Make the frames that differ from those of a view before."""
        view, shown = self._feed.view, self._feed.map
        frames: dict[str, Frame] = {"state": as_text(state_object(view, len(self)))}
        if shown is not None and (before is None or before.placed is not view.placed):
            frames["scan"] = scan_frame(view.placed, shown.locator)
        if before is None or before.belief is not view.belief or before.pose is not view.pose:
            frames["particles"] = particles_frame(view.belief, view.pose, view.stamp)
        return frames


async def live(socket: WebSocket, hub: Hub, steering: Steering | None) -> None:
    """Serve a viewer until it goes.

    Parameters
    ----------
    socket : WebSocket
        Of the viewer, accepted.
    hub : Hub
        Who else looks on.
    steering : Steering or None
        Carries out what the viewer asks for; None for one who may only watch.
    """
    viewer = hub.join()
    sending = asyncio.create_task(_send(socket, viewer))
    try:
        while True:
            await _take_order(await socket.receive_text(), viewer, steering)
    except (WebSocketDisconnect, KeyError):
        pass
    finally:
        sending.cancel()
        hub.leave(viewer)
        with suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
            await sending


async def _send(socket: WebSocket, viewer: Viewer) -> None:
    while True:
        for frame in await viewer.next():
            if isinstance(frame, str):
                await socket.send_text(frame)
            else:
                await socket.send_bytes(frame)


async def _take_order(text: str, viewer: Viewer, steering: Steering | None) -> None:
    try:
        if steering is None:
            raise InputError(
                expected="a viewer who may steer",
                received="one who may only watch",
                remedy="start firstfix without --read-only",
            )
        order = order_of(_parsed(text))
        # Planning a way through a large building takes a while.
        await asyncio.to_thread(steering.obey, order)
    except InputError as error:
        viewer.tell(as_text({"type": "error", "detail": str(error)}))


def _parsed(text: str) -> object:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            expected="JSON", received=f"{text[:40]!r}", remedy="see docs/live.md"
        ) from error
