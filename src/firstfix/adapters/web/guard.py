"""Who may come in: checked before anything else looks at a request."""

from __future__ import annotations

import hmac
import ipaddress
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from firstfix.adapters.web.problem import problem

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

# Requests of one client: so many a second in the long run, and so many at once. A page asks for
# three things when it is opened.
_RATE_HZ = 50.0
_BURST = 100.0
# A wrong token costs as much as so many requests: five guesses a second.
_WRONG_TOKEN = 10.0
_MOST_CLIENTS = 1024

_READING = {"GET", "HEAD"}


@dataclass(frozen=True, slots=True)
class Access:
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


class Allowance:
    """How much each client may still ask for; refills with time.

    Parameters
    ----------
    rate_hz, burst : float
        Requests a second, and at once.
    clock : callable
        Seconds since any time.
    """

    def __init__(
        self,
        rate_hz: float = _RATE_HZ,
        burst: float = _BURST,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._rate_hz, self._burst, self._clock = rate_hz, burst, clock
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def takes(self, client: str) -> bool:
        """Take one request from what a client has left; False if it has nothing left."""
        if self._left_of(client) < 1.0:
            return False
        self.charge(client, 1.0)
        return True

    def charge(self, client: str, cost: float) -> None:
        """Take so many requests from what a client has left, also if it has less."""
        self._left[client] = (self._left_of(client) - cost, self._clock())
        self._left.move_to_end(client)
        if len(self._left) > _MOST_CLIENTS:
            self._left.popitem(last=False)

    def _left_of(self, client: str) -> float:
        now = self._clock()
        left, then = self._left.get(client, (self._burst, now))
        return min(self._burst, left + (now - then) * self._rate_hz)


class Guard:
    """Refuses strangers, and hardens what goes out.

    Parameters
    ----------
    app : ASGI application
        What is guarded.
    access : Access
        What is asked of clients.
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access
        self._allowance = Allowance()

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
        client = (scope.get("client") or ("?", 0))[0]
        if not self._allowance.takes(client):
            return problem(429, "too many requests", {"retry-after": "1"})
        # A browser cannot give headers to a WebSocket: there the first message has the token.
        if scope["type"] == "http" and not self._knows_token(headers):
            self._allowance.charge(client, _WRONG_TOKEN)
            return problem(401, "a token is needed", {"www-authenticate": "Bearer"})
        return None

    def _knows_token(self, headers: Headers) -> bool:
        kind, _, token = headers.get("authorization", "").partition(" ")
        return self._access.token is None or (
            kind.lower() == "bearer" and self._access.knows(token.strip())
        )


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
