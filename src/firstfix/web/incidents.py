"""Saved incidents: the list, and one more on request."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

from msgspec import Meta, Struct
from starlette.exceptions import HTTPException

from firstfix.ros.incident_keeper import IncidentKeeper

GetKeeper = Callable[[], IncidentKeeper | None]


class IncidentInfo(Struct, frozen=True):
    """A saved incident."""

    name: str
    saved_at: Annotated[str, Meta(description="ISO 8601, UTC")]
    cause: str
    bytes: Annotated[int, Meta(ge=0)]
    url: str


class Incidents(Struct, frozen=True):
    """The saved incidents, newest first."""

    incidents: tuple[IncidentInfo, ...]


class SavedIncident(Struct, frozen=True):
    """An incident that was saved on request."""

    name: str
    url: str


def no_keeper() -> None:
    """Return None: nothing is kept."""


def keeper_of(get: GetKeeper) -> IncidentKeeper:
    """Return what keeps the incidents.

    Raises
    ------
    HTTPException
        409 while there is no node.
    """
    keeper = get()
    if keeper is None:
        raise HTTPException(409, "No robot is connected: nothing is kept yet. Try again later.")
    return keeper


def listed(keeper: IncidentKeeper) -> Incidents:
    """Describe the saved incidents."""
    return Incidents(
        tuple(
            IncidentInfo(file.name, file.saved_at, file.cause, file.bytes, _url(file.name))
            for file in keeper.folder.files()
        )
    )


def saved(keeper: IncidentKeeper) -> SavedIncident:
    """Save the last seconds; raises InputError if that is impossible."""
    name = keeper.save("a viewer asked for it")
    return SavedIncident(name, _url(name))


def content(keeper: IncidentKeeper, name: str) -> bytes:
    """Return a saved incident.

    Raises
    ------
    HTTPException
        404 if there is none of this name.
    """
    found = keeper.folder.read(name)
    if found is None:
        raise HTTPException(404, "There is no such incident. GET /v1/incidents lists them.")
    return found


def _url(name: str) -> str:
    return f"/v1/incidents/{name}"
