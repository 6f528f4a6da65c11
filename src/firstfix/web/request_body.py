"""Bodies of requests, read only as far as they may go."""

from __future__ import annotations

import asyncio
from typing import NoReturn

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request

MOST_BYTES = 4 * 2**20
SLOWEST_S = 10.0

JSON = "application/json"
NPZ = "application/octet-stream"


def kind_of(request: Request, *kinds: str) -> str:
    """Return which of some media types a body has.

    Raises
    ------
    HTTPException
        415 if it is another, or packed.
    """
    if request.headers.get("content-encoding", "identity") != "identity":
        raise HTTPException(415, "send the body as it is, not packed")
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind not in kinds:
        raise HTTPException(415, f"send {' or '.join(kinds)}", {"accept": ", ".join(kinds)})
    return kind


async def body_of(request: Request, most_bytes: int = MOST_BYTES) -> bytes:
    """Read a body.

    Parameters
    ----------
    request : Request
        Whose.
    most_bytes : int
        How long it may be.

    Returns
    -------
    bytes
        All of it.

    Raises
    ------
    HTTPException
        413 if it is longer, 408 if it takes too long to come, 400 if it breaks off.
    """
    told = request.headers.get("content-length", "0")
    if told.isdecimal() and int(told[:20]) > most_bytes:
        _too_long(most_bytes)
    try:
        return await asyncio.wait_for(_all_of(request, most_bytes), SLOWEST_S)
    except asyncio.TimeoutError:
        raise HTTPException(408, f"the body took more than {SLOWEST_S:g} s") from None
    except ClientDisconnect:
        raise HTTPException(400, "the body broke off") from None


async def _all_of(request: Request, most_bytes: int) -> bytes:
    parts, length = [], 0
    async for part in request.stream():
        length += len(part)
        if length > most_bytes:
            _too_long(most_bytes)
        parts.append(part)
    return b"".join(parts)


def _too_long(most_bytes: int) -> NoReturn:
    raise HTTPException(413, f"a body has at most {most_bytes} bytes", {"connection": "close"})
