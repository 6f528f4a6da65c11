"""Reading request bodies, with limits on type, size and time."""

from __future__ import annotations

import asyncio
from typing import NoReturn

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request

MOST_BYTES = 4 * 2**20
TIMEOUT_S = 10.0

JSON = "application/json"
NPZ = "application/octet-stream"


def media_type(request: Request, *accepted: str) -> str:
    """Return the media type of a body.

    Raises
    ------
    HTTPException
        415 if it is not one of the accepted types, or if the body is compressed.
    """
    if request.headers.get("content-encoding", "identity") != "identity":
        raise HTTPException(415, "Send the body uncompressed.")
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind not in accepted:
        accept = {"accept": ", ".join(accepted)}
        raise HTTPException(415, f"Send the body as {' or '.join(accepted)}.", accept)
    return kind


async def read_body(
    request: Request, most_bytes: int = MOST_BYTES, timeout_s: float = TIMEOUT_S
) -> bytes:
    """Read a body of at most so many bytes, in so many seconds.

    Raises
    ------
    HTTPException
        413 if it is longer, 408 if it takes too long, 400 if it is incomplete.
    """
    announced = request.headers.get("content-length", "0")
    if announced.isdecimal() and int(announced[:20]) > most_bytes:
        _too_long(most_bytes)
    try:
        return await asyncio.wait_for(_read(request, most_bytes), timeout_s)
    except asyncio.TimeoutError:
        raise HTTPException(408, f"The body took more than {timeout_s:g} s.") from None
    except ClientDisconnect:
        raise HTTPException(400, "The body is incomplete.") from None


async def _read(request: Request, most_bytes: int) -> bytes:
    parts, length = [], 0
    async for part in request.stream():
        length += len(part)
        if length > most_bytes:
            _too_long(most_bytes)
        parts.append(part)
    return b"".join(parts)


def _too_long(most_bytes: int) -> NoReturn:
    detail = f"The body is too long. The limit is {most_bytes} bytes."
    raise HTTPException(413, detail, {"connection": "close"})
