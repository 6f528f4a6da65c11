"""Error responses: problem details of RFC 9457, in one plain sentence."""

from __future__ import annotations

from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

import msgspec
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from firstfix.core.errors import InputError
from firstfix.web.json_decoding import NotJsonError

MEDIA_TYPE = "application/problem+json"


class Problem(msgspec.Struct, frozen=True):
    """An error response."""

    title: str
    status: int
    detail: str
    type: str = "about:blank"


def problem(status: int, detail: str, headers: Mapping[str, str] | None = None) -> Response:
    """Make an error response.

    Parameters
    ----------
    status : int
        HTTP status.
    detail : str
        What is wrong and what to do, in one sentence.
    headers : mapping of str to str, optional
        Such as ``Retry-After``.

    Returns
    -------
    Response
        The problem details as JSON.
    """
    content = Problem(HTTPStatus(status).phrase, status, detail)
    return Response(msgspec.json.encode(content), status, headers, MEDIA_TYPE)


async def _http_error(_: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)  # noqa: S101 - registered for nothing else
    details = {404: "There is nothing at this address.", 405: "This method is not allowed here."}
    is_default = error.detail == HTTPStatus(error.status_code).phrase
    detail = details.get(error.status_code, error.detail) if is_default else error.detail
    return problem(error.status_code, detail, error.headers)


async def _input_error(_: Request, error: Exception) -> Response:
    return problem(400 if isinstance(error, NotJsonError) else 422, str(error))


async def _internal_error(_: Request, __: Exception) -> Response:
    return problem(500, "Internal error of firstfix. See its log.")


HANDLERS: dict[Any, Any] = {
    HTTPException: _http_error,
    InputError: _input_error,
    Exception: _internal_error,
}
"""Exception handlers for Starlette."""
