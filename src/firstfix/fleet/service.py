"""What the service does with a query: a place in the queue, a deadline, a memory of robots."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

from firstfix.belief.view import View
from firstfix.core.errors import InputError
from firstfix.core.settings import check_settings, setting
from firstfix.fleet.fleet import Fleet, NotReadyError
from firstfix.fleet.messages import Asked
from firstfix.fleet.sessions import Sessions
from firstfix.site.query import SitePrior
from firstfix.site.result import SiteResult
from firstfix.site.site_belief import SiteBelief

T = TypeVar("T")


RUNNING = 2
"""Queries that run at once on each copy of the site: one is searched while the other is judged. The
others wait for their turn, so that the first come are not as late as the last.
"""


class BusyError(Exception):
    """Too many queries wait, or this robot waits already; its text is a sentence."""


@dataclass(frozen=True, slots=True)
class FleetConfig:
    """Limits of a fleet service."""

    most_waiting: int = setting(256, "queries that run or wait", 1, 100_000)
    most_robots: int = setting(1000, "robots that are remembered", 1, 100_000)
    idle_s: float = setting(600.0, "time of silence after which a robot is forgotten, s", 1.0, 1e6)
    answer_s: float = setting(30.0, "longest time to an answer once it is its turn, s", 0.1, 3600.0)

    def __post_init__(self) -> None:
        check_settings(self)


@dataclass(eq=False)
class Service:
    """Answers queries, as many at once as the limits allow.

    Parameters
    ----------
    fleet : Fleet
        Locates robots.
    config : FleetConfig
        Limits.
    """

    fleet: Fleet
    config: FleetConfig = field(default_factory=FleetConfig)
    sessions: Sessions = field(init=False)
    verdicts: Counter[str] = field(default_factory=Counter)
    waiting: int = 0
    _turns: asyncio.Semaphore = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.sessions = Sessions(self.config.most_robots, self.config.idle_s)
        self._turns = asyncio.Semaphore(RUNNING * self.fleet.copies)

    async def locate(self, asked: Asked) -> dict[str, Any]:
        """Answer one query.

        Raises
        ------
        BusyError
            If too many queries wait.
        NotReadyError
            If there is no answer now.
        """
        result = await self._in_time(partial(self.fleet.locate, asked.query, asked.only))
        return self._counted(result)

    async def locate_robot(self, name: str, view: View, prior: SitePrior | None) -> dict[str, Any]:
        """Judge a view of a robot together with its last ones.

        Raises
        ------
        BusyError
            If too many queries wait, or the last scan of this robot is still judged.
        InputError
            If the view does not follow the one before, or the prior does not fit its map: the robot
            begins anew.
        NotReadyError
            If there is no answer now.
        """
        robot = self.sessions.report(name)
        if robot.turn.locked():
            raise BusyError("The scan before is still judged. Send one at a time.")
        async with robot.turn:
            try:
                result, robot.belief = await self._in_time(
                    partial(self.fleet.follow, robot.belief, view, prior)
                )
            except InputError:
                robot.belief = SiteBelief()
                raise
            robot.answer = {**self._counted(result), "views": len(robot.belief.views)}
        return robot.answer

    def _counted(self, result: SiteResult) -> dict[str, Any]:
        self.verdicts[result.verdict.value] += 1
        return result.to_dict()

    async def _in_time(self, ask: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """Wait in the queue, and then for a limited time for an answer."""
        async with self._place_in_queue(), self._turns:
            try:
                return await asyncio.wait_for(ask(), self.config.answer_s)
            except asyncio.TimeoutError:
                raise NotReadyError(
                    f"There was no answer within {self.config.answer_s:g} s. Try again later."
                ) from None

    @asynccontextmanager
    async def _place_in_queue(self) -> AsyncIterator[None]:
        if self.waiting >= self.config.most_waiting:
            raise BusyError("Too many queries are waiting. Try again in a second.")
        self.waiting += 1
        try:
            yield
        finally:
            self.waiting -= 1
