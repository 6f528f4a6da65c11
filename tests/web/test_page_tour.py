"""The guided tour of the page: three steps that the simulated robot executes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from page_lab import DESKTOP, PHONE, Server, Visit, wait_until

pytestmark = pytest.mark.slow

Visitor = Callable[..., Visit]


@pytest.fixture
def toured(changing_server: Server, visit: Visitor) -> Callable[..., Visit]:
    """Give a first visitor of a robot in an office."""
    return lambda **options: visit(changing_server.url, is_invited=True, **options)


def wait_for_text(page: Visit, words: str) -> str:
    """Wait until the tour says something, and return it."""
    text = page.page.locator("#tour-text")
    return wait_until(lambda: words in text.inner_text() and text.inner_text(), text.inner_text)


def test_three_steps_show_what_the_robot_does(toured: Callable[..., Visit], tmp_path: Path) -> None:
    page = toured()
    page.page.wait_for_selector("#tour", state="visible")
    page.page.click("#tour-next")
    assert page.page.inner_text("#tour-count") == "Step 1 of 3"
    found = wait_for_text(page, "Found before it moved")
    assert float(found.split(", ")[1].split(" cm")[0]) < 20.0
    page.page.click("#tour-next")
    wait_for_text(page, "without help")
    assert not [text for text in page.events() if "Picked up" in text]
    page.page.click("#tour-next")
    wait_for_text(page, "4 rooms fit equally well")
    assert page.data("state") == "DISAMBIGUATING"
    assert page.data("pose") == ""
    page.shot(tmp_path / "tour.png")
    print(tmp_path / "tour.png")  # noqa: T201 - for people
    page.page.click("#tour-decide")
    wait_for_text(page, "One place is left")
    assert page.data("state") == "LOCALIZED"
    page.page.click("#tour-next")
    assert page.page.is_hidden("#tour")
    page.page.reload()
    page.wait_for_map()
    assert page.page.is_hidden("#tour")  # it is offered once


@pytest.mark.parametrize("device", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_keys_start_and_leave_the_tour(
    office_server: Server, visit: Visitor, device: dict, tmp_path: Path
) -> None:
    page = visit(office_server.url, device, is_invited=True)
    page.wait_for_map()
    page.page.wait_for_selector("#tour", state="visible")
    page.shot(tmp_path / "invitation.png")
    print(tmp_path / "invitation.png")  # noqa: T201 - for people
    page.page.keyboard.press("Escape")
    assert page.page.is_hidden("#tour")
    page.page.keyboard.press("t")
    assert page.page.evaluate("document.activeElement.id") == "tour-next"
    page.page.keyboard.press("Enter")
    assert page.page.inner_text("#tour-title") == "Found from one scan"
    wait_for_text(page, "Found before it moved")
    page.page.keyboard.press("t")
    assert page.page.is_hidden("#tour")
