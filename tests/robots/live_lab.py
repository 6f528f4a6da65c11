"""Servers of the live page in this process, on free loopback ports, and what is behind them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.live.simulated_node import SimulatedNode
from firstfix.lab.live.simulated_robot import SimulatedRobot
from firstfix.lab.worlds.catalog import WORLDS
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.web.access_control import AccessPolicy
from firstfix.web.command_executor import CommandExecutor
from firstfix.web.page import Page
from firstfix.web.server import listen, make_server, url_of
from firstfix.web.snapshot_store import SnapshotStore

WAIT_S = 180.0


def until(holds: Callable[[], Any], what: str = "it", patience_s: float = WAIT_S) -> Any:
    """Wait until something holds; no test depends on how long that takes."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        value = holds()
        if value:
            return value
        time.sleep(0.01)
    pytest.fail(f"waited {patience_s:g} s for {what}")


@dataclass
class Site:
    """A page that is served, and what is behind it."""

    page: Page
    url: str
    given: list[Input] = field(default_factory=list)
    robot: SimulatedRobot | None = None

    @property
    def store(self) -> SnapshotStore:
        return self.page.store

    @property
    def live(self) -> str:
        return self.url.replace("http", "ws") + "v1/live"


@contextmanager
def served(page: Page) -> Iterator[str]:
    """Serve a page; gives its URL."""
    with listen("127.0.0.1", 0) as listening:
        server = make_server(page)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        until(lambda: server.started or not thread.is_alive())
        try:
            yield url_of(listening)
        finally:
            server.should_exit = True
            thread.join()


@contextmanager
def fed(access: AccessPolicy | None = None, store: SnapshotStore | None = None) -> Iterator[Site]:
    """Serve a page of which nothing is known but what the test feeds it."""
    given: list[Input] = []
    store = store or SnapshotStore("test")
    page = Page("ros2", store, CommandExecutor(store, given.append), access or AccessPolicy())
    with served(page) as url:
        yield Site(page, url, given)


@contextmanager
def simulated(
    grid: OccupancyGrid, seed: int = 1, access: AccessPolicy | None = None
) -> Iterator[Site]:
    """Serve a simulated robot."""
    store = SnapshotStore("house")
    robot = SimulatedRobot(grid, seed)
    wrong: list[str] = []
    node = SimulatedNode(robot, store, wrong.append)
    page = Page("sim", store, CommandExecutor(store, node.give, robot), access or AccessPolicy())
    with served(page) as url:
        node.start()
        try:
            yield Site(page, url, robot=robot)
        finally:
            node.stop()
    assert wrong == []


@dataclass
class Drive:
    """A robot that takes one scan at a time, when the test asks for it."""

    robot: SimulatedRobot
    localizer: Localizer
    store: SnapshotStore

    def give(self, given: Input) -> None:
        self.store(given, self.localizer.handle(given), self.localizer)

    def step(self, scans: int = 1) -> None:
        for _ in range(scans):
            moment = self.robot.step()
            if moment is not None:
                self.store.set_truth(moment.T_map_base)
                for event in moment.events:
                    self.give(event)


def drive(world: str = "house", seed: int = 1) -> Drive:
    """Put a robot into a world, with its map and not yet a scan."""
    grid = WORLDS[world]()
    begun = Drive(SimulatedRobot(grid, seed), Localizer(), SnapshotStore(world))
    begun.give(NewMap(0.0, grid))
    return begun
