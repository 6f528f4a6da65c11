"""The bridge between a localizer and a fleet control: an MQTT client in its own thread."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
import time
from collections.abc import Callable, Coroutine
from datetime import datetime, timezone
from typing import Any

import aiomqtt

from firstfix.core.errors import InputError
from firstfix.localizer.inputs import Input
from firstfix.localizer.outputs import Output, TrackedPose
from firstfix.site.floors import AnyLocalizer, SiteLocalizer
from firstfix.vda5050.actions import Actions
from firstfix.vda5050.broker import Broker
from firstfix.vda5050.encoder import Encoder
from firstfix.vda5050.identity import Identity
from firstfix.vda5050.localization import Localization, is_driving
from firstfix.vda5050.maps import MapRegister
from firstfix.vda5050.report import Report

# How often the bridge looks at the localizer, s: poses are published as often, and events at once.
_PERIOD_S = 0.2
# A state while nothing happens, s; the specification asks for one every 30 s at the latest.
_STATE_S = 1.0
# Between attempts to connect, s; doubled each time.
_FIRST_PAUSE_S = 0.5
_LONGEST_PAUSE_S = 30.0
# The specification suggests a heartbeat of about 15 s.
_KEEPALIVE_S = 15
_TIMEOUT_S = 10.0
# A flood of messages is dropped beyond this many in the queue.
_MOST_WAITING = 100
# A warning on one subject is repeated after this time at the earliest, s.
_REPEAT_S = 10.0
_END_S = 5.0
# The client logs each message of a flood; what people need to know is logged here.
_SILENT = logging.getLogger("firstfix.vda5050.mqtt")
_SILENT.disabled = True


class Bridge:
    """Context manager that publishes what a localizer finds, and accepts poses for it.

    It is called with each input and its outputs, in the localizer's thread, and only stores
    references there. A broker that is away does not disturb the localizer.

    Parameters
    ----------
    broker : Broker
        Where to connect.
    identity : Identity
        Who the robot is.
    maps : MapRegister
        Names of the maps.
    log : callable
        Receives lines for people, from the thread of the bridge.
    """

    def __init__(
        self,
        broker: Broker,
        identity: Identity,
        maps: MapRegister,
        log: Callable[[str], None],
    ) -> None:
        self._broker, self._identity, self._maps, self._log = broker, identity, maps, log
        self._tls = broker.tls_context()
        self._localization = Localization()
        self._actions = Actions(maps, self._localization)
        self._encoder = Encoder(identity)
        self._give: Callable[[Input], None] | None = None
        self._lock = threading.Lock()
        self._logged_at: dict[str, float] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._task: asyncio.Task[None] | None = None
        self._news = asyncio.Event()
        self._has_moved = False
        self._is_ending = False
        self._has_begun = threading.Event()
        self._thread = threading.Thread(target=self._run, name="vda5050", daemon=True)

    def __enter__(self) -> Bridge:
        self._thread.start()
        self._has_begun.wait()
        return self

    def __exit__(self, *_: object) -> None:
        if self._loop is not None:
            with contextlib.suppress(RuntimeError):  # it has ended
                self._loop.call_soon_threadsafe(self._end)
        self._thread.join(_END_S)

    def attach(self, give: Callable[[Input], None]) -> None:
        """Set the function that takes inputs for the localizer, from any thread."""
        self._give = give

    def __call__(self, given: Input, outputs: list[Output], localizer: AnyLocalizer) -> None:
        """Take over what an input led to; called by the localizer's thread."""
        now = time.monotonic()
        with self._lock:
            self._note_map(localizer)
            self._actions.observe(given, outputs)
            self._localization.observe(given, outputs, now)
            self._has_moved |= any(isinstance(output, TrackedPose) for output in outputs)
        # The bridge is not woken: it would compete with the localizer for the interpreter.

    def _note_map(self, localizer: AnyLocalizer) -> None:
        in_use, matcher = self._maps.in_use, localizer.matcher
        if isinstance(localizer, SiteLocalizer):
            if not self._maps.has_site or self._maps.id_in_use != localizer.map_id:
                self._maps.receive_site(localizer.site.contents, localizer.map_id)
        elif matcher is not None and (in_use is None or in_use.grid is not matcher.fields.grid):
            self._maps.receive(matcher.fields.grid)

    # ---- the thread of the bridge

    def _end(self) -> None:
        self._is_ending = True
        self._news.set()
        if self._task is not None:
            self._task.cancel()

    def _run(self) -> None:
        with contextlib.suppress(asyncio.CancelledError):
            asyncio.run(self._stay_connected())

    async def _stay_connected(self) -> None:
        self._loop, self._task = asyncio.get_running_loop(), asyncio.current_task()
        self._has_begun.set()
        pause_s = _FIRST_PAUSE_S
        while not self._is_ending:
            began = time.monotonic()
            try:
                async with self._client() as client:
                    self._log(f"VDA 5050: connected to {self._broker}")
                    await self._converse(client)
            except (aiomqtt.MqttError, OSError, ValueError) as error:
                text = f"VDA 5050: no connection to {self._broker}: {error}"
                self._warn("connection", f"{text}. Localization goes on; trying again.")
            if time.monotonic() - began > _LONGEST_PAUSE_S:
                pause_s = _FIRST_PAUSE_S
            await asyncio.sleep(pause_s)
            pause_s = min(_LONGEST_PAUSE_S, 2.0 * pause_s)

    def _client(self) -> aiomqtt.Client:
        name = self._identity.topic("connection")
        will = aiomqtt.Will(name, self._encoder.connection("BROKEN", _now()), qos=1, retain=True)
        return aiomqtt.Client(
            self._broker.host,
            self._broker.port,
            username=self._broker.user,
            password=self._broker.password,
            identifier=f"firstfix-{self._identity.manufacturer}-{self._identity.serial_number}",
            will=will,
            timeout=_TIMEOUT_S,
            keepalive=_KEEPALIVE_S,
            tls_context=self._tls,
            max_queued_incoming_messages=_MOST_WAITING,
            logger=_SILENT,
        )

    async def _converse(self, client: aiomqtt.Client) -> None:
        try:  # the end may come at any of these steps
            await self._publish_connection(client, "ONLINE")
            await client.subscribe(self._identity.topic("instantActions"), qos=0)
            await _first_to_end(self._listen(client), self._speak(client))
        finally:
            if self._is_ending:
                with contextlib.suppress(aiomqtt.MqttError):
                    await self._publish_connection(client, "OFFLINE")

    async def _publish_connection(self, client: aiomqtt.Client, state: str) -> None:
        message = self._encoder.connection(state, _now())
        await client.publish(self._identity.topic("connection"), message, qos=1, retain=True)

    async def _listen(self, client: aiomqtt.Client) -> None:
        async for message in client.messages:
            payload = message.payload
            if message.retain or not isinstance(payload, bytes):
                self._warn("retained", "VDA 5050: retained instant actions are ignored")
                continue
            try:
                self._receive(payload)
            except InputError as error:
                self._warn("message", f"VDA 5050: {error}")
            self._news.set()

    def _receive(self, payload: bytes) -> None:
        with self._lock:
            inputs = self._actions.receive(payload)
        for given in inputs:
            if self._give is not None:
                self._give(given)

    async def _speak(self, client: aiomqtt.Client) -> None:
        before: Any = None
        shown_at = stated_at = -_STATE_S
        has_moved = False
        self._news.set()
        while not self._is_ending:  # a client's wait may swallow that it is cancelled
            timer = asyncio.get_running_loop().call_later(_PERIOD_S, self._news.set)
            await self._news.wait()
            timer.cancel()
            self._news.clear()
            report, moved_since = self._take_report()
            has_moved = has_moved or moved_since
            now, events = time.monotonic(), _events(report)
            if events != before or now - stated_at >= _STATE_S:
                message = self._encoder.state(report, _now())
                await client.publish(self._identity.topic("state"), message, qos=0)
                before, stated_at = events, now
            if has_moved and now - shown_at >= _PERIOD_S:
                message = self._encoder.visualization(report, _now())
                await client.publish(self._identity.topic("visualization"), message, qos=0)
                shown_at, has_moved = now, False

    def _take_report(self) -> tuple[Report, bool]:
        now = time.monotonic()
        with self._lock:
            localization, velocity = self._localization, self._localization.velocity()
            error = localization.error(now)
            report = Report(
                position=localization.position(self._maps.id_in_use, now),
                status=localization.status(now),
                velocity=velocity,
                is_driving=is_driving(velocity),
                last_node_id=self._actions.last_node_id,
                maps=self._maps.entries,
                actions=self._actions.reports,
                errors=(*self._actions.errors, *((error,) if error is not None else ())),
            )
            has_moved, self._has_moved = self._has_moved, False
        return report, has_moved

    def _warn(self, subject: str, text: str) -> None:
        """Log a line, unless this subject had one less than 10 s ago."""
        now = time.monotonic()
        if now - self._logged_at.get(subject, -_REPEAT_S) >= _REPEAT_S:
            self._logged_at[subject] = now
            self._log(" ".join(text.split()))


def _events(report: Report) -> tuple[Any, ...]:
    """Return what a state is published for at once."""
    errors = tuple((error.problem, error.references) for error in report.errors)
    position = (report.position.map_id, report.position.is_localized)
    return position, report.is_driving, report.maps, report.actions, errors, report.last_node_id


async def _first_to_end(*tasks: Coroutine[Any, Any, None]) -> None:
    """Run tasks until one ends or fails, and cancel the others."""
    running = [asyncio.ensure_future(task) for task in tasks]
    try:
        done, _ = await asyncio.wait(running, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in running:
            task.cancel()
        await asyncio.gather(*running, return_exceptions=True)


def _now() -> datetime:
    return datetime.now(timezone.utc)
