"""Access control: host, origin, token and rate are checked before anything else."""

from __future__ import annotations

import hmac
import ipaddress
from collections.abc import Collection
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
    """Who may see the page, and who may steer.

    Parameters
    ----------
    token : str or None
        The token that clients must send; None for no token.
    may_steer : bool
        False on a read-only server.
    loopback_only : bool
        True if the server cannot be reached from other machines.
    """

    token: str | None = None
    may_steer: bool = True
    loopback_only: bool = True

    def accepts(self, token: str) -> bool:
        """Return whether a token is right, in constant time."""
        return self.token is None or hmac.compare_digest(_as_bytes(token), _as_bytes(self.token))


class AccessControl:
    """ASGI middleware that refuses clients, and adds security headers to every response.

    Parameters
    ----------
    app : ASGI application
        The application behind it.
    access : AccessPolicy
        The policy.
    rate_limiter : RateLimiter
        Limits the requests of each client.
    open_paths : collection of str
        What everyone may read, beside ``/static/``.
    """

    def __init__(
        self,
        app: ASGIApp,
        access: AccessPolicy,
        rate_limiter: RateLimiter,
        open_paths: Collection[str] = ("/",),
    ) -> None:
        self._app = app
        self._access = access
        self._rate_limiter = rate_limiter
        self._open_paths = frozenset(open_paths)

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
            return problem(404, "A path must not contain a null byte.")
        host = headers.get("host", "")
        if self._access.loopback_only and not _is_loopback(host):
            # DNS rebinding: a web site gives its own name the address of this machine.
            return problem(421, "This server answers only to localhost and 127.0.0.1.")
        origin = headers.get("origin")
        is_reading = scope["type"] == "http" and scope["method"] in _READING
        if origin is not None and not is_reading and _host_of(origin) != host:
            return problem(403, "Requests from other web sites are refused.")
        if scope["path"] in self._open_paths or scope["path"].startswith("/static/"):
            return None
        client = client_of(scope)
        if not self._rate_limiter.admits(client):
            return problem(429, "Too many requests. Try again in a second.", {"retry-after": "1"})
        # Browsers cannot add headers to a WebSocket, so its first message carries the token.
        if scope["type"] == "http" and not self._has_token(headers):
            self._rate_limiter.charge(client, WRONG_TOKEN)
            return problem(401, "A token is needed.", {"www-authenticate": "Bearer"})
        return None

    def _has_token(self, headers: Headers) -> bool:
        kind, _, token = headers.get("authorization", "").partition(" ")
        return self._access.token is None or (
            kind.lower() == "bearer" and self._access.accepts(token.strip())
        )


def client_of(scope: Scope) -> str:
    """Return the address of the client."""
    address, _ = scope.get("client") or ("?", 0)
    return str(address)


def is_loopback(host: str) -> bool:
    """Return whether a name or address is reachable from this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _as_bytes(token: str) -> bytes:
    return token.encode(errors="surrogatepass")


def _host_of(origin: str) -> str | None:
    """Return host and port of an origin; None if it is malformed."""
    try:
        return urlsplit(origin).netloc or None
    except ValueError:
        return None


def _is_loopback(header: str) -> bool:
    """Return `is_loopback` of a Host header, with or without a port."""
    try:
        return is_loopback(urlsplit(f"//{header}").hostname or "")
    except ValueError:
        return False
