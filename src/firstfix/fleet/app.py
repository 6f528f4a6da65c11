"""The HTTP API of the service. openapi.py describes it."""

from __future__ import annotations

import asyncio
import contextlib
import re
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

from prometheus_client import CollectorRegistry
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from firstfix import __version__
from firstfix.fleet.fleet import NotReadyError, UnknownMapError
from firstfix.fleet.messages import (
    ROBOT_NAME,
    Health,
    Maps,
    MapState,
    Robots,
    encode,
    read_query,
    read_robot_view,
)
from firstfix.fleet.metrics import Metrics, as_text, new_registry
from firstfix.fleet.openapi import document
from firstfix.fleet.service import BusyError, Service
from firstfix.web.access_control import AccessControl, AccessPolicy
from firstfix.web.problem_details import HANDLERS, problem
from firstfix.web.rate_limiter import RateLimiter
from firstfix.web.request_body import JSON, NPZ, media_type, read_body

STATIC = Path(__file__).parent / "static"

OPEN_PATHS = ("/", "/healthz", "/readyz", "/openapi.json")
"""The page, and what load balancers ask, who have no token."""

# A gateway may send the scans of all robots from one address.
RATE_HZ, BURST = 500.0, 1000.0

_AGAIN = {"retry-after": "1"}


def make_app(
    service: Service, access: AccessPolicy, on_prepared: Callable[[str], None] = lambda _: None
) -> ASGIApp:
    """Make the ASGI application of a service; its maps are prepared when it starts.

    Parameters
    ----------
    service : Service
        What it serves.
    access : AccessPolicy
        Who may ask.
    on_prepared : callable
        Called with the id of each map when it is ready, or found to be unusable.

    Returns
    -------
    ASGI application
        For uvicorn or another server.
    """
    registry = new_registry(service)

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        preparing = asyncio.create_task(service.fleet.prepare(on_prepared))
        yield
        preparing.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await preparing
        service.fleet.engine.close()

    app = Starlette(
        routes=_Api(service, registry).routes(),
        lifespan=lifespan,
        exception_handlers={
            **HANDLERS,
            BusyError: _busy,
            NotReadyError: _not_ready,
            UnknownMapError: _unknown_map,
        },
    )
    limited = AccessControl(app, access, RateLimiter(RATE_HZ, BURST), OPEN_PATHS)
    return Metrics(limited, registry)


class _Api:
    """The request handlers."""

    def __init__(self, service: Service, registry: CollectorRegistry) -> None:
        self._service = service
        self._registry = registry
        self._document = encode(document())

    def routes(self) -> list[Route | Mount]:
        """Return the routes."""
        return [
            Route("/", self.page),
            Route("/healthz", self.healthz),
            Route("/readyz", self.readyz),
            Route("/metrics", self.metrics),
            Route("/openapi.json", self.openapi),
            Route("/v1/maps", self.maps),
            Route("/v1/locate", self.locate, methods=["POST"]),
            Route("/v1/robots", self.robots),
            # Two routes would each name only their own method in Allow.
            Route("/v1/robots/{robot}", self.robot, methods=["GET", "DELETE"]),
            Route("/v1/robots/{robot}/scans", self.robot_scans, methods=["POST"]),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]

    async def page(self, _: Request) -> Response:
        """Show the state of the service and its API."""
        return FileResponse(STATIC / "index.html", headers={"cache-control": "no-cache"})

    async def healthz(self, _: Request) -> Response:
        """Tell that the service runs."""
        return _json(self._health())

    async def readyz(self, _: Request) -> Response:
        """Tell whether all maps are prepared."""
        health = self._health()
        return _json(health, 200 if health.ready else 503)

    async def metrics(self, _: Request) -> Response:
        """Return figures for Prometheus."""
        return Response(as_text(self._registry), media_type=CONTENT_TYPE_PLAIN_0_0_4)

    async def openapi(self, _: Request) -> Response:
        """Describe the API."""
        return Response(self._document, media_type=JSON)

    async def maps(self, _: Request) -> Response:
        """List all maps, and why some cannot be used."""
        fleet = self._service.fleet
        return _json(
            Maps(
                [
                    MapState(name, name in fleet.prepared, fleet.faults.get(name))
                    for name in fleet.map_ids
                ]
            )
        )

    async def locate(self, request: Request) -> Response:
        """Find the map and the place of a robot."""
        kind = media_type(request, JSON, NPZ)
        body = await read_body(request)
        asked = await asyncio.to_thread(
            read_query, body, kind, request.query_params.get("map"), self._service.fleet.zone
        )
        return _json(await self._service.locate(asked))

    async def robots(self, _: Request) -> Response:
        """List the robots that are remembered."""
        return _json(Robots(self._service.sessions.names()))

    async def robot(self, request: Request) -> Response:
        """Return the last answer to a robot, or forget it."""
        if request.method == "DELETE":
            return self._forget(request)
        robot = self._service.sessions.find(_robot(request))
        if robot is None or robot.answer is None:
            raise HTTPException(404, "This robot has not reported, or not for a long time.")
        return _json(robot.answer)

    def _forget(self, request: Request) -> Response:
        if not self._service.sessions.forget(_robot(request)):
            raise HTTPException(404, "This robot has not reported, or not for a long time.")
        return Response(status_code=204)

    async def robot_scans(self, request: Request) -> Response:
        """Judge scans of a robot together with its last ones."""
        name = _robot(request)
        media_type(request, JSON)
        body = await read_body(request)
        view, prior = await asyncio.to_thread(read_robot_view, body, self._service.fleet.zone)
        return _json(await self._service.locate_robot(name, view, prior))

    def _health(self) -> Health:
        service, fleet = self._service, self._service.fleet
        return Health(
            ready=fleet.is_ready,
            maps=len(fleet.map_ids),
            prepared=len(fleet.prepared),
            faults=len(fleet.faults),
            robots=len(service.sessions),
            waiting=service.waiting,
            version=__version__,
        )


def _robot(request: Request) -> str:
    name: str = request.path_params["robot"]
    if not re.fullmatch(ROBOT_NAME, name):
        raise HTTPException(
            422, "The name of a robot has up to 64 letters, digits, dots, dashes and underscores."
        )
    return name


def _json(content: Any, status: int = 200) -> Response:
    return Response(encode(content), status, {"cache-control": "no-store"}, JSON)


async def _busy(_: Request, error: Exception) -> Response:
    return problem(503, str(error), _AGAIN)


async def _not_ready(_: Request, error: Exception) -> Response:
    return problem(503, str(error), _AGAIN)


async def _unknown_map(_: Request, error: Exception) -> Response:
    return problem(404, str(error))
