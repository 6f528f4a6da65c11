"""All viewers receive the same, each frame is made once, and a slow viewer delays no other."""

from __future__ import annotations

import asyncio
import socket
from contextlib import ExitStack
from dataclasses import replace
from urllib.parse import urlsplit

import pytest
from live_lab import Drive, Site, drive, fed, until
from viewer_lab import PATIENCE_S, connect, kind_of, next_of, stamp_of
from websockets.asyncio.client import connect as connect_async
from websockets.exceptions import ConnectionClosed

from firstfix.web.broadcaster import MOST_VIEWERS, Broadcaster, Viewer
from firstfix.web.timeline import MOST_EVENTS

ASLEEP = 20


@pytest.fixture(scope="module")
def office() -> Drive:
    begun = drive("office")
    begun.step(ASLEEP + 1)
    return begun


@pytest.fixture
def site(office: Drive):
    with fed(store=office.store) as site:
        yield site


def reached(site: Site) -> socket.socket:
    return socket.create_connection(("127.0.0.1", urlsplit(site.url).port))


@pytest.mark.slow
def test_a_viewer_that_does_not_read_delays_no_other():
    """Its frames are dropped; when it reads again, it receives the newest."""
    office = drive("office")
    office.step(ASLEEP + 1)
    view = office.store.snapshot
    with fed(store=office.store) as site, reached(site) as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 32 * 1024)
        deaf.sendall(
            b"GET /v1/live HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
            b"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
        )
        with connect(site.live) as viewer:
            until(lambda: next_of(viewer, "state")["viewers"] == 2)
            for i in range(30):  # 30 kB each: far more than the buffers between them hold
                office.store._snapshot = replace(view, stamp=1000.0 + i, scan=replace(view.scan))
                office.store.add_event("person", f"{i}")
                until(lambda i=i: next_of(viewer, "state")["stamp"] == 1000.0 + i)
        deaf.settimeout(PATIENCE_S)
        received = 0
        tail = b""
        while b'"stamp":1029.0,"state"' not in tail:
            part = deaf.recv(65536)
            received += len(part)
            tail = tail[-100:] + part
        assert received < 20 * 30_000


def test_the_send_buffer_of_a_viewer_is_bounded():
    async def scenario() -> list:
        viewer = Viewer()
        for i in range(10_000):
            viewer.replace("state", f"state {i}")
            viewer.replace("scan", b"scan %d" % i)
            viewer.append(f"event {i}")
            viewer.replace("hello", f"hello {i}")
        return await viewer.next()

    frames = asyncio.run(scenario())
    assert frames[0] == "hello 9999"
    assert frames[1:-2] == [f"event {i}" for i in range(10_000 - MOST_EVENTS, 10_000)]
    assert frames[-2:] == ["state 9999", b"scan 9999"]


def test_twenty_viewers_receive_the_same(site: Site, office: Drive):
    async def watch(until_stamp: float) -> list[bytes]:
        seen = []
        async with connect_async(site.live, max_queue=None, close_timeout=2.0) as viewer:
            async for message in viewer:
                if kind_of(message) == "scan":
                    seen.append(message)
                if kind_of(message) == "state" and stamp_of(message) >= until_stamp:
                    return seen
        return seen

    async def all_of_them(last: float) -> list[list[bytes]]:
        watching = [asyncio.create_task(watch(last)) for _ in range(20)]
        while not all(task.done() for task in watching):
            if office.store.snapshot.stamp < last:
                await asyncio.to_thread(office.step)
            await asyncio.sleep(0.02)
        return [task.result() for task in watching]

    last = office.store.snapshot.stamp + 3.0
    seen = asyncio.run(asyncio.wait_for(all_of_them(last), 60.0))
    assert len(seen) == 20
    common = set(seen[0]).intersection(*seen[1:])
    assert len(common) >= 5
    assert all(len(frames) <= 40 for frames in seen)


def test_frames_are_encoded_once_for_all_viewers_and_never_without_viewers(
    monkeypatch: pytest.MonkeyPatch,
):
    made = []
    monkeypatch.setattr(
        "firstfix.web.broadcaster.scan_frame", lambda *_: made.append(1) or b"\x01" * 16
    )
    begun = drive("house")
    broadcaster = Broadcaster(begun.store, lambda: "hello", lambda: None)

    async def scenario() -> None:
        running = asyncio.create_task(broadcaster.run())
        await asyncio.sleep(0.01)
        begun.step(ASLEEP + 5)
        await asyncio.sleep(0.2)
        assert made == []
        viewers = [broadcaster.join() for _ in range(5)]
        made.clear()
        begun.step()
        await asyncio.sleep(0.2)
        assert len(made) == 1
        for viewer in viewers:
            assert b"\x01" * 16 in await viewer.next()
        running.cancel()

    asyncio.run(scenario())


def test_an_internal_error_does_not_stop_the_broadcast(caplog: pytest.LogCaptureFixture):
    begun = drive("house")
    broadcaster = Broadcaster(begun.store, lambda: "hello", lambda: None)

    async def scenario() -> None:
        running = asyncio.create_task(broadcaster.run())
        viewer = broadcaster.join()
        await viewer.next()
        right, begun.store._snapshot = (
            begun.store._snapshot,
            replace(begun.store.snapshot, evidence=object()),
        )
        begun.store.add_event("person", "something odd")
        await asyncio.sleep(0.1)
        begun.store._snapshot = right
        begun.store.add_event("person", "all well")
        await asyncio.sleep(0.2)
        assert any("all well" in text for text in await viewer.next())
        running.cancel()

    asyncio.run(scenario())
    assert "could not be sent" in caplog.text


def test_the_first_viewer_is_reported_once():
    greeted = []
    begun = drive("house")

    async def scenario() -> None:
        broadcaster = Broadcaster(begun.store, lambda: "hello", lambda: greeted.append(1))
        broadcaster.leave(broadcaster.join())
        broadcaster.leave(broadcaster.join())

    asyncio.run(scenario())
    assert greeted == [1]


@pytest.mark.slow
def test_the_number_of_viewers_is_limited(site: Site):
    with ExitStack() as stack:
        for _ in range(MOST_VIEWERS):
            stack.enter_context(connect(site.live)).recv(PATIENCE_S)
        with connect(site.live) as late, pytest.raises(ConnectionClosed) as ended:
            late.recv(PATIENCE_S)
        assert ended.value.rcvd.code == 1013
    with connect(site.live) as again:
        assert next_of(again, "hello")
