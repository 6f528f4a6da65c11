"""``POST /v1/locate``: one scan in, one answer out, the robot itself not touched."""

from __future__ import annotations

import asyncio
import io
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from starlette.exceptions import HTTPException

from firstfix.core.errors import InputError
from firstfix.core.scan import MAX_BEAMS, LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.answers import answer_document
from firstfix.io.logs.npz import read_scan
from firstfix.web.commands import POSE, Entry, checked
from firstfix.web.request_body import JSON
from firstfix.web.snapshot import ActiveMap
from firstfix.web.strict_json import parsed, shown

SENSOR = {
    "angle_min": Entry(float, "bearing of the first beam, rad", -100.0, 100.0),
    "angle_increment": Entry(float, "step from beam to beam, rad", -10.0, 10.0),
    "range_min": Entry(float, "what is nearer is no reading, m", 0.0),
    "range_max": Entry(float, "reach of the sensor, m", 0.0),
}
OPTIONAL = ("T_base_laser", "map")

# One search runs, and so many wait for it.
MOST_WAITING = 4

# What a scan may unpack to: sixteen bytes for each beam, and all the rest.
_UNPACKED_BYTES = 16 * MAX_BEAMS + 2**20


class LocateQueue:
    """Where searches queue: one at a time, so that the robot itself is not kept waiting."""

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._inside = 0

    async def answer(
        self, body: bytes, kind: str, named: str | None, on: ActiveMap
    ) -> dict[str, Any]:
        """Search.

        Parameters
        ----------
        body : bytes
            JSON or npz.
        kind : str
            Its media type.
        named : str or None
            The map that is meant, where the body cannot say it.
        on : ActiveMap
            The map in use.

        Returns
        -------
        dict
            The answer, as docs/json.md has it.

        Raises
        ------
        HTTPException
            If too many wait, the body is none, or another map is meant.
        InputError
            If there is no scan in it.
        """
        if self._inside > MOST_WAITING:
            raise HTTPException(503, "too many searches wait already", {"retry-after": "1"})
        self._inside += 1
        try:
            async with self._turn:
                return await asyncio.to_thread(_answer, body, kind, named, on)
        finally:
            self._inside -= 1


def _answer(body: bytes, kind: str, named: str | None, on: ActiveMap) -> dict[str, Any]:
    if kind == JSON:
        message = parsed(body)
        scan = _scan_of(message)
        named = _text(message.get("map", named))
    else:
        scan = read_scan(io.BytesIO(body), _UNPACKED_BYTES)
    if named is not None and named != on.name:
        raise HTTPException(404, f"there is one map here, and its name is {on.name!r:.60}")
    return answer_document(0, on.matcher.locate(scan), None)


def _scan_of(message: Any) -> LaserScan:
    sensor = checked(SENSOR, message)
    unknown = set(message) - {"ranges", *SENSOR, *OPTIONAL}
    if unknown:
        raise InputError(
            expected=f"ranges, {', '.join(SENSOR)} and perhaps {' and '.join(OPTIONAL)}",
            received=shown(min(unknown)),
            remedy="leave it out, or correct its name",
        )
    return LaserScan(
        ranges=_ranges(message.get("ranges")),
        T_base_laser=_place(message.get("T_base_laser", [0.0, 0.0, 0.0])),
        **sensor,
    )


def _ranges(given: Any) -> NDArray[np.float32]:
    if not isinstance(given, list) or not 1 <= len(given) <= MAX_BEAMS:
        raise InputError(
            expected=f"ranges as a list of 1 to {MAX_BEAMS} numbers",
            received=shown(given),
            remedy="send one scan at a time",
        )
    for value in given:
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise InputError(
                expected="ranges as numbers, m, or null where nothing returned",
                received=shown(value),
                remedy="send numbers",
            )
    ranges = np.array([math.inf if value is None else value for value in given], np.float64)
    with np.errstate(over="ignore"):  # what float32 cannot hold is infinitely far
        return ranges.astype(np.float32)


def _place(given: Any) -> SE2:
    if not isinstance(given, list) or len(given) != len(POSE):
        raise InputError(
            expected="T_base_laser as [x, y, yaw]",
            received=shown(given),
            remedy="leave it out where the base is the sensor",
        )
    return SE2(**checked(POSE, dict(zip(POSE, given, strict=True))))


def _text(given: Any) -> str | None:
    if given is not None and not isinstance(given, str):
        raise InputError(expected="map as a name", received=shown(given), remedy="leave it out")
    return given
