"""The HTTP API. openapi.py describes it."""

from __future__ import annotations

from typing import Any

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from firstfix.web import incidents
from firstfix.web.broadcaster import Broadcaster
from firstfix.web.commands import Command, Pose, Relocalize, SetPose
from firstfix.web.dropped_files import DroppedFiles
from firstfix.web.json_decoding import decode
from firstfix.web.locate_queue import LocateQueue
from firstfix.web.map_changes import Changes, counter_of
from firstfix.web.map_png import LEAST_PIXELS, MOST_PIXELS, cells_per_pixel
from firstfix.web.messages import Accepted, Map, Status
from firstfix.web.openapi import document
from firstfix.web.page import Page
from firstfix.web.request_body import JSON, NPZ, media_type, read_body

_MOST_POSE_BYTES = 16 * 1024


class Api:
    """The request handlers.

    Parameters
    ----------
    page : Page
        What they serve.
    broadcaster : Broadcaster
        Counts the viewers.
    """

    def __init__(self, page: Page, broadcaster: Broadcaster) -> None:
        self._page = page
        self._broadcaster = broadcaster
        self._queue = LocateQueue()
        self._dropped_files = DroppedFiles()
        self._document = msgspec.json.encode(document())

    def routes(self) -> list[Route]:
        """Return the routes."""
        return [
            Route("/v1/status", self.status),
            Route("/v1/map", self.map),
            Route("/v1/map.png", self.map_png),
            Route("/v1/map/changes", self.changes),
            Route("/v1/map/changes.png", self.changes_png),
            Route("/v1/locate", self.locate, methods=["POST"]),
            Route("/v1/locate-files", self.locate_files, methods=["POST"]),
            Route("/v1/pose", self.pose, methods=["POST"]),
            Route("/v1/relocalize", self.relocalize, methods=["POST"]),
            Route("/v1/incidents", self.incidents, methods=["GET", "POST"]),
            Route("/v1/incidents/{name}", self.incident),
            Route("/openapi.json", self.openapi),
        ]

    async def status(self, _: Request) -> Response:
        """Return the state, and why."""
        return _json(Status.of(self._page.store.snapshot, len(self._broadcaster)))

    async def map(self, _: Request) -> Response:
        """Describe the map."""
        return _json(Map.of(self._page.map()))

    async def map_png(self, request: Request) -> Response:
        """Return the map as a PNG."""
        active_map, most = self._page.map(), _most_pixels(request)
        tag = f'"{active_map.key}-{cells_per_pixel(active_map, most)}"'
        headers = {"etag": tag, "cache-control": "private, no-cache"}
        if tag in request.headers.get("if-none-match", ""):
            return Response(status_code=304, headers=headers)
        png = await run_in_threadpool(self._page.map_pngs.png, active_map, most)
        return Response(png, media_type="image/png", headers=headers)

    async def changes(self, _: Request) -> Response:
        """Describe what has changed in the map."""
        active_map = self._page.map()
        counter = counter_of(active_map)
        found = await run_in_threadpool(self._page.changes.find, active_map)
        return _json(Changes.of(found, counter.explained))

    async def changes_png(self, request: Request) -> Response:
        """Return what has changed as a PNG over the map."""
        active_map, most = self._page.map(), _most_pixels(request)
        png = await run_in_threadpool(self._page.changes.png, active_map, most)
        return Response(png, media_type="image/png", headers={"cache-control": "no-store"})

    async def locate(self, request: Request) -> Response:
        """Search one scan in the map."""
        active_map, kind = self._page.map(), media_type(request, JSON, NPZ)
        body = await read_body(request)
        map_name = request.query_params.get("map")
        return _json(await self._queue.locate(body, kind, map_name, active_map))

    async def locate_files(self, request: Request) -> Response:
        """Search a scan of a viewer's log in a viewer's map."""
        media_type(request, NPZ)
        answer = await self._dropped_files.locate(request, self._page.store.snapshot.map)
        return Response(answer, 200, {"cache-control": "no-store"}, JSON)

    async def pose(self, request: Request) -> Response:
        """Take a pose hint."""
        self._page.check_may_steer()
        self._page.map()
        media_type(request, JSON)
        pose: Pose = decode(await read_body(request, _MOST_POSE_BYTES), Pose)
        return await self._execute(SetPose(pose.x, pose.y, pose.yaw))

    async def relocalize(self, _: Request) -> Response:
        """Discard the pose and search the whole map."""
        self._page.check_may_steer()
        self._page.map()
        return await self._execute(Relocalize())

    async def incidents(self, request: Request) -> Response:
        """List the saved incidents, or save one."""
        if request.method == "POST":
            return await self._save_incident()
        keeper = incidents.keeper_of(self._page.incidents)
        return _json(await run_in_threadpool(incidents.listed, keeper))

    async def _save_incident(self) -> Response:
        """Save the last seconds."""
        self._page.check_may_steer()
        keeper = incidents.keeper_of(self._page.incidents)
        return _json(await run_in_threadpool(incidents.saved, keeper), 201)

    async def incident(self, request: Request) -> Response:
        """Return a saved incident."""
        name = request.path_params["name"]
        keeper = incidents.keeper_of(self._page.incidents)
        found = await run_in_threadpool(incidents.content, keeper, name)
        headers = {
            "cache-control": "no-store",
            "content-disposition": f'attachment; filename="{name}"',
        }
        return Response(found, 200, headers, NPZ)

    async def openapi(self, _: Request) -> Response:
        """Describe the API."""
        return Response(self._document, media_type=JSON)

    async def _execute(self, command: Command) -> Response:
        await run_in_threadpool(self._page.executor.execute, command)
        return _json(Accepted("The next scan is judged by it. GET /v1/status has the result."), 202)


def _json(content: Any, status: int = 200) -> Response:
    return Response(msgspec.json.encode(content), status, {"cache-control": "no-store"}, JSON)


def _most_pixels(request: Request) -> int:
    given = request.query_params.get("max", str(MOST_PIXELS))
    is_number = given.isascii() and given.isdecimal() and len(given) <= 5
    if not is_number or int(given) < LEAST_PIXELS:
        raise HTTPException(422, f"max must be a whole number of at least {LEAST_PIXELS} pixels.")
    return min(int(given), MOST_PIXELS)
