"""The page in a real browser: it loads from the robot alone and shows its state."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_lab import DESKTOP, PHONE, Server, Visit, wait_until
from scipy import ndimage

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.lab.worlds.catalog import WORLDS

pytestmark = pytest.mark.slow

DEVICES = pytest.mark.parametrize("device", [DESKTOP, PHONE], ids=["desktop", "phone"])

# Of light.css, as the canvas shows them.
WALL, FREE = (0x27, 0x31, 0x3D, 255), (0xFB, 0xFC, 0xFD, 255)

Visitor = Callable[..., Visit]
Turned = tuple[OccupancyGrid, Server]


# Of device and scheme each once.
@pytest.mark.parametrize(
    ("device", "scheme"), [(DESKTOP, "light"), (PHONE, "dark")], ids=["desktop-light", "phone-dark"]
)
def test_the_robot_appears(
    visit: Visitor, office_server: Server, device: dict, scheme: str, tmp_path: Path
) -> None:
    page = visit(office_server.url, device, color_scheme=scheme)
    page.wait_for_fix()
    assert page.page.inner_text("#state-word") == "LOCALIZED"
    assert page.page.inner_text("#map-name") == "office"
    reason = page.page.locator("#reason")
    wait_until(
        lambda: re.fullmatch(r"\d+% of the beams fit\.", reason.inner_text()), reason.inner_text
    )
    assert page.page.is_visible("#tools")
    x, y, yaw = page.pose()
    aside = 6.0 / page.scale  # of the white arrow in the middle of the robot
    flank = page.colour("overlay", x - aside * math.sin(yaw), y + aside * math.cos(yaw))
    assert flank[2] > flank[0] + 60
    assert flank[3] == 255
    page.shot(tmp_path / "page.png")
    print(tmp_path / "page.png", page.page.evaluate(FIRST_PAINT))  # noqa: T201 - for people


FIRST_PAINT = """() => [
    ...performance.getEntriesByType("paint"), ...performance.getEntriesByName("map-shown"),
].map(({ name, startTime }) => `${name} ${Math.round(startTime)} ms`)"""


@DEVICES
def test_nothing_is_wider_than_the_window(
    visit: Visitor, office_server: Server, device: dict
) -> None:
    page = visit(office_server.url, device)
    page.wait_for_map()
    if device is PHONE:
        page.page.tap("#sheet-handle")
        page.page.wait_for_selector("#details", state="visible")
    outside = """() => [...document.querySelectorAll("#app *, #app")].filter((element) => {
        const box = element.getBoundingClientRect();
        const isShown = box.width > 1 && !element.closest("[hidden], canvas, .visually-hidden");
        return isShown && (box.left < -0.5 || box.right > innerWidth + 0.5);
    }).map((element) => element.id || element.outerHTML.slice(0, 60))"""
    assert page.page.evaluate(outside) == []
    assert page.page.evaluate("document.scrollingElement.scrollWidth <= innerWidth")


def test_controls_are_large_enough_for_fingers(visit: Visitor, office_server: Server) -> None:
    page = visit(office_server.url, PHONE)
    page.wait_for_map()
    page.page.tap("#sheet-handle")
    small = """() => [...document.querySelectorAll("button, input")].filter((element) => {
        const box = element.getBoundingClientRect();
        const isHandle = element.id === "sheet-handle"; // hit by what is drawn around it
        return box.width && !isHandle && (box.height < 44 || box.width < 44);
    }).map((element) => element.id || element.textContent)"""
    assert page.page.evaluate(small) == []


@pytest.fixture
def turned(chromium: Any, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Turned]:
    """Give a robot on a map with a turned origin and additional free columns."""
    yaw, columns = request.param
    plan = WORLDS["house"]().cells
    cells = np.pad(plan, ((0, 0), (columns, 0)))
    grid = OccupancyGrid(cells, 0.05, SE2(-3.0, 7.0, yaw))
    save_map(grid, tmp_path / "turned.yaml")
    server = Server(str(tmp_path / "turned.yaml")).start()
    yield grid, server
    server.stop()


# The last is wider than a picture may be: some cells share a pixel, and an odd one is left.
@pytest.mark.parametrize("turned", [(-2.0, 0), (0.3, 4321)], indirect=True)
def test_a_turned_map_lies_at_its_origin(turned: Turned, visit: Visitor) -> None:
    grid, server = turned
    page = visit(server.url, color_scheme="light")
    page.wait_for_map()
    page.look_at(*grid.to_map(np.array([grid.width - 130.0, grid.height / 2])))
    for cells, expected in ((grid.occupied, WALL), (grid.seen_free, FREE)):
        amid = ndimage.binary_erosion(cells, np.ones((3, 3)))
        amid[:, :-260] = False  # of the house alone
        rows, columns = np.random.default_rng(0).permutation(np.argwhere(amid)).T
        places = grid.to_map(np.column_stack([columns, rows]) + 0.5)
        visible = list(islice((place for place in places if page.sees(*place)), 15))
        assert len(visible) == 15
        for x, y in visible:
            assert page.colour("ground", x, y) == expected


def test_a_scene_is_drawn_only_when_it_changes(visit: Visitor, office_server: Server) -> None:
    page = visit(office_server.url)
    page.wait_for_fix()
    page.page.click("#pause")
    page.page.wait_for_selector("#paused", state="visible")
    count = """() => new Promise((done) => {
        let frames = 0;
        const ctx = document.getElementById("overlay").getContext("2d");
        const clear = ctx.clearRect;
        ctx.clearRect = (...area) => { frames += 1; clear.apply(ctx, area); };
        setTimeout(() => { delete ctx.clearRect; done(frames); }, 1000);
    })"""
    # A last message may still be on its way.
    wait_until(lambda: page.page.evaluate(count) == 0, lambda: "it is drawn again and again")
    page.page.click("#pause")
    page.page.wait_for_selector("#paused", state="hidden")
    wait_until(lambda: page.page.evaluate(count) > 5, lambda: "it stays as it was drawn")


def test_the_theme_follows_the_system_until_the_button_is_pressed(
    visit: Visitor, office_server: Server
) -> None:
    page = visit(office_server.url, color_scheme="dark")
    page.wait_for_map()
    ground = "getComputedStyle(document.body).backgroundColor"
    dark = page.page.evaluate(ground)
    page.page.emulate_media(color_scheme="light")
    wait_until(lambda: page.page.evaluate(ground) != dark, lambda: "it turns light")
    page.page.click("#theme")
    assert page.page.evaluate(ground) == dark
    page.page.reload()
    assert page.page.evaluate(ground) == dark
    page.page.click("#theme")  # back with the system
    page.page.emulate_media(color_scheme="dark")
    wait_until(lambda: page.page.evaluate(ground) == dark, lambda: "it turns dark")
