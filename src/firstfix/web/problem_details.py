"""How requests are refused: RFC 9457, in one sentence, and never with more than that."""

from __future__ import annotations

from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse

from firstfix.core.errors import InputError
from firstfix.web.strict_json import NotJsonError

MEDIA_TYPE = "application/problem+json"


def problem(status: int, detail: str, headers: Mapping[str, str] | None = None) -> JSONResponse:
    """Make the response that refuses.

    Parameters
    ----------
    status : int
        Of HTTP.
    detail : str
        One sentence for people.
    headers : mapping of str to str, optional
        Such as ``Retry-After``.

    Returns
    -------
    JSONResponse
        ``type``, ``title``, ``status``, ``detail``.
    """
    content = {
        "type": "about:blank",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
    }
    return JSONResponse(content, status, headers, MEDIA_TYPE)


async def _refused(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)  # noqa: S101 - registered for nothing else
    details = {404: "there is nothing here", 405: "another method is needed here"}
    is_plain = error.detail == HTTPStatus(error.status_code).phrase
    detail = details.get(error.status_code, error.detail) if is_plain else error.detail
    return problem(error.status_code, detail, error.headers)


async def _not_usable(_: Request, error: Exception) -> JSONResponse:
    return problem(400 if isinstance(error, NotJsonError) else 422, str(error))


async def _own_error(_: Request, __: Exception) -> JSONResponse:
    return problem(500, "an error of firstfix itself; its log has more")


HANDLERS: dict[Any, Any] = {
    HTTPException: _refused,
    InputError: _not_usable,
    Exception: _own_error,
}
"""For Starlette."""
