"""Many robots that ask at once."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from firstfix.core.estimate import Verdict
from firstfix.fleet.messages import Asked
from firstfix.fleet.service import RUNNING, BusyError, FleetConfig, Service

ROBOTS = 50


@dataclass
class SlowFleet:
    """Answers when it is told to, in the order of the questions."""

    copies: int = 3
    begun: list[Any] = field(default_factory=list)
    may_end: list[asyncio.Event] = field(default_factory=list)

    async def locate(self, query: Any, _: str | None) -> Any:
        self.begun.append(query)
        self.may_end.append(asyncio.Event())
        await self.may_end[-1].wait()
        return SimpleNamespace(verdict=Verdict.UNIQUE, to_dict=lambda: {"query": query})


async def settle() -> None:
    for _ in range(20):
        await asyncio.sleep(0.0)


def test_fifty_robots_at_once_are_all_answered_in_their_order() -> None:
    fleet = SlowFleet()
    service = Service(fleet)  # type: ignore[arg-type]

    async def drive() -> list[dict[str, Any]]:
        asked = [asyncio.create_task(service.locate(Asked(i))) for i in range(ROBOTS)]  # type: ignore[arg-type]
        for answered in range(ROBOTS):
            await settle()
            assert fleet.begun == list(range(min(ROBOTS, answered + RUNNING * fleet.copies)))
            assert service.waiting == ROBOTS - answered
            fleet.may_end[answered].set()
        return await asyncio.gather(*asked)

    assert asyncio.run(drive()) == [{"query": i} for i in range(ROBOTS)]
    assert service.verdicts == {"UNIQUE": ROBOTS}


def test_only_what_is_beyond_the_limit_is_refused() -> None:
    fleet = SlowFleet()
    service = Service(fleet, FleetConfig(most_waiting=ROBOTS))  # type: ignore[arg-type]

    async def drive() -> None:
        asked = [asyncio.create_task(service.locate(Asked(i))) for i in range(ROBOTS)]  # type: ignore[arg-type]
        await settle()
        with pytest.raises(BusyError, match="Too many queries are waiting"):
            await service.locate(Asked(ROBOTS))  # type: ignore[arg-type]
        for answered in range(ROBOTS):
            fleet.may_end[answered].set()
            await settle()
        assert len(await asyncio.gather(*asked)) == ROBOTS
        assert service.waiting == 0

    asyncio.run(drive())
