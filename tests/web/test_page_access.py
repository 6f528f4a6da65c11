"""Token, read-only server, and a lost connection."""

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
    """Give a server with a token."""
    server = Server("office", "--token", TOKEN).start()
    yield server
    server.stop()


@pytest.fixture(scope="module")
def watched(chromium: Any) -> Iterator[Server]:
    """Give a read-only server."""
    server = Server("office", "--read-only").start()
    yield server
    server.stop()


def test_the_page_reconnects_to_a_restarted_server(visit: Visitor, chromium: Any) -> None:
    server = Server("office").start()
    page = visit(server.url)
    page.wait_for_fix()
    server.kill()
    page.page.wait_for_selector("#connection-lost", state="visible")
    assert page.data("connected") == "false"
    assert page.page.inner_text("#last-known") == "last known"
    page.page.click("#relocalize")
    page.page.wait_for_selector("#error-notice", state="visible")
    server.start()
    try:
        page.page.wait_for_selector("#connection-lost", state="hidden")
        page.wait_for_state("LOCALIZED")
        assert page.data("connected") == "true"
        assert page.page.is_hidden("#last-known")
    finally:
        server.stop()
    page.page.wait_for_selector("#connection-lost", state="visible")
    page.page.close()  # it asks no more
    # The test stopped the server on purpose.
    page.problems = [problem for problem in page.problems if "net::ERR_CONNECTION" not in problem]


def test_the_token_can_be_in_the_link(visit: Visitor, guarded: Server) -> None:
    page = visit(f"{guarded.url}#token={TOKEN}")
    page.wait_for_fix()
    assert page.page.url == guarded.url  # it is neither visible nor bookmarked
    page.page.reload()
    page.wait_for_fix()
    assert page.page.is_hidden("#token-dialog")


def test_a_visitor_without_a_token_is_asked_for_it(visit: Visitor, guarded: Server) -> None:
    page = visit(guarded.url)
    for token in ("not the token", TOKEN):
        page.page.wait_for_selector("#token-dialog[open]")
        assert page.data("map") == ""
        page.page.fill("#token", token)
        page.page.keyboard.press("Enter")
    page.wait_for_fix()
    assert page.page.is_hidden("#token-dialog")
    page.problems = [problem for problem in page.problems if "401" not in problem]


def test_a_visitor_with_an_old_token_is_asked_again(visit: Visitor, guarded: Server) -> None:
    page = visit(f"{guarded.url}#token=of-yesterday")
    page.page.wait_for_selector("#token-dialog[open]")
    page.problems = [problem for problem in page.problems if "401" not in problem]


def test_a_read_only_page_has_no_commands(visit: Visitor, watched: Server) -> None:
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


def test_several_viewers_at_once(visit: Visitor, watched: Server) -> None:
    pages = [visit(watched.url) for _ in range(3)]
    for page in pages:
        page.wait_for_state("LOCALIZED")
    viewers = pages[0].page.locator("#viewers")
    wait_until(lambda: int(viewers.inner_text()) >= 3, viewers.inner_text)
