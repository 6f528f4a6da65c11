"""One WebSocket for each viewer."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from starlette.websockets import WebSocket, WebSocketDisconnect

from firstfix.core.errors import InputError
from firstfix.web.access_control import AccessPolicy, client_of
from firstfix.web.broadcaster import Broadcaster, Viewer
from firstfix.web.commands import decode_command
from firstfix.web.page import Page
from firstfix.web.rate_limiter import WRONG_TOKEN, RateLimiter
from firstfix.web.strict_json import parsed

# Codes by which the server ends a connection.
_NO_TOKEN = 4401
_TOO_MANY = 1013
_TOKEN_S = 5.0

# Messages of one viewer; a hand on a slider makes thirty a second.
_ORDERS_HZ = 30.0
_ORDERS_AT_ONCE = 60.0


async def live(socket: WebSocket, broadcaster: Broadcaster, page: Page) -> None:
    """Serve a viewer until it goes.

    Parameters
    ----------
    socket : WebSocket
        Of the viewer.
    broadcaster : Broadcaster
        Who else looks on.
    page : Page
        What there is to be seen, and who may see it.
    """
    await socket.accept()
    if not await _knows_token(socket, page.access):
        page.allowance.charge(client_of(socket.scope), WRONG_TOKEN)
        await socket.close(_NO_TOKEN, "a token is needed")
        return
    viewer = broadcaster.join()
    if viewer is None:
        await socket.close(_TOO_MANY, "too many viewers")
        return
    sending = asyncio.create_task(_send(socket, viewer))
    try:
        await _take_orders(socket, viewer, page)
    finally:
        broadcaster.leave(viewer)
        sending.cancel()
        with suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
            await sending


async def _knows_token(socket: WebSocket, access: AccessPolicy) -> bool:
    if access.token is None:
        return True
    try:
        text = await asyncio.wait_for(_next_text(socket), _TOKEN_S)
        message = parsed(text or "")
    except (asyncio.TimeoutError, InputError):
        return False
    token = message.get("token") if isinstance(message, dict) else None
    return isinstance(token, str) and access.knows(token)


async def _send(socket: WebSocket, viewer: Viewer) -> None:
    while True:
        for frame in await viewer.next():
            if isinstance(frame, str):
                await socket.send_text(frame)
            else:
                await socket.send_bytes(frame)


async def _take_orders(socket: WebSocket, viewer: Viewer, page: Page) -> None:
    allowance = RateLimiter(_ORDERS_HZ, _ORDERS_AT_ONCE)
    while (text := await _next_text(socket)) is not None:
        if allowance.takes(""):
            await _take_order(text, viewer, page)
        else:
            viewer.refuse("too many messages: this one was passed over")


async def _take_order(text: str, viewer: Viewer, page: Page) -> None:
    try:
        await _execute(parsed(text), page)
    except InputError as error:
        viewer.refuse(str(error))


async def _execute(message: object, page: Page) -> None:
    if isinstance(message, dict) and message.get("type") == "token":
        return  # welcome, though none is needed
    order = decode_command(message)
    if not page.access.may_steer:
        raise InputError(
            expected="viewers who watch",
            received=f"one who wants to steer ({order.kind})",
            remedy="start firstfix without --read-only",
        )
    # Planning a way through a large building takes a while.
    await asyncio.to_thread(page.executor.execute, order)


async def _next_text(socket: WebSocket) -> str | None:
    """Wait for a message; None if the viewer has gone."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        return None
    return message.get("text") or ""
