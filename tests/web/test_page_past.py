"""The page looks back at the last minutes, and folds events of one kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from page_lab import PHONE, Server, Visit, wait_until

pytestmark = pytest.mark.slow

Visitor = Callable[..., Visit]


@pytest.fixture
def page(visit: Visitor, office_server: Server) -> Visit:
    """Give the page of a localized robot."""
    visited = visit(office_server.url)
    visited.wait_for_fix()
    return visited


def scrub_to(page: Visit, moment: int) -> None:
    """Drag the slider to a moment, counted from the oldest."""
    page.page.locator("#scrub").evaluate(
        "(slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')); }",
        moment,
    )


def moments(page: Visit) -> int:
    """Return how many moments the page has kept."""
    return int(page.page.get_attribute("#scrub", "max")) + 1


def test_the_time_before_a_kidnap_is_looked_at_again(page: Visit, tmp_path: Path) -> None:
    wait_until(lambda: moments(page) > 8, lambda: f"{moments(page)} moments")
    before, kept = page.pose("truth"), moments(page)
    page.page.click("#kidnap")
    wait_until(
        lambda: math.dist(page.pose("truth")[:2], before[:2]) > 0.5, lambda: "it is elsewhere"
    )
    page.wait_for_state("LOCALIZED")
    scrub_to(page, kept - 2)
    assert page.data("time") == "past"
    assert math.dist(page.pose("truth")[:2], before[:2]) < 0.5
    assert page.page.is_visible("#past")
    shown, received = page.pose("truth"), moments(page)
    wait_until(lambda: moments(page) > received + 4, lambda: "it goes on")
    assert page.pose("truth") == shown  # what is looked at stays
    page.shot(tmp_path / "past.png")
    print(tmp_path / "past.png")  # noqa: T201 - for people
    page.page.click("#past-live")
    assert page.data("time") == "live"
    assert page.page.is_hidden("#past")
    assert math.dist(page.pose("truth")[:2], before[:2]) > 0.5


def test_keys_and_events_lead_into_the_past_and_a_command_back(page: Visit) -> None:
    wait_until(lambda: moments(page) > 8, lambda: f"{moments(page)} moments")
    for _ in range(3):
        page.page.keyboard.press(",")
    assert page.data("time") == "past"
    page.page.keyboard.press("Escape")
    assert page.data("time") == "live"
    page.page.focus("#scrub")
    page.page.keyboard.press("Home")
    assert page.data("time") == "past"
    page.page.keyboard.press("End")
    assert page.data("time") == "live"
    page.page.click("#relocalize")
    page.wait_for_event("Relocalization requested")
    page.page.locator("#events li", has_text="Relocalization").first.locator("span").first.click()
    assert page.data("time") == "past"
    page.page.click("#pause")
    assert page.data("time") == "live"
    page.page.click("#pause")


def add_event(page: Visit, number: int, text: str) -> None:
    """Insert an event, newer than every moment."""
    page.page.evaluate(
        """async ([number, text]) => {
            const { Timeline } = await import("/static/timeline.js");
            new Timeline().add({ number, stamp: 1e9, kind: "state", text });
        }""",
        [number, text],
    )


def test_an_event_newer_than_the_newest_moment_can_be_looked_at(page: Visit) -> None:
    add_event(page, 1000, "Just now")
    page.page.get_by_text("Just now").click()
    assert page.data("time") == "past"
    shown = page.page.text_content("#past-text")
    kept = moments(page)
    wait_until(lambda: moments(page) > kept + 2, lambda: "it goes on")
    assert page.page.text_content("#past-text") == shown


def test_a_click_counts_for_the_row_that_was_pressed(page: Visit) -> None:
    add_event(page, 1000, "Pressed")
    page.page.get_by_text("Pressed").hover()
    page.page.mouse.down()
    for number, text in enumerate(("One more", "And another"), 1001):
        add_event(page, number, text)
    page.page.mouse.up()
    assert page.data("time") == "past"


def test_the_past_is_bounded(page: Visit) -> None:
    page.page.evaluate("""async () => {
        const { Past } = await import("/static/past.js");
        const past = new Past({ onLook() {}, onLive() {} });
        const nothing = { scan: null, heat: null };
        for (let i = 0; i < 4000; i += 1) {
            past.record({ stamp: 0.2 * i, state: "LIFTED", pose: null }, nothing);
        }
        document.title = document.getElementById("scrub").max;
    }""")
    assert page.page.title() == "1499"


def test_another_map_begins_another_past(changing_server: Server, visit: Visitor) -> None:
    page = visit(changing_server.url)
    page.wait_for_fix()
    wait_until(lambda: moments(page) > 8, lambda: f"{moments(page)} moments")
    page.page.keyboard.press(",")
    page.page.select_option("#world", "hotel")
    page.page.wait_for_selector("#app[data-map=hotel]")
    assert page.data("time") == "live"
    assert moments(page) < 8


def test_events_of_one_kind_are_folded(visit: Visitor, office_server: Server) -> None:
    page = visit(office_server.url, PHONE)
    page.wait_for_fix()
    page.page.tap("#sheet-handle")
    slider = page.page.locator("#people")
    for count in (4, 3, 2, 0):
        slider.fill(str(count))
        page.wait_for_event(f"{count} people")
    newest = page.page.locator("#events > li").first
    assert newest.locator("> span").inner_text() == "0 people walk around the robot"
    button = newest.get_by_role("button", name="Show 3 earlier like this")
    older = newest.locator("li")
    assert older.count() == 3
    assert not older.first.is_visible()
    button.tap()
    assert older.first.is_visible()
    assert "2 people" in older.first.inner_text()
