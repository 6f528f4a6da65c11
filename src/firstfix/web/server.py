"""The server: what is served where, and uvicorn under it."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import os
import socket
from collections.abc import AsyncIterator
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from firstfix.core.errors import InputError
from firstfix.web.access_control import AccessControl
from firstfix.web.api import Api
from firstfix.web.broadcaster import Broadcaster
from firstfix.web.page import Page
from firstfix.web.problem_details import HANDLERS
from firstfix.web.websocket import live

STATIC = Path(__file__).parent / "static"

# Connections at once: twenty viewers, what else they fetch, and some programs.
_MOST_CONNECTIONS = 128
# An order is short.
_MESSAGE_BYTES = 16 * 1024
_LAST_WORDS_S = 2
# A viewer who takes nothing for so long is gone, whatever its network still says.
_SILENT_MS = 60_000
# What waits in the system for a slow viewer is old when it comes: half a second of frames at most.
_SEND_BUFFER = 128 * 1024


def make_app(page: Page) -> ASGIApp:
    """Put a page together.

    Parameters
    ----------
    page : Page
        What it is about.

    Returns
    -------
    ASGI application
        For `run`, or another server.
    """
    broadcaster = Broadcaster(page.store, page.hello, page.greet)

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        showing = asyncio.create_task(broadcaster.run())
        yield
        showing.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await showing

    async def index(_: Request) -> Response:
        return FileResponse(STATIC / "index.html", headers={"cache-control": "no-cache"})

    async def watch(websocket: WebSocket) -> None:
        await live(websocket, broadcaster, page)

    routes = [
        Route("/", index),
        *Api(page, broadcaster).routes(),
        WebSocketRoute("/v1/live", watch),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    app = Starlette(routes=routes, lifespan=lifespan, exception_handlers=HANDLERS)
    return AccessControl(app, page.access, page.allowance)


def listen(host: str, port: int) -> socket.socket:
    """Open the port of the server, before anything else is begun.

    Parameters
    ----------
    host : str
        Name or address of this machine, as others shall reach it.
    port : int
        0 for any that is free.

    Returns
    -------
    socket
        Listening.

    Raises
    ------
    InputError
        If that cannot be.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.create_server(address[:2], family=family)
    except OSError as error:
        raise InputError(
            expected=f"port {port} of {host}, free and of this machine",
            received=_why(error),
            remedy="choose another --port or --host, or end what listens there",
        ) from error
    # Connections inherit these. asyncio sets the first only where it recognises the socket as TCP,
    # which this one does not say; without it every answer waits 40 ms for an acknowledgement.
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _SILENT_MS)
    return listening


def _why(error: OSError) -> str:
    """Return what the system says, without what Python adds to it."""
    if isinstance(error, socket.gaierror) or not error.errno:
        return f"{error.strerror or error}"
    return os.strerror(error.errno)


def url_of(listening: socket.socket) -> str:
    """Return where a browser finds the page."""
    host, port = listening.getsockname()[:2]
    if ipaddress.ip_address(host).is_unspecified:  # all addresses of this machine
        host = socket.gethostname()
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def make_server(page: Page) -> uvicorn.Server:
    """Make a server of a page.

    Parameters
    ----------
    page : Page
        What is served.

    Returns
    -------
    uvicorn.Server
        ``run(sockets=[listening])`` serves until a signal, or until ``should_exit`` is set.
    """
    config = uvicorn.Config(
        make_app(page),
        # Not every request: what was asked for is nobody's business.
        access_log=False,
        log_level="warning",
        # Those of the program around it stay as they are: setting up others would close them.
        log_config=None,
        http="h11",
        limit_concurrency=_MOST_CONNECTIONS,
        # Anybody can write them: a proxy that is to be believed would have to be named.
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=_LAST_WORDS_S,
        ws="websockets-sansio",
        ws_max_size=_MESSAGE_BYTES,
        # Floats do not get shorter, and each viewer would cost as much again.
        ws_per_message_deflate=False,
    )
    return uvicorn.Server(config)
