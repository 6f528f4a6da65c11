"""What the service does with a query: a place in the queue, a deadline, a memory of robots."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

from firstfix.core.settings import check_settings, setting
from firstfix.fleet.fleet import Fleet, NotReadyError
from firstfix.fleet.messages import Asked
from firstfix.fleet.sessions import Robot, RobotView, Sessions, with_view
from firstfix.site.query import SitePrior, SiteQuery


class BusyError(Exception):
    """Too many queries wait, or this robot waits already; its text is a sentence."""


@dataclass(frozen=True, slots=True)
class FleetConfig:
    """Limits of a fleet service."""

    most_waiting: int = setting(256, "queries that run or wait", 1, 100_000)
    most_robots: int = setting(1000, "robots that are remembered", 1, 100_000)
    idle_s: float = setting(600.0, "time of silence after which a robot is forgotten, s", 1.0, 1e6)
    answer_s: float = setting(30.0, "longest time to an answer, s", 0.1, 3600.0)

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

    def __post_init__(self) -> None:
        self.sessions = Sessions(self.config.most_robots, self.config.idle_s)

    async def locate(self, asked: Asked) -> dict[str, Any]:
        """Answer one query.

        Raises
        ------
        BusyError
            If too many queries wait.
        NotReadyError
            If there is no answer now.
        """
        async with self._place_in_queue():
            try:
                result = await asyncio.wait_for(
                    self.fleet.locate(asked.query, asked.only), self.config.answer_s
                )
            except asyncio.TimeoutError:
                raise NotReadyError(
                    f"There was no answer within {self.config.answer_s:g} s. Try again later."
                ) from None
        self.verdicts[result.verdict.value] += 1
        return result.to_dict()

    async def locate_robot(
        self, name: str, view: RobotView, prior: SitePrior | None
    ) -> dict[str, Any]:
        """Judge a view of a robot together with its last ones.

        Raises
        ------
        TooManyRobotsError
            If the robot is new and there are too many.
        BusyError
            If the last scan of this robot is still judged.
        """
        robot: Robot = self.sessions.report(name)
        if robot.turn.locked():
            raise BusyError("The scan before is still judged. Send one at a time.")
        async with robot.turn:
            views = with_view(robot.views, view)
            query = SiteQuery.of(
                [scan for each in views for scan in each.scans],
                [each.T_odom_base for each in views for _ in each.scans],
                prior,
            )
            answer = await self.locate(Asked(query))
            robot.views, robot.answer = views, {**answer, "views": len(views)}
        return robot.answer

    @asynccontextmanager
    async def _place_in_queue(self) -> AsyncIterator[None]:
        if self.waiting >= self.config.most_waiting:
            raise BusyError("Too many queries are waiting. Try again in a second.")
        self.waiting += 1
        try:
            yield
        finally:
            self.waiting -= 1
