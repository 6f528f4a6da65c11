"""What the page and the API of one robot are made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from starlette.exceptions import HTTPException

from firstfix.web.feed import Feed
from firstfix.web.guard import Access
from firstfix.web.map_picture import MapPictures
from firstfix.web.messages import as_text, hello_object
from firstfix.web.rate_limiter import RateLimiter
from firstfix.web.steering import Steering
from firstfix.web.view import ShownMap


def _greet_nobody() -> None:
    """Do nothing."""


@dataclass(frozen=True, eq=False, slots=True)
class Page:
    """The page and the API of one robot.

    Parameters
    ----------
    robot : str
        sim, ros1, ros2 or dds.
    feed : Feed
        What there is to be seen.
    steering : Steering
        Carries out what people want.
    access : Access
        What is asked of clients.
    greet : callable
        Called when the first viewer comes.
    allowance : RateLimiter
        How much clients may still ask for.
    pictures : MapPictures
        Of maps.
    """

    robot: str
    feed: Feed
    steering: Steering
    access: Access = field(default_factory=Access)
    greet: Callable[[], None] = _greet_nobody
    allowance: RateLimiter = field(default_factory=RateLimiter)
    pictures: MapPictures = field(default_factory=MapPictures)

    def hello(self) -> str:
        """Write the message that a viewer gets first."""
        message: dict[str, Any] = hello_object(
            self.robot,
            self.steering.abilities,
            self.feed.view.map,
            self.feed.events(),
            may_steer=self.access.may_steer,
        )
        return as_text(message)

    def map(self) -> ShownMap:
        """Return the map in use.

        Raises
        ------
        HTTPException
            503 if there is none yet.
        """
        shown = self.feed.view.map
        if shown is None:
            raise HTTPException(503, "there is no map yet", {"retry-after": "1"})
        return shown

    def check_may_steer(self) -> None:
        """Refuse those who may only watch.

        Raises
        ------
        HTTPException
            403 if that is so.
        """
        if not self.access.may_steer:
            raise HTTPException(403, "the server was started with --read-only")
