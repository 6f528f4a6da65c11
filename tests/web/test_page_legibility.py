"""Maps are legible at every scale, and what is refused is answered where it was asked."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_lab import DESKTOP, PHONE, Server, Visit, wait_until

from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.io.maps.map_server import save_map
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.worlds.catalog import WORLDS

pytestmark = pytest.mark.slow

Visitor = Callable[..., Visit]


def luminance(colour: str) -> float:
    """Return the relative luminance of WCAG of rgb(...)."""
    shares = np.array([int(part) for part in re.findall(r"\d+", colour)[:3]]) / 255.0
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(one: str, other: str) -> float:
    """Return the contrast of WCAG, 1 to 21."""
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


@pytest.fixture(scope="module")
def large_server(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """Give a robot on a map of 100 x 60 m whose walls are one cell wide."""
    cells = np.full((1200, 2000), UNKNOWN, np.int8)
    cells[20:1180, 20:1980] = FREE
    cells[20:1180, [20, 700, 1300, 1979]] = OCCUPIED
    cells[[20, 1179], 20:1980] = OCCUPIED
    cells[580:620, [700, 1300]] = FREE  # doors
    cells[100:140, 200:260] = OCCUPIED
    folder = tmp_path_factory.mktemp("large")
    save_map(OccupancyGrid(cells, 0.05), folder / "large.yaml")
    server = Server(str(folder / "large.yaml")).start()
    yield server
    server.stop()


@pytest.mark.parametrize(
    ("device", "scheme"), [(DESKTOP, "light"), (PHONE, "dark")], ids=["desktop-light", "phone-dark"]
)
def test_walls_of_one_cell_are_seen_at_every_scale(
    visit: Visitor, large_server: Server, device: dict, scheme: str, tmp_path: Path
) -> None:
    page = visit(large_server.url, device, color_scheme=scheme)
    page.wait_for_map()
    wall, free = page.colour_variable("wall"), page.colour_variable("free")
    unknown = page.colour_variable("ground")
    assert contrast(free, unknown) >= 1.6
    assert contrast(free, wall) >= 4.5
    page.page.keyboard.press("-")
    for _ in range(9):
        page.page.wait_for_timeout(120)
        page.wait_for_frames()
        px, py = page.pixel(700.5 * 0.05, 36.0)
        assert walls_across(page, px, py, wall) >= 1.5
        page.page.mouse.move(px, py)
        page.page.mouse.wheel(0, -170)
    page.page.keyboard.press("f")
    page.page.wait_for_timeout(200)
    page.shot(tmp_path / "large.png")
    print(tmp_path / "large.png")  # noqa: T201 - for people


def walls_across(page: Visit, px: float, py: float, wall: str) -> float:
    """Return the width of a wall at a point of the window, CSS pixels."""
    script = """([px, py, wall]) => {
        const ground = document.getElementById("ground");
        const ratio = ground.width / ground.clientWidth;
        const reach = Math.round(12 * ratio);
        const copy = new OffscreenCanvas(2 * reach, 1).getContext("2d");
        copy.drawImage(ground, reach - Math.floor(px * ratio), -Math.floor(py * ratio));
        const { data } = copy.getImageData(0, 0, 2 * reach, 1);
        const shown = (i) => `rgb(${data[i]}, ${data[i + 1]}, ${data[i + 2]})` === wall;
        return [...Array(2 * reach).keys()].filter((i) => shown(4 * i)).length / ratio;
    }"""
    return float(page.page.evaluate(script, [px, py, wall]))


@pytest.fixture
def page(visit: Visitor, office_server: Server) -> Visit:
    """Give the page of a localized robot."""
    visited = visit(office_server.url)
    visited.wait_for_fix()
    return visited


def has_colour(page: Visit, name: str, x: float, y: float, reach_px: int = 5) -> bool:
    """Return whether a colour of the style sheet is drawn near a place of the map."""
    expected = [int(part) for part in re.findall(r"\d+", page.colour_variable(name))]
    offsets = [pixels / page.scale for pixels in range(-reach_px, reach_px + 1)]
    near = (page.colour("overlay", x + dx, y + dy) for dx in offsets for dy in offsets)
    return any(a > 200 and np.allclose([r, g, b], expected, atol=12) for r, g, b, a in near)


def test_the_path_to_a_goal_goes_around_walls(
    page: Visit, office_server: Server, tmp_path: Path
) -> None:
    x, *_ = page.pose("truth")
    room = (3.0, 7.0) if x > 10.0 else (37.0, 9.0)  # at the other end of the corridor
    page.page.click("#mode-goal")
    page.click_on_map(*room)
    page.wait_for_event("Goal set")
    path = wait_until(
        lambda: office_server.status()["simulation"]["path"], lambda: "a path is shown"
    )
    page.page.click("#pause")
    page.page.wait_for_selector("#paused", state="visible")
    floor = Floor(WORLDS["office"]())
    assert len(path) > 2
    assert all(floor.has_room(a, b, 0.05) for a, b in itertools.pairwise(path))
    assert not floor.has_room(path[0], path[-1], 0.05)  # the straight line meets walls
    middle = np.mean(path[-2:], axis=0)
    wait_until(lambda: has_colour(page, "goal", *middle), lambda: "the path is drawn")
    page.shot(tmp_path / "path.png")
    print(tmp_path / "path.png")  # noqa: T201 - for people
    page.page.click("#pause")
    page.page.click("#kidnap")
    wait_until(
        lambda: not office_server.status()["simulation"]["path"], lambda: "the path is forgotten"
    )


def test_a_goal_too_near_to_a_wall_is_answered_there_without_a_flag(page: Visit) -> None:
    page.page.click("#mode-goal")
    px, py = page.pixel(20.0, 11.05)
    page.page.mouse.click(px, py)
    page.page.wait_for_selector("#answer", state="visible")
    assert "too close to a wall. Pick a point" in page.page.inner_text("#answer")
    wait_until(lambda: is_beside(page, px, py), lambda: "the answer points there")
    x, y = 20.0, 11.05
    page.page.wait_for_timeout(200)
    assert not has_colour(page, "goal", x, y + 20.0 / page.scale)  # of its pennant


def is_beside(page: Visit, px: float, py: float) -> bool:
    """Return whether the answer points to a place of the window."""
    box = page.page.locator("#answer").bounding_box()
    assert box is not None
    return abs(box["x"] + box["width"] / 2 - px) < 4 and 0 < box["y"] - py < 30


def test_a_pose_that_does_not_fit_is_answered_where_it_was_proposed(
    page: Visit, tmp_path: Path
) -> None:
    x = 3.0 if page.pose("truth")[0] > 10.0 else 30.0
    page.page.click("#mode-pose")
    at = page.pixel(x, 8.0)
    page.press_and_pull(x, 8.0, 0.0)
    page.page.wait_for_selector("#answer", state="visible")
    assert "does not explain the scan" in page.page.inner_text("#answer")
    wait_until(lambda: is_beside(page, *at), lambda: "the answer points there")
    page.shot(tmp_path / "refused.png")
    print(tmp_path / "refused.png")  # noqa: T201 - for people
    page.wait_for_state("LOCALIZED")


@pytest.fixture
def warehouse_server(chromium: Any) -> Iterator[Server]:
    """Give a robot between shelves that look alike."""
    server = Server("warehouse", "--seed", "2").start()
    yield server
    server.stop()


def test_places_that_overlap_are_one_symbol_with_a_count(
    warehouse_server: Server, visit: Visitor
) -> None:
    page = visit(warehouse_server.url, PHONE)
    page.wait_for_map()
    page.wait_for_state("DISAMBIGUATING")
    page.page.tap("#pause")
    page.page.wait_for_selector("#paused", state="visible")
    page.page.tap("#zoom-out")
    page.page.tap("#zoom-out")
    page.page.wait_for_timeout(300)
    page.wait_for_frames()
    grouping = """async (hypotheses) => {
        const { groupsOf } = await import("/static/layers/groups.js");
        const scale = Number(document.getElementById("app").dataset.view.split(" ")[0]);
        return groupsOf({ scale }, hypotheses).map(({ first, members, probability }) => {
            return [first.pose, members.length, probability];
        });
    }"""
    hypotheses = warehouse_server.status()["hypotheses"]
    groups = page.page.evaluate(grouping, hypotheses)
    assert sum(count for _, count, _ in groups) == len(hypotheses)
    assert sum(share for *_, share in groups) == pytest.approx(
        sum(place["probability"] for place in hypotheses)
    )
    pose, count, _ = max(groups, key=lambda group: group[1])
    assert count > 1
    before = page.scale
    page.page.touchscreen.tap(*page.pixel(*pose[:2]))
    wait_until(lambda: page.scale > 1.2 * before, lambda: f"{before} -> {page.scale}")
    assert page.data("state") == "DISAMBIGUATING"  # a closer look chooses nothing


def test_places_at_one_point_are_never_split(page: Visit) -> None:
    groups = page.page.evaluate("""async () => {
        const { groupsOf } = await import("/static/layers/groups.js");
        const place = (x, yaw) => ({ pose: [x, 0, yaw], probability: 0.25 });
        const places = [place(0, 0), place(0, 1.5), place(10, 0), place(0.01, 3)];
        return groupsOf({ scale: 400 }, places).map((group) => group.members.length);
    }""")
    assert groups == [3, 1]
