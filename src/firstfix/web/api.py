"""The HTTP API; openapi.py describes it."""

from __future__ import annotations

from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from firstfix.web.broadcaster import Broadcaster
from firstfix.web.commands import POSE, Command, checked
from firstfix.web.locate_queue import LocateQueue
from firstfix.web.map_png import LEAST_PIXELS, MOST_PIXELS, cells_per_pixel
from firstfix.web.messages import as_text, map_object, state_message
from firstfix.web.openapi import document
from firstfix.web.page import Page
from firstfix.web.request_body import JSON, NPZ, body_of, kind_of
from firstfix.web.strict_json import parsed

# A pose; nobody needs more words.
_POSE_BYTES = 16 * 1024


class Api:
    """Answers requests.

    Parameters
    ----------
    page : Page
        What they are about.
    broadcaster : Broadcaster
        Who looks on.
    """

    def __init__(self, page: Page, broadcaster: Broadcaster) -> None:
        self._page = page
        self._broadcaster = broadcaster
        self._desk = LocateQueue()
        self._document = as_text(document())

    def routes(self) -> list[Route]:
        """Return what is served where."""
        return [
            Route("/v1/status", self.status),
            Route("/v1/map", self.map),
            Route("/v1/map.png", self.map_png),
            Route("/v1/locate", self.locate, methods=["POST"]),
            Route("/v1/pose", self.pose, methods=["POST"]),
            Route("/v1/relocalize", self.relocalize, methods=["POST"]),
            Route("/openapi.json", self.openapi),
        ]

    async def status(self, _: Request) -> Response:
        """Say where the robot is, and why."""
        return _json(state_message(self._page.store.snapshot, len(self._broadcaster)))

    async def map(self, _: Request) -> Response:
        """Describe the map."""
        return _json(map_object(self._page.map()))

    async def map_png(self, request: Request) -> Response:
        """Draw the map."""
        active_map, most = self._page.map(), _most_pixels(request)
        tag = f'"{active_map.key}-{cells_per_pixel(active_map, most)}"'
        headers = {"etag": tag, "cache-control": "private, no-cache"}
        if tag in request.headers.get("if-none-match", ""):
            return Response(status_code=304, headers=headers)
        picture = await run_in_threadpool(self._page.pictures.png, active_map, most)
        return Response(picture, media_type="image/png", headers=headers)

    async def locate(self, request: Request) -> Response:
        """Find a scan in the map."""
        active_map, kind = self._page.map(), kind_of(request, JSON, NPZ)
        body = await body_of(request)
        named = request.query_params.get("map")
        return _json(await self._desk.answer(body, kind, named, active_map))

    async def pose(self, request: Request) -> Response:
        """Take the word of a person."""
        self._page.check_may_steer()
        self._page.map()
        kind_of(request, JSON)
        message = parsed(await body_of(request, _POSE_BYTES))
        return await self._execute(Command("pose", checked(POSE, message)))

    async def relocalize(self, _: Request) -> Response:
        """Forget, and search."""
        self._page.check_may_steer()
        self._page.map()
        return await self._execute(Command("relocalize", {}))

    async def openapi(self, _: Request) -> Response:
        """Describe all this."""
        return Response(self._document, media_type=JSON)

    async def _execute(self, order: Command) -> Response:
        await run_in_threadpool(self._page.executor.execute, order)
        return _json({"detail": "the next scan will tell; GET /v1/status says what"}, 202)


def _json(content: dict[str, Any], status: int = 200) -> Response:
    headers = {"cache-control": "no-store"}
    return Response(as_text(content), status, headers, JSON)


def _most_pixels(request: Request) -> int:
    told = request.query_params.get("max", str(MOST_PIXELS))
    if not (told.isascii() and told.isdecimal() and len(told) <= 5):
        raise HTTPException(422, f"max is a number of pixels from {LEAST_PIXELS}")
    if int(told) < LEAST_PIXELS:
        raise HTTPException(422, f"max is at least {LEAST_PIXELS} pixels")
    return min(int(told), MOST_PIXELS)
