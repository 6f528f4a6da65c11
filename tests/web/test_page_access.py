"""Who may see the page, who may steer, and what happens when the robot goes away."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from page_lab import Server, Visit, wait_until

pytestmark = pytest.mark.slow

Visitor = Callable[..., Visit]
TOKEN = "fern-otter-91"  # noqa: S105 - of a test


@pytest.fixture(scope="module")
def guarded(chromium: Any) -> Iterator[Server]:
    """Give a robot that asks for a token."""
    server = Server("office", "--token", TOKEN).start()
    yield server
    server.stop()


@pytest.fixture(scope="module")
def watched(chromium: Any) -> Iterator[Server]:
    """Give a robot that may be watched only."""
    server = Server("office", "--read-only").start()
    yield server
    server.stop()


def test_a_restarted_robot_is_found_again(visit: Visitor, chromium: Any) -> None:
    server = Server("office").start()
    page = visit(server.url)
    page.wait_for_fix()
    server.kill()
    page.page.wait_for_selector("#connection-lost", state="visible")
    assert page.data("connected") == "false"
    page.page.click("#relocalize")
    page.page.wait_for_selector("#error-notice", state="visible")
    server.start()
    try:
        page.page.wait_for_selector("#connection-lost", state="hidden", timeout=60_000)
        page.wait_for_state("LOCALIZED")
        assert page.data("connected") == "true"
    finally:
        server.stop()
    page.page.wait_for_selector("#connection-lost", state="visible")
    # That nobody answered is what this was about.
    page.problems = [problem for problem in page.problems if "net::ERR_CONNECTION" not in problem]


def test_a_link_may_have_the_token(visit: Visitor, guarded: Server) -> None:
    page = visit(f"{guarded.url}#token={TOKEN}")
    page.wait_for_fix()
    assert page.page.url == guarded.url  # nobody reads it over a shoulder, or bookmarks it
    page.page.reload()
    page.wait_for_fix()
    assert page.page.is_hidden("#token-dialog")


def test_who_has_no_token_is_asked_for_it(visit: Visitor, guarded: Server) -> None:
    page = visit(guarded.url)
    for token in ("not the token", TOKEN):
        page.page.wait_for_selector("#token-dialog[open]")
        assert page.data("map") == ""
        page.page.fill("#token", token)
        page.page.keyboard.press("Enter")
    page.wait_for_fix()
    assert page.page.is_hidden("#token-dialog")
    page.problems = [problem for problem in page.problems if "401" not in problem]


def test_a_token_that_has_become_wrong_is_asked_for_anew(visit: Visitor, guarded: Server) -> None:
    page = visit(f"{guarded.url}#token=of-yesterday")
    page.page.wait_for_selector("#token-dialog[open]")
    page.problems = [problem for problem in page.problems if "401" not in problem]


def test_who_may_only_watch_sees_no_action(visit: Visitor, watched: Server) -> None:
    page = visit(watched.url)
    page.wait_for_fix()
    assert page.page.is_visible("#watching")
    for hidden in ("#tools", "#simulation"):
        assert page.page.is_hidden(hidden)
    for key in ("p", "g", "c", "r", " "):
        page.page.keyboard.press(key)
        assert page.data("mode") == "look"
    x, y, _ = page.pose()
    page.page.mouse.move(*page.pixel(x, y))
    page.page.mouse.down()
    page.page.wait_for_timeout(800)
    page.page.mouse.up()
    assert page.data("mode") == "look"
    page.page.keyboard.press("?")
    assert page.page.locator("#help-dialog .steer:visible").count() == 0
    assert not [text for text in page.events() if "Relocalization requested" in text]


def test_several_watch_at_once(visit: Visitor, watched: Server) -> None:
    pages = [visit(watched.url) for _ in range(3)]
    for page in pages:
        page.wait_for_state("LOCALIZED")
    viewers = pages[0].page.locator("#viewers")
    wait_until(lambda: int(viewers.inner_text()) >= 3, viewers.inner_text)
