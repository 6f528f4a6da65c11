"""The parts behind the page and the API of one robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from starlette.exceptions import HTTPException

from firstfix.web.access_control import AccessPolicy
from firstfix.web.command_executor import CommandExecutor
from firstfix.web.incidents import GetKeeper, no_keeper
from firstfix.web.map_changes import ChangesCache
from firstfix.web.map_png import MapPngCache
from firstfix.web.messages import Hello, Map, encode_text
from firstfix.web.rate_limiter import RateLimiter
from firstfix.web.snapshot import ActiveMap
from firstfix.web.snapshot_store import SnapshotStore

READ_ONLY = "This server is read-only. Restart it without --read-only to allow this."


def _do_nothing() -> None:
    """Do nothing."""


@dataclass(frozen=True, eq=False, slots=True)
class Page:
    """The page and the API of one robot.

    Parameters
    ----------
    robot : str
        sim, ros1, ros2 or dds.
    store : SnapshotStore
        What is shown.
    executor : CommandExecutor
        Executes the commands of viewers.
    access : AccessPolicy
        Who may see and who may steer.
    on_first_viewer : callable
        Called when the first viewer connects.
    rate_limiter : RateLimiter
        Limits the requests of each client.
    map_pngs : MapPngCache
        Encodes maps.
    changes : ChangesCache
        Finds what has changed in the map.
    incidents : callable
        Returns what keeps the incidents; None while there is nothing.
    """

    robot: str
    store: SnapshotStore
    executor: CommandExecutor
    access: AccessPolicy = field(default_factory=AccessPolicy)
    on_first_viewer: Callable[[], None] = _do_nothing
    rate_limiter: RateLimiter = field(default_factory=RateLimiter)
    map_pngs: MapPngCache = field(default_factory=MapPngCache)
    changes: ChangesCache = field(default_factory=ChangesCache)
    incidents: GetKeeper = no_keeper

    def hello(self) -> str:
        """Return the first message to a viewer."""
        active_map = self.store.snapshot.map
        return encode_text(
            Hello(
                robot=self.robot,
                may_steer=self.access.may_steer,
                abilities=self.executor.abilities,
                menus=self.executor.menus,
                map=None if active_map is None else Map.of(active_map),
                events=self.store.events(),
            )
        )

    def map(self) -> ActiveMap:
        """Return the map in use.

        Raises
        ------
        HTTPException
            503 while there is none.
        """
        active_map = self.store.snapshot.map
        if active_map is None:
            raise HTTPException(503, "There is no map yet.", {"retry-after": "1"})
        return active_map

    def check_may_steer(self) -> None:
        """Refuse commands on a read-only server.

        Raises
        ------
        HTTPException
            403 if it is read-only.
        """
        if not self.access.may_steer:
            raise HTTPException(403, READ_ONLY)
