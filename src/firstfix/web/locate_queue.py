"""``POST /v1/locate``: scans in, one answer out; the state of the robot does not change."""

from __future__ import annotations

import asyncio
import io
from typing import Any

from starlette.exceptions import HTTPException

from firstfix.core.scan import MAX_BEAMS
from firstfix.io.logs.npz import read_scan
from firstfix.web.locate_request import read_query
from firstfix.web.request_body import JSON
from firstfix.web.snapshot import ActiveMap

# One search runs, and this many wait.
MOST_WAITING = 4

# Limit of an unpacked .npz: sixteen bytes a beam, and 1 MiB for everything else.
_UNPACKED_BYTES = 16 * MAX_BEAMS + 2**20


class LocateQueue:
    """Runs one search at a time, so that the robot's own localizer keeps its processor."""

    def __init__(self) -> None:
        self._running = asyncio.Lock()
        self._requests = 0

    async def locate(
        self, body: bytes, kind: str, map_name: str | None, active_map: ActiveMap
    ) -> dict[str, Any]:
        """Search the scans of a request body.

        Parameters
        ----------
        body : bytes
            JSON or .npz.
        kind : str
            Media type of the body.
        map_name : str or None
            The map that the client expects, where the body does not name one.
        active_map : ActiveMap
            The map in use.

        Returns
        -------
        dict
            The answer of docs/json.md.

        Raises
        ------
        HTTPException
            503 if too many requests wait, 404 if the client expects another map.
        InputError
            If the body has no scans, or they do not belong together.
        """
        if self._requests > MOST_WAITING:
            raise HTTPException(503, "Too many searches are waiting.", {"retry-after": "1"})
        self._requests += 1
        try:
            async with self._running:
                return await asyncio.to_thread(_locate, body, kind, map_name, active_map)
        finally:
            self._requests -= 1


def _locate(body: bytes, kind: str, map_name: str | None, active_map: ActiveMap) -> dict[str, Any]:
    if kind == JSON:
        query = read_query(body)
        scans, odometry = [scan.laser_scan() for scan in query.scans], query.odometry()
        prior = None if query.prior is None else query.prior.prior()
        map_name = query.map or map_name
    else:
        scans, odometry, prior = [read_scan(io.BytesIO(body), _UNPACKED_BYTES)], None, None
    if map_name is not None and map_name != active_map.name:
        raise HTTPException(404, f"The only map here is {active_map.name!r:.60}.")
    return active_map.matcher.locate(scans, odometry, prior).to_dict()
