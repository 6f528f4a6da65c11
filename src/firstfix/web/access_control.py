"""Who may come in: checked before anything else looks at a request."""

from __future__ import annotations

import hmac
import ipaddress
from dataclasses import dataclass
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from firstfix.web.problem_details import problem
from firstfix.web.rate_limiter import WRONG_TOKEN, RateLimiter

HARDENING = {
    "content-security-policy": "default-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; object-src 'none'",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
}
"""Headers of every response."""

_READING = {"GET", "HEAD"}


@dataclass(frozen=True, slots=True)
class AccessPolicy:
    """What is asked of clients.

    Parameters
    ----------
    token : str or None
        What they must know; None for nothing.
    may_steer : bool
        False if nobody may do more than watch and ask.
    loopback_only : bool
        True if the server cannot be reached from other machines.
    """

    token: str | None = None
    may_steer: bool = True
    loopback_only: bool = True

    def knows(self, token: str) -> bool:
        """Tell whether a token is right, in a time that does not tell how wrong it is."""
        return self.token is None or hmac.compare_digest(_as_bytes(token), _as_bytes(self.token))


class AccessControl:
    """Refuses strangers, and hardens what goes out.

    Parameters
    ----------
    app : ASGI application
        What is guarded.
    access : AccessPolicy
        What is asked of clients.
    allowance : RateLimiter
        How much they may ask for.
    """

    def __init__(self, app: ASGIApp, access: AccessPolicy, allowance: RateLimiter) -> None:
        self._app = app
        self._access = access
        self._allowance = allowance

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or connection."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return

        async def send_hardened(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HARDENING)
            await send(message)

        refusal = self._refusal(scope)
        if refusal is None:
            await self._app(scope, receive, send_hardened)
        elif scope["type"] == "http":
            await refusal(scope, receive, send_hardened)
        else:
            await send({"type": "websocket.close"})  # to clients: 403

    def _refusal(self, scope: Scope) -> Response | None:
        headers = Headers(scope=scope)
        if "\0" in scope["path"]:
            return problem(404, "no name has a zero in it")
        host = headers.get("host", "")
        if self._access.loopback_only and not _is_loopback(host):
            # Another name for this machine is how a web site of others would get in.
            return problem(421, "this server answers to localhost and 127.0.0.1 only")
        origin = headers.get("origin")
        is_reading = scope["type"] == "http" and scope["method"] in _READING
        if origin is not None and not is_reading and _host_of(origin) != host:
            return problem(403, "pages of other sites may not ask for this")
        if scope["path"] == "/" or scope["path"].startswith("/static/"):
            return None
        client = client_of(scope)
        if not self._allowance.takes(client):
            return problem(429, "too many requests", {"retry-after": "1"})
        # A browser cannot give headers to a WebSocket: there the first message has the token.
        if scope["type"] == "http" and not self._knows_token(headers):
            self._allowance.charge(client, WRONG_TOKEN)
            return problem(401, "a token is needed", {"www-authenticate": "Bearer"})
        return None

    def _knows_token(self, headers: Headers) -> bool:
        kind, _, token = headers.get("authorization", "").partition(" ")
        return self._access.token is None or (
            kind.lower() == "bearer" and self._access.knows(token.strip())
        )


def client_of(scope: Scope) -> str:
    """Return the address of who asks."""
    address, _ = scope.get("client") or ("?", 0)
    return str(address)


def is_loopback(host: str) -> bool:
    """Tell whether a name or address is only reached from this machine."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _as_bytes(token: str) -> bytes:
    return token.encode(errors="surrogatepass")


def _host_of(origin: str) -> str | None:
    """Return host and port of an origin; None if it is none."""
    try:
        return urlsplit(origin).netloc or None
    except ValueError:
        return None


def _is_loopback(header: str) -> bool:
    """Tell it of a Host header, with a port or without."""
    try:
        return is_loopback(urlsplit(f"//{header}").hostname or "")
    except ValueError:
        return False
