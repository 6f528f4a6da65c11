"""The server: routes, and uvicorn under them."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from firstfix.adapters.web.feed import Feed
from firstfix.adapters.web.frames import as_text, hello_object, map_object, state_object
from firstfix.adapters.web.live import Hub, live
from firstfix.adapters.web.map_image import MOST_PIXELS, MapPictures
from firstfix.adapters.web.steering import Steering

STATIC = Path(__file__).parent / "static"


@dataclass(frozen=True, eq=False)
class Page:
    """The page and the API of one robot."""

    robot: str
    feed: Feed
    steering: Steering
    may_steer: bool = True
    pictures: MapPictures = field(default_factory=MapPictures)

    def hello(self) -> str:
        return as_text(
            hello_object(
                self.robot,
                self.steering.abilities,
                self.feed.map,
                self.feed.events(),
                may_steer=self.may_steer,
            )
        )


def make_app(page: Page) -> Starlette:
    hub = Hub(page.feed, page.hello)

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        task = asyncio.create_task(hub.run())
        yield
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task

    async def index(_: Request) -> Response:
        return FileResponse(STATIC / "index.html")

    async def status(_: Request) -> Response:
        return Response(
            as_text(state_object(page.feed.view, len(hub))), media_type="application/json"
        )

    async def map_(_: Request) -> Response:
        return JSONResponse(map_object(page.feed.map))

    async def map_png(request: Request) -> Response:
        png = await run_in_threadpool(page.pictures.png, page.feed.map, MOST_PIXELS)
        return Response(png, media_type="image/png")

    async def live_(socket: WebSocket) -> None:
        await socket.accept()
        await live(socket, hub, page.steering if page.may_steer else None)

    return Starlette(
        routes=[
            Route("/", index),
            Route("/v1/status", status),
            Route("/v1/map", map_),
            Route("/v1/map.png", map_png),
            WebSocketRoute("/v1/live", live_),
            Mount("/static", StaticFiles(directory=STATIC)),
        ],
        lifespan=lifespan,
    )


def serve(app: Starlette, listening: socket.socket) -> None:
    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        ws="websockets-sansio",
        ws_per_message_deflate=False,
        ws_max_size=16 * 1024,
        timeout_graceful_shutdown=2,
        server_header=False,
    )
    uvicorn.Server(config).run(sockets=[listening])
