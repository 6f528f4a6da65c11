"""What the page and the API of one robot are made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from starlette.exceptions import HTTPException

from firstfix.web.access_control import AccessPolicy
from firstfix.web.command_executor import CommandExecutor
from firstfix.web.map_png import MapPngCache
from firstfix.web.messages import as_text, hello_message
from firstfix.web.rate_limiter import RateLimiter
from firstfix.web.snapshot import ActiveMap
from firstfix.web.snapshot_store import SnapshotStore


def _greet_nobody() -> None:
    """Do nothing."""


@dataclass(frozen=True, eq=False, slots=True)
class Page:
    """The page and the API of one robot.

    Parameters
    ----------
    robot : str
        sim, ros1, ros2 or dds.
    store : SnapshotStore
        What there is to be seen.
    executor : CommandExecutor
        Carries out what people want.
    access : AccessPolicy
        What is asked of clients.
    greet : callable
        Called when the first viewer comes.
    allowance : RateLimiter
        How much clients may still ask for.
    pictures : MapPngCache
        Of maps.
    """

    robot: str
    store: SnapshotStore
    executor: CommandExecutor
    access: AccessPolicy = field(default_factory=AccessPolicy)
    greet: Callable[[], None] = _greet_nobody
    allowance: RateLimiter = field(default_factory=RateLimiter)
    pictures: MapPngCache = field(default_factory=MapPngCache)

    def hello(self) -> str:
        """Write the message that a viewer gets first."""
        message: dict[str, Any] = hello_message(
            self.robot,
            self.executor.abilities,
            self.store.snapshot.map,
            self.store.events(),
            may_steer=self.access.may_steer,
        )
        return as_text(message)

    def map(self) -> ActiveMap:
        """Return the map in use.

        Raises
        ------
        HTTPException
            503 if there is none yet.
        """
        active_map = self.store.snapshot.map
        if active_map is None:
            raise HTTPException(503, "there is no map yet", {"retry-after": "1"})
        return active_map

    def check_may_steer(self) -> None:
        """Refuse those who may only watch.

        Raises
        ------
        HTTPException
            403 if that is so.
        """
        if not self.access.may_steer:
            raise HTTPException(403, "the server was started with --read-only")
