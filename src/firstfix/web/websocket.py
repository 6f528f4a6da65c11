"""``WS /v1/live``: one connection per viewer."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from starlette.websockets import WebSocket, WebSocketDisconnect

from firstfix.core.errors import InputError
from firstfix.web.access_control import AccessPolicy, client_of
from firstfix.web.broadcaster import Broadcaster, Viewer
from firstfix.web.commands import ClientMessage, Token
from firstfix.web.json_decoding import decode
from firstfix.web.page import READ_ONLY, Page
from firstfix.web.rate_limiter import WRONG_TOKEN, RateLimiter

# Close codes.
_NO_TOKEN = 4401
_TOO_MANY = 1013
_TOKEN_TIMEOUT_S = 5.0

# Commands of one viewer. Moving a slider sends thirty a second.
_COMMANDS_HZ = 30.0
_COMMAND_BURST = 60.0


async def serve_viewer(socket: WebSocket, broadcaster: Broadcaster, page: Page) -> None:
    """Serve a viewer until it disconnects.

    Parameters
    ----------
    socket : WebSocket
        The connection.
    broadcaster : Broadcaster
        The other viewers.
    page : Page
        What is shown, and who may see it.
    """
    await socket.accept()
    if not await _is_authenticated(socket, page.access):
        page.rate_limiter.charge(client_of(socket.scope), WRONG_TOKEN)
        await socket.close(_NO_TOKEN, "A token is needed.")
        return
    viewer = broadcaster.join()
    if viewer is None:
        await socket.close(_TOO_MANY, "There are too many viewers.")
        return
    sending = asyncio.create_task(_send(socket, viewer))
    try:
        await _receive_commands(socket, viewer, page)
    finally:
        broadcaster.leave(viewer)
        sending.cancel()
        with suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
            await sending


async def _is_authenticated(socket: WebSocket, access: AccessPolicy) -> bool:
    if access.token is None:
        return True
    try:
        text = await asyncio.wait_for(_next_text(socket), _TOKEN_TIMEOUT_S)
        message: Token = decode(text or "", Token)
    except (asyncio.TimeoutError, InputError):
        return False
    return access.accepts(message.token)


async def _send(socket: WebSocket, viewer: Viewer) -> None:
    while True:
        for frame in await viewer.next():
            if isinstance(frame, str):
                await socket.send_text(frame)
            else:
                await socket.send_bytes(frame)


async def _receive_commands(socket: WebSocket, viewer: Viewer, page: Page) -> None:
    rate_limiter = RateLimiter(_COMMANDS_HZ, _COMMAND_BURST)
    while (text := await _next_text(socket)) is not None:
        if not rate_limiter.admits(""):
            viewer.refuse("Too many commands. This one was ignored.")
            continue
        command = None
        try:
            message = decode(text, ClientMessage)
            command = f"{message.__struct_config__.tag}"
            await _execute(message, page)
        except InputError as error:
            viewer.refuse(str(error), command)


async def _execute(message: ClientMessage, page: Page) -> None:
    if isinstance(message, Token):
        return  # allowed where none is needed
    if not page.access.may_steer:
        raise InputError(READ_ONLY)
    # Planning a path through a large building takes a while.
    await asyncio.to_thread(page.executor.execute, message)


async def _next_text(socket: WebSocket) -> str | None:
    """Wait for a message; None if the viewer has disconnected."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        return None
    return message.get("text") or ""
