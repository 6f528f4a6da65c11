"""What the service remembers of each robot: its last views, for a joint verdict."""

from __future__ import annotations

import asyncio
import math
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from firstfix.belief.belief import NEWS_M, NEWS_RAD
from firstfix.belief.several import LONGEST_STEP_M
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2

VIEWS = 4
"""Views of a robot that are judged together. Each is searched anew, so more take longer."""


class TooManyRobotsError(Exception):
    """No more robots can be remembered."""


@dataclass(frozen=True, eq=False, slots=True)
class RobotView:
    """The scans of one time, and ``T_odom_base`` then."""

    scans: tuple[LaserScan, ...]
    T_odom_base: SE2


@dataclass(eq=False, slots=True)
class Robot:
    """One robot.

    Parameters
    ----------
    views : tuple of RobotView
        The last ones that brought news, oldest first.
    answer : dict or None
        The last answer.
    seen : float
        When it last reported, s, on the clock of the sessions.
    turn : asyncio.Lock
        Held while a scan of this robot is judged.
    """

    views: tuple[RobotView, ...] = ()
    answer: dict[str, Any] | None = None
    seen: float = 0.0
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)


def with_view(views: Sequence[RobotView], view: RobotView) -> tuple[RobotView, ...]:
    """Add a view to those of a robot.

    Parameters
    ----------
    views : sequence of RobotView
        Those before, oldest first.
    view : RobotView
        The newest.

    Returns
    -------
    tuple of RobotView
        At most `VIEWS`. A view from the pose of the one before replaces it; where the odometry
        jumped, it was started anew, and nothing before counts.
    """
    if not views:
        return (view,)
    step = views[-1].T_odom_base.inverse() @ view.T_odom_base
    moved = math.hypot(step.x, step.y)
    if moved > LONGEST_STEP_M:
        return (view,)
    has_news = len(views) == 1 or _brings_news(views[-2], views[-1])
    kept = views if has_news else views[:-1]
    return (*kept, view)[-VIEWS:]


def _brings_news(before: RobotView, view: RobotView) -> bool:
    step = before.T_odom_base.inverse() @ view.T_odom_base
    return math.hypot(step.x, step.y) >= NEWS_M or abs(step.yaw) >= NEWS_RAD


class Sessions:
    """The robots that the service remembers.

    Parameters
    ----------
    most : int
        Number of robots at most.
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
        """Return a robot that reports now, known or new.

        Raises
        ------
        TooManyRobotsError
            If it is new and there are too many.
        """
        self._forget_idle()
        if name not in self._robots and len(self._robots) >= self._most:
            raise TooManyRobotsError
        # The order of the robots is that of their last reports.
        robot = self._robots.setdefault(name, Robot())
        self._robots.move_to_end(name)
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
