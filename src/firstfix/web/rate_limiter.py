"""How much each client may ask for."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable

# Requests of one client: so many a second in the long run, and so many at once. A page asks for
# three things when it is opened.
_RATE_HZ = 50.0
_BURST = 100.0
# A wrong token costs as much as so many requests: five guesses a second.
WRONG_TOKEN = 10.0
_MOST_CLIENTS = 1024


class RateLimiter:
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
