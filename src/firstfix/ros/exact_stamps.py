"""Stamps of messages to the nanosecond, beside the float seconds of the localizer."""

from __future__ import annotations

from collections import deque
from typing import Any

from firstfix.io.ros_messages.incoming import to_nanoseconds, to_seconds
from firstfix.io.ros_messages.outgoing import ExactTime

_KEPT = 1000


class ExactStamps:
    """The exact times behind recent stamps: seconds since 1970 as a float are off by up to 120 ns.

    An answer to a scan must have the stamp of the scan: exact-time synchronizers compare all bits.
    """

    def __init__(self) -> None:
        self._exact: dict[float, int] = {}
        self._order: deque[float] = deque()

    def add(self, stamp: Any) -> float:
        """Remember the stamp of a message, and return it in seconds."""
        seconds = to_seconds(stamp)
        if seconds not in self._exact:
            self._order.append(seconds)
            if len(self._order) > _KEPT:
                del self._exact[self._order.popleft()]
        self._exact[seconds] = to_nanoseconds(stamp)
        return seconds

    def exact(self, seconds: float, ahead_s: float = 0.0) -> ExactTime | float:
        """Return the exact time of a remembered stamp, plus a duration (s); else the seconds."""
        known = self._exact.get(seconds)
        return seconds + ahead_s if known is None else ExactTime(known + round(1e9 * ahead_s))
