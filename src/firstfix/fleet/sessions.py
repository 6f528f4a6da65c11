"""What the service remembers of each robot: where it may be."""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from firstfix.site.site_belief import SiteBelief


@dataclass(eq=False, slots=True)
class Robot:
    """One robot.

    Parameters
    ----------
    belief : SiteBelief
        Where it may be; at most 1 MB, and some 30 kB once it is found.
    answer : dict or None
        The last answer.
    seen : float
        When it last reported, s, on the clock of the sessions.
    turn : asyncio.Lock
        Held while a scan of this robot is judged.
    """

    belief: SiteBelief = field(default_factory=SiteBelief)
    answer: dict[str, Any] | None = None
    seen: float = 0.0
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)


class Sessions:
    """The robots that the service remembers.

    Parameters
    ----------
    most : int
        Number of robots at most; for a new one the one that has been silent for longest is
        forgotten.
    idle_s : float
        A robot that reports nothing for so long is forgotten, s.
    clock : callable
        A monotonic clock, s.
    """

    def __init__(
        self, most: int, idle_s: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._most, self._idle_s, self._clock = most, idle_s, clock
        self._robots: OrderedDict[str, Robot] = OrderedDict()

    def __len__(self) -> int:
        self._forget_idle()
        return len(self._robots)

    def names(self) -> list[str]:
        """Return the names of all robots."""
        self._forget_idle()
        return sorted(self._robots)

    def find(self, name: str) -> Robot | None:
        """Return a robot; None if it is unknown."""
        self._forget_idle()
        return self._robots.get(name)

    def report(self, name: str) -> Robot:
        """Return a robot that reports now, known or new."""
        self._forget_idle()
        # The order of the robots is that of their last reports.
        robot = self._robots.setdefault(name, Robot())
        self._robots.move_to_end(name)
        if len(self._robots) > self._most:
            self._robots.popitem(last=False)
        robot.seen = self._clock()
        return robot

    def forget(self, name: str) -> bool:
        """Forget a robot; False if it is unknown."""
        return self._robots.pop(name, None) is not None

    def _forget_idle(self) -> None:
        oldest = self._clock() - self._idle_s
        while self._robots:
            name, robot = next(iter(self._robots.items()))
            if robot.seen >= oldest:
                return
            del self._robots[name]
