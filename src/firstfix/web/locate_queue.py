"""``POST /v1/locate``: one scan in, one answer out; the state of the robot does not change."""

from __future__ import annotations

import asyncio
import io
import math
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct
from starlette.exceptions import HTTPException

from firstfix.core.scan import MAX_BEAMS, LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.logs.npz import read_scan
from firstfix.web.commands import X, Y, Yaw
from firstfix.web.json_decoding import decode
from firstfix.web.request_body import JSON
from firstfix.web.snapshot import ActiveMap

# One search runs, and this many wait.
MOST_WAITING = 4

# Limit of an unpacked .npz: sixteen bytes a beam, and 1 MiB for everything else.
_UNPACKED_BYTES = 16 * MAX_BEAMS + 2**20


class Scan(Struct, frozen=True, forbid_unknown_fields=True):
    """A scan, as `sensor_msgs/LaserScan` has it."""

    ranges: Annotated[
        list[float | None],
        Meta(min_length=1, max_length=MAX_BEAMS, description="m; null for no return"),
    ]
    angle_min: Annotated[
        float, Meta(ge=-100.0, le=100.0, description="bearing of the first beam, rad")
    ]
    angle_increment: Annotated[
        float, Meta(ge=-10.0, le=10.0, description="step between beams, rad")
    ]
    range_min: Annotated[float, Meta(ge=0.0, le=1e6, description="shortest valid range, m")]
    range_max: Annotated[float, Meta(ge=0.0, le=1e6, description="longest valid range, m")]
    T_base_laser: Annotated[
        tuple[X, Y, Yaw], Meta(description="pose of the sensor on the robot: x m, y m, yaw rad")
    ] = (0.0, 0.0, 0.0)
    map: Annotated[str | None, Meta(description="name of the map; any if null")] = None

    def laser_scan(self) -> LaserScan:
        """Convert it.

        Raises
        ------
        ScanError
            If its fields contradict each other.
        """
        metres = np.array([math.inf if r is None else r for r in self.ranges], np.float64)
        with np.errstate(over="ignore"):  # beyond the largest float32: infinity
            ranges = metres.astype(np.float32)
        return LaserScan(
            ranges=ranges,
            angle_min=self.angle_min,
            angle_increment=self.angle_increment,
            range_min=self.range_min,
            range_max=self.range_max,
            T_base_laser=SE2(*self.T_base_laser),
        )


class LocateQueue:
    """Runs one search at a time, so that the robot's own localizer keeps its processor."""

    def __init__(self) -> None:
        self._running = asyncio.Lock()
        self._requests = 0

    async def locate(
        self, body: bytes, kind: str, map_name: str | None, active_map: ActiveMap
    ) -> dict[str, Any]:
        """Search the scan of a request body.

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
            If the body is not a scan.
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
        message = decode(body, Scan)
        scan, map_name = message.laser_scan(), message.map or map_name
    else:
        scan = read_scan(io.BytesIO(body), _UNPACKED_BYTES)
    if map_name is not None and map_name != active_map.name:
        raise HTTPException(404, f"The only map here is {active_map.name!r:.60}.")
    return active_map.matcher.locate(scan).to_dict()
