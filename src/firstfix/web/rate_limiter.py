"""Limits the request rate of each client."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable

# A page needs three requests when it is opened.
_RATE_HZ = 50.0
_BURST = 100.0
# Cost of a wrong token, requests: it allows five guesses a second.
WRONG_TOKEN = 10.0
_MOST_CLIENTS = 1024


class RateLimiter:
    """A token bucket for each client.

    Parameters
    ----------
    rate_hz, burst : float
        Requests a second, and at once.
    clock : callable
        A monotonic clock, s.
    """

    def __init__(
        self,
        rate_hz: float = _RATE_HZ,
        burst: float = _BURST,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._rate_hz, self._burst, self._clock = rate_hz, burst, clock
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def admits(self, client: str) -> bool:
        """Count a request; False if the client has used up its rate."""
        if self._level(client) < 1.0:
            return False
        self.charge(client, 1.0)
        return True

    def charge(self, client: str, cost: float) -> None:
        """Count `cost` requests, even below zero."""
        self._buckets[client] = (self._level(client) - cost, self._clock())
        self._buckets.move_to_end(client)
        if len(self._buckets) > _MOST_CLIENTS:
            self._buckets.popitem(last=False)

    def _level(self, client: str) -> float:
        now = self._clock()
        level, then = self._buckets.get(client, (self._burst, now))
        return min(self._burst, level + (now - then) * self._rate_hz)
