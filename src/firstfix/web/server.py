"""The server: the ASGI application and uvicorn."""

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
from firstfix.web.websocket import serve_viewer

STATIC = Path(__file__).parent / "static"

# Twenty viewers, their other requests, and some programs.
_MOST_CONNECTIONS = 128
_MESSAGE_BYTES = 16 * 1024
_SHUTDOWN_S = 2
# A connection whose peer acknowledges nothing for this long is closed.
_SILENT_MS = 60_000
# Frames in the kernel's buffer are stale when a slow viewer receives them: half a second at most.
_SEND_BUFFER = 128 * 1024


def make_app(page: Page) -> ASGIApp:
    """Make the ASGI application of a page.

    Parameters
    ----------
    page : Page
        What it serves.

    Returns
    -------
    ASGI application
        For uvicorn or another server.
    """
    broadcaster = Broadcaster(page.store, page.hello, page.on_first_viewer)

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        broadcasting = asyncio.create_task(broadcaster.run())
        yield
        broadcasting.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await broadcasting

    async def index(_: Request) -> Response:
        return FileResponse(STATIC / "index.html", headers={"cache-control": "no-cache"})

    async def viewer(websocket: WebSocket) -> None:
        await serve_viewer(websocket, broadcaster, page)

    routes = [
        Route("/", index),
        *Api(page, broadcaster).routes(),
        WebSocketRoute("/v1/live", viewer),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    app = Starlette(routes=routes, lifespan=lifespan, exception_handlers=HANDLERS)
    return AccessControl(app, page.access, page.rate_limiter)


def listen(host: str, port: int) -> socket.socket:
    """Open the port of the server.

    Parameters
    ----------
    host : str
        Name or address of this machine.
    port : int
        0 for any free port.

    Returns
    -------
    socket
        Listening.

    Raises
    ------
    InputError
        If the port cannot be opened.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.create_server(address[:2], family=family)
    except OSError as error:
        raise InputError(
            f"Cannot listen on port {port} of {host}: {_why(error)}. Choose another --port or "
            "--host, or stop the program that uses it."
        ) from error
    # Connections inherit these options. asyncio sets TCP_NODELAY only on sockets that name TCP as
    # their protocol, and this one does not; without it each response waits 40 ms.
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _SILENT_MS)
    return listening


def _why(error: OSError) -> str:
    """Return the message of the operating system."""
    if isinstance(error, socket.gaierror) or not error.errno:
        return f"{error.strerror or error}"
    return os.strerror(error.errno)


def url_of(listening: socket.socket) -> str:
    """Return the URL of the page."""
    host, port = listening.getsockname()[:2]
    if ipaddress.ip_address(host).is_unspecified:  # all addresses of this machine
        host = socket.gethostname()
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def make_server(page: Page) -> uvicorn.Server:
    """Make a server of a page.

    Parameters
    ----------
    page : Page
        What it serves.

    Returns
    -------
    uvicorn.Server
        ``run(sockets=[listening])`` serves until a signal, or until ``should_exit`` is set.
    """
    return server_of(make_app(page))


def server_of(app: ASGIApp, most_connections: int = _MOST_CONNECTIONS) -> uvicorn.Server:
    """Make a server of an ASGI application, as `make_server`."""
    config = uvicorn.Config(
        app,
        access_log=False,
        log_level="warning",
        # uvicorn's own configuration would close the log handlers of the program.
        log_config=None,
        http="h11",
        limit_concurrency=most_connections,
        # Any client can forge these headers.
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=_SHUTDOWN_S,
        ws="websockets-sansio",
        ws_max_size=_MESSAGE_BYTES,
        # Floats hardly compress, and each viewer would be compressed for separately.
        ws_per_message_deflate=False,
    )
    return uvicorn.Server(config)
