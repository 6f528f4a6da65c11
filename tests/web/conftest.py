"""A real browser and the servers that it visits."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))

import page_lab
from recorder import Recorder
from required import missing


@pytest.fixture(scope="session")
def browser_is_there() -> None:
    """Skip where there is no browser."""
    if why := page_lab.why_missing():
        missing("browser", why)


@pytest.fixture(scope="module")
def chromium(browser_is_there: None) -> Iterator[page_lab.Profiles]:
    """Give a browser; for a module, because its event loop is in the way of others."""
    with page_lab.chromium() as browser:
        yield page_lab.Profiles(browser)


@pytest.fixture
def visit(chromium: page_lab.Profiles) -> Iterator[Callable[..., page_lab.Visit]]:
    """Give a function that opens a page; none of them may have logged an error."""
    visits: list[page_lab.Visit] = []

    def open_page(
        url: str,
        device: dict[str, Any] = page_lab.DESKTOP,
        *,
        is_invited: bool = False,
        color_scheme: Literal["light", "dark"] = "light",
        **options: Any,
    ) -> page_lab.Visit:
        profile = chromium.like_new(url, **device, **options)
        visits.append(page_lab.Visit(profile, url, color_scheme, is_invited=is_invited))
        return visits[-1]

    yield open_page
    for visited in visits:
        visited.page.close()
    assert [problem for visited in visits for problem in visited.problems] == []


@pytest.fixture(scope="session")
def office_server(browser_is_there: None) -> Iterator[page_lab.Server]:
    """Give a robot in an office, where one scan is enough."""
    server = page_lab.Server("office", "--seed", "1").start()
    yield server
    server.stop()


@pytest.fixture(scope="module")
def rooms_server(chromium: Any) -> Iterator[page_lab.Server]:
    """Give a robot in one of four identical rooms."""
    server = page_lab.Server("rooms", "--seed", "1").start()
    yield server
    server.stop()


@pytest.fixture
def changing_server(chromium: Any) -> Iterator[page_lab.Server]:
    """Give a robot of one test alone, which changes its world."""
    server = page_lab.Server("office", "--seed", "1").start()
    yield server
    server.stop()


@pytest.fixture
def recorder(ros2: Any) -> Recorder:
    """Give a transport that records what is published, with messages of ROS 2."""
    return Recorder(ros2)
