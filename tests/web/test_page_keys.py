"""The page with a keyboard and with a screen reader."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from page_lab import DESKTOP, PHONE, Server, Visit, wait_until

pytestmark = pytest.mark.slow

Visitor = Callable[..., Visit]


@pytest.fixture
def page(visit: Visitor, office_server: Server) -> Visit:
    """Give the page of a localized robot."""
    visited = visit(office_server.url)
    visited.wait_for_fix()
    return visited


def view_of(page: Visit) -> tuple[float, ...]:
    """Return scale and centre."""
    page.page.wait_for_timeout(150)
    page.wait_for_frames()
    return tuple(float(value) for value in page.data("view").split()[:3])


def test_keys_move_the_map(page: Visit) -> None:
    scale, x, y = view_of(page)
    page.page.keyboard.press("+")
    larger, *_ = view_of(page)
    assert larger == pytest.approx(1.3 * scale, rel=1e-3)
    page.page.keyboard.press("ArrowRight")
    _, right, _ = view_of(page)
    assert right == pytest.approx(x + 70.0 / larger, abs=1e-3)
    page.page.keyboard.press("ArrowUp")
    assert view_of(page)[2] == pytest.approx(y + 70.0 / larger, abs=1e-3)
    page.page.keyboard.press("-")
    page.page.keyboard.press("f")
    assert view_of(page) == pytest.approx((scale, x, y), abs=1e-3)


def test_keys_set_the_pose(page: Visit) -> None:
    keyboard = page.page.keyboard
    keyboard.press("l")
    keyboard.press(" ")
    page.page.wait_for_selector("#paused", state="visible")
    page.wait_for_rest()
    scale, *_ = view_of(page)
    x, y, _ = page.pose()
    keyboard.press("p")
    assert page.data("mode") == "pose"
    for _ in range(3):
        keyboard.press("ArrowRight")
    keyboard.press("Shift+ArrowLeft")
    keyboard.press("Enter")
    match = page.wait_for_event(r"Hint from.* \((-?[\d.]+), (-?[\d.]+)\)")
    shown = float(match[1]), float(match[2])
    assert math.dist(shown, (x + 24.0 / scale, y)) < 0.05
    assert page.data("mode") == "look"
    keyboard.press(" ")
    page.wait_for_state("LOCALIZED")


def test_escape_leaves_a_mode_without_a_command(page: Visit) -> None:
    before = page.events()
    for key, mode in (("p", "pose"), ("g", "goal"), ("c", "carry")):
        page.page.keyboard.press(key)
        assert page.data("mode") == mode
        assert page.page.is_visible("#mode-hint")
        page.page.keyboard.press("Escape")
        assert page.data("mode") == "look"
        assert page.page.is_hidden("#mode-hint")
    assert page.events() == before


def test_every_control_is_reached_by_tab_with_a_visible_focus(page: Visit) -> None:
    controls = page.page.locator("#app :is(button, input, canvas[tabindex]):visible").count()
    reached = set()
    for _ in range(controls + 6):
        page.page.keyboard.press("Tab")
        reached.add(
            page.page.evaluate("document.activeElement.id || document.activeElement.outerHTML")
        )
        outline = page.page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
        on_page = page.page.evaluate("document.activeElement !== document.body")
        assert not on_page or outline != "none"
    for control in page.page.locator("#app :is(button, input, canvas[tabindex]):visible").all():
        name = control.evaluate("(element) => element.id || element.outerHTML")
        assert name in reached


def test_the_space_bar_presses_a_focused_button(page: Visit) -> None:
    page.page.focus("#theme")
    dark = page.page.evaluate("document.getElementById('dark').media")
    page.page.keyboard.press(" ")
    assert page.page.evaluate("document.getElementById('dark').media") != dark
    assert page.page.is_hidden("#paused")


def test_changes_are_announced_to_screen_readers(page: Visit) -> None:
    spoken = page.page.locator("#spoken")
    assert spoken.get_attribute("aria-live") == "polite"
    wait_until(lambda: "localized" in spoken.inner_text().lower(), spoken.inner_text)
    page.page.keyboard.press("c")
    wait_until(lambda: "Press where" in spoken.inner_text(), spoken.inner_text)
    page.page.keyboard.press("Escape")
    count = """() => new Promise((done) => {
        let shown = 0;
        const watch = new MutationObserver(() => (shown += 1));
        watch.observe(document.getElementById("spoken"), { childList: true });
        setTimeout(() => done(shown), 2000);
    })"""
    page.page.wait_for_timeout(2500)
    assert page.page.evaluate(count) == 0  # scans that only confirm are not worth a word


def test_the_help_lists_the_keys(page: Visit) -> None:
    page.page.keyboard.press("?")
    assert page.page.is_visible("#help-dialog")
    for key in ("F", "P", "G", "C", "R", "Space", "Esc"):
        assert page.page.locator(f"#help-dialog kbd:text-is('{key}')").count() >= 1
    page.page.keyboard.press("Escape")
    assert page.page.is_hidden("#help-dialog")


# Of device, scheme and world each pair once; axe takes its time.
@pytest.mark.parametrize(
    ("device", "scheme", "world"),
    [
        pytest.param(DESKTOP, "light", "office", id="desktop-light-office"),
        pytest.param(DESKTOP, "dark", "rooms", id="desktop-dark-rooms"),
        pytest.param(PHONE, "light", "rooms", id="phone-light-rooms"),
        pytest.param(PHONE, "dark", "office", id="phone-dark-office"),
    ],
)
def test_axe_finds_no_serious_violation(
    visit: Visitor,
    request: pytest.FixtureRequest,
    device: dict[str, Any],
    scheme: str,
    world: str,
    tmp_path: Path,
) -> None:
    server: Server = request.getfixturevalue(f"{world}_server")
    page = visit(server.url, device, color_scheme=scheme, bypass_csp=True)
    page.wait_for_map()
    page.wait_for_state("LOCALIZED" if world == "office" else "DISAMBIGUATING")
    if device is PHONE:
        faults = serious_faults(page)
        page.page.tap("#sheet-handle")
    else:
        page.page.click("#mode-pose")
        faults = []
    faults += serious_faults(page)
    page.shot(tmp_path / "page.png")
    print(tmp_path / "page.png")  # noqa: T201 - for people
    page.page.keyboard.press("?")
    faults += serious_faults(page)
    assert faults == []


@pytest.mark.parametrize(
    ("device", "scheme"), [(DESKTOP, "dark"), (PHONE, "light")], ids=["desktop-dark", "phone-light"]
)
def test_axe_finds_no_serious_violation_in_tour_past_and_files(
    visit: Visitor, office_server: Server, device: dict, scheme: str, tmp_path: Path
) -> None:
    page = visit(office_server.url, device, color_scheme=scheme, bypass_csp=True)
    page.wait_for_fix()
    page.page.keyboard.press("t")
    faults = serious_faults(page)
    page.page.keyboard.press("Escape")
    (tmp_path / "map.yaml").write_text("image: map.pgm")
    page.page.set_input_files("#files", str(tmp_path / "map.yaml"))
    page.page.wait_for_selector("#dropped", state="visible")
    faults += serious_faults(page)
    page.page.click("#file-leave")
    wait_until(lambda: not page.page.is_disabled("#scrub"), lambda: "moments are kept")
    page.page.keyboard.press(",")
    page.page.wait_for_selector("#past", state="visible")
    faults += serious_faults(page)
    assert faults == []


def serious_faults(page: Visit) -> list[str]:
    """Return the serious violations that axe-core finds."""
    from axe_playwright_python.sync_playwright import Axe

    violations = Axe().run(page.page).response["violations"]
    return [
        f"{found['id']}: {node['html'][:90]} {node['failureSummary']}"
        for found in violations
        if found["impact"] in {"serious", "critical"}
        for node in found["nodes"]
    ]
