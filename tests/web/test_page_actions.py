"""Commands on the page reach the robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from page_lab import DESKTOP, PHONE, Server, Visit, wait_until

from firstfix.core.angles import angle_error
from firstfix.lab.worlds.catalog import WORLDS, random_free_poses

pytestmark = pytest.mark.slow

ORIGIN = np.array([WORLDS["rooms"]().extent[0], WORLDS["rooms"]().extent[2]])

Visitor = Callable[..., Visit]


@pytest.fixture
def page(visit: Visitor, office_server: Server) -> Visit:
    """Give the page of a localized robot."""
    visited = visit(office_server.url)
    visited.wait_for_fix()
    return visited


def hinted_position(page: Visit) -> tuple[float, float]:
    """Return the position of the newest hint."""
    match = page.wait_for_event(r"Hint from.* \((-?[\d.]+), (-?[\d.]+)\)")
    return float(match[1]), float(match[2])


def stand_still(page: Visit) -> None:
    """Pause the robot, and zoom in on it."""
    page.page.keyboard.press("l")
    page.page.keyboard.press(" ")
    page.page.wait_for_selector("#paused", state="visible")
    page.wait_for_rest()


def is_near_truth(page: Visit, metres: float, radians: float) -> bool:
    """Return whether the page shows a pose that is right in position and in heading."""
    pose, truth = page.pose(), page.pose("truth")
    if not pose or not truth:
        return False
    near = math.dist(pose[:2], truth[:2]) < metres
    return near and bool(angle_error(pose[2], truth[2]) < radians)


def test_a_drag_sets_the_pose(page: Visit) -> None:
    stand_still(page)
    x, y, yaw = page.pose("truth")
    page.page.click("#mode-pose")
    assert page.page.get_attribute("#mode-pose", "aria-pressed") == "true"
    page.press_and_pull(x, y, yaw)
    assert math.dist(hinted_position(page), (x, y)) < 0.05
    assert page.data("mode") == "look"
    page.page.keyboard.press(" ")
    page.wait_for_event("Localized at")
    page.wait_for_state("LOCALIZED")
    assert is_near_truth(page, 0.2, 0.2)


def test_a_press_without_a_drag_sends_nothing(page: Visit) -> None:
    before = page.events()
    page.page.click("#mode-pose")
    page.click_on_map(20.0, 12.0)
    page.page.wait_for_selector("#error-notice", state="visible")
    assert "drag" in page.page.inner_text("#error-notice")
    assert not [text for text in page.events() if "Hint from" in text and text not in before]


def test_a_long_press_of_a_finger_sets_the_pose(visit: Visitor, office_server: Server) -> None:
    page = visit(office_server.url, PHONE)
    page.wait_for_fix()
    page.page.tap("#follow")
    page.page.tap("#pause")
    page.page.wait_for_selector("#paused", state="visible")
    page.wait_for_rest()
    x, y, yaw = page.pose("truth")
    px, py = page.pixel(x, y)
    hand = Fingers(page)
    hand.touch("touchStart", [(px, py)])
    wait_until(lambda: page.data("mode") == "pose", lambda: "a long press")
    for reach in (20.0, 50.0):
        hand.touch("touchMove", [(px + reach * math.cos(yaw), py - reach * math.sin(yaw))])
    hand.touch("touchEnd", [])
    assert math.dist(hinted_position(page), (x, y)) < 0.05
    page.page.click("#pause")  # a tap so soon may be taken for the second of a double tap
    page.wait_for_event("Localized at")
    page.wait_for_state("LOCALIZED")


class Fingers:
    """Touches of a screen."""

    def __init__(self, page: Visit) -> None:
        self._session = page.page.context.new_cdp_session(page.page)

    def touch(self, kind: str, at: list[tuple[float, float]]) -> None:
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(at)]
        self._session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def test_two_fingers_zoom_and_one_pans(visit: Visitor, office_server: Server) -> None:
    page = visit(office_server.url, PHONE)
    page.wait_for_map()
    scale, *_ = (float(value) for value in page.data("view").split())
    hand = Fingers(page)
    hand.touch("touchStart", [(150.0, 250.0), (210.0, 250.0)])
    for wide in (40.0, 60.0, 90.0):
        hand.touch("touchMove", [(180.0 - wide, 250.0), (180.0 + wide, 250.0)])
    hand.touch("touchEnd", [])
    wait_until(
        lambda: float(page.data("view").split()[0]) == pytest.approx(3.0 * scale, rel=0.05),
        lambda: f"{scale} -> {page.data('view')}",
    )
    before = page.pixel(20.0, 12.0)
    hand.touch("touchStart", [(180.0, 300.0)])
    for along in (10.0, 20.0, 40.0):
        hand.touch("touchMove", [(180.0 + along, 300.0)])
    hand.touch("touchEnd", [])
    wait_until(
        lambda: page.pixel(20.0, 12.0)[0] - before[0] == pytest.approx(40.0, abs=1.0),
        lambda: f"{before} -> {page.pixel(20.0, 12.0)}",
    )
    assert page.data("mode") == "look"


def test_the_wheel_zooms_where_it_points(page: Visit) -> None:
    before = page.pixel(5.0, 5.0)
    scale = page.scale
    page.page.mouse.move(*before)
    page.page.mouse.wheel(0, -500)
    wait_until(lambda: page.scale > 1.5 * scale, lambda: f"{scale} -> {page.scale}")
    assert page.pixel(5.0, 5.0) == pytest.approx(before, abs=1.5)  # whole pixels, zoomed


@pytest.mark.parametrize("way", ["ghost", "list"])
def test_picking_a_place_resolves_an_ambiguous_start(
    visit: Visitor, rooms_server: Server, way: str
) -> None:
    page = visit(rooms_server.url)
    page.wait_for_map()
    page.page.keyboard.press("r")
    page.wait_for_state("DISAMBIGUATING")
    page.page.keyboard.press(" ")
    page.page.wait_for_selector("#paused", state="visible")
    places = rooms_server.status()["hypotheses"]
    truth = page.pose("truth")
    assert len([place for place in places if place["probability"] > 0.1]) == 4
    index = min(range(len(places)), key=lambda i: math.dist(places[i]["pose"][:2], truth[:2]))
    if way == "ghost":
        page.click_on_map(*places[index]["pose"][:2])
    else:
        button = page.page.locator(".place").nth(index)
        button.focus()
        page.page.keyboard.press("Enter")
    page.page.click("#pause")
    page.wait_for_state("LOCALIZED")
    wait_until(lambda: is_near_truth(page, 0.2, 0.2), lambda: f"{page.pose()}, not {truth}")
    assert page.page.locator(".place").count() == 0
    # Evidence has not decided, so the state is not shown in its green.
    assert page.data("chosen") == "true"
    assert "A person chose this place. 4 places fit" in page.page.inner_text("#verdict")
    assert page.colour_of("#state h2") == page.colour_variable("chosen")


HEAT_CELL_M = 0.5


def test_the_belief_is_a_heat_layer(visit: Visitor, rooms_server: Server) -> None:
    page = visit(rooms_server.url)
    page.wait_for_map()
    page.page.click("#relocalize")
    page.wait_for_state("DISAMBIGUATING")
    wait_until(
        lambda: "4 places" in page.page.inner_text("#places-count"),
        lambda: page.page.inner_text("#places-count"),
    )
    page.page.click("#pause")
    page.page.wait_for_selector("#paused", state="visible")
    place = np.array(rooms_server.status()["hypotheses"][0]["pose"][:2])
    for layer in ("scan", "truth"):
        page.page.click(f"[data-layer={layer}]")
    page.look_at(*place, 400.0)
    page.wait_for_frames()
    # The robot drives, and the places are older than the belief by up to one view: the mass may
    # lie in the next cell.
    shifts = 0.25 * np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2)
    corners = np.unique(np.floor((place + shifts - ORIGIN) / HEAT_CELL_M), axis=0)
    steps = np.linspace(0.1, 0.9, 9)
    inside = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    cells = [ORIGIN + HEAT_CELL_M * (corner + inside) for corner in corners]
    # Beside the symbol of the place.
    cells = [cell[np.hypot(*(cell - place).T) > 0.27] for cell in cells]

    def colours(points: NDArray[np.float64]) -> list[tuple[int, ...]]:
        return [page.colour("overlay", *point) for point in points]

    def is_heat(points: NDArray[np.float64]) -> bool:
        shown = colours(points)
        return len(shown) >= 3 and all(
            alpha > 100 and blue > green + 40 for _, green, blue, alpha in shown
        )

    (points,) = wait_until(
        lambda: [cell for cell in cells if is_heat(cell)][:1],
        lambda: f"{[colours(cell) for cell in cells]}",
    )
    page.page.click("[data-layer=belief]")
    wait_until(
        lambda: set(colours(points)) == {(0, 0, 0, 0)}, lambda: f"{colours(points)} is shown"
    )
    page.page.click("#pause")


def test_a_carried_robot_is_lifted_and_localized_again(page: Visit) -> None:
    x, y, yaw = 4.0, 19.5, -0.8
    page.page.click("#mode-carry")
    page.press_and_pull(x, y, yaw)
    page.wait_for_state("LIFTED")
    assert page.page.inner_text("#state-word") == "LIFTED"
    page.wait_for_state("LOCALIZED")
    wait_until(lambda: is_near_truth(page, 0.3, 0.2), lambda: f"{page.pose()}")
    match = page.wait_for_event(r"Carried to \((-?[\d.]+), (-?[\d.]+)\)")
    assert math.dist((float(match[1]), float(match[2])), (x, y)) < 0.06  # a pixel at this scale
    page.wait_for_event("Localized at")


def test_a_goal_is_driven_to(page: Visit) -> None:
    here = page.pose("truth")
    places = random_free_poses(WORLDS["office"](), np.random.default_rng(0), 400, 0.5)
    near = (place for place in places if 1.0 < math.dist((place.x, place.y), here[:2]) < 3.0)
    goal = min(near, key=lambda place: math.dist((place.x, place.y), here[:2]))
    page.page.click("#mode-goal")
    page.click_on_map(goal.x, goal.y)
    page.wait_for_event("Goal set")
    wait_until(
        lambda: math.dist(page.pose("truth")[:2], (goal.x, goal.y)) < 0.3,
        lambda: f"at {page.pose('truth')}, not {goal}",
    )
    assert page.data("mode") == "goal"  # the next click is the next goal
    page.page.keyboard.press("Escape")
    assert page.data("mode") == "look"


def test_a_refused_command_is_explained(page: Visit) -> None:
    page.page.click("#mode-goal")
    page.click_on_map(35.0, 1.0)  # outside of the building
    page.page.wait_for_selector("#answer", state="visible")
    assert "too close to a wall" in page.page.inner_text("#answer")


def test_relocalize_discards_the_pose(page: Visit) -> None:
    page.page.click("#relocalize")
    page.wait_for_event("Relocalization requested")
    page.wait_for_state("LOCALIZED")


def test_pause_stops_the_clock(page: Visit, office_server: Server) -> None:
    page.page.click("#pause")
    page.page.wait_for_selector("#paused", state="visible")
    assert page.page.inner_text("#pause-text") == "Resume"
    stamp = wait_until(
        lambda: held_stamp(page, office_server), lambda: f"{office_server.status()['stamp']} stays"
    )
    page.page.click("#pause")
    wait_until(lambda: office_server.status()["stamp"] > stamp, lambda: "the clock goes on")


def held_stamp(page: Visit, server: Server) -> float | None:
    """Return the time of the robot if its clock is stopped."""
    before = server.status()["stamp"]
    page.page.wait_for_timeout(300)
    return before if server.status()["stamp"] == before else None


def test_people_come_and_go(page: Visit) -> None:
    slider = page.page.locator("#people")
    slider.fill("12")
    assert page.page.inner_text("#people-count") == "12"
    short = page.page.locator("#legend .short b")
    wait_until(lambda: short.inner_text() not in {"0%", "–"}, lambda: "people are seen")
    page.page.click("#add-person")
    assert page.page.inner_text("#people-count") == "13"
    slider.fill("0")
    wait_until(lambda: short.inner_text() == "0%", lambda: f"{short.inner_text()} after all left")


@pytest.mark.parametrize("device", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_layers_can_be_hidden(visit: Visitor, office_server: Server, device: dict) -> None:
    page = visit(office_server.url, device)
    page.wait_for_fix()
    if device is PHONE:
        page.page.tap("#sheet-handle")
    for chip in page.page.locator("[data-layer]:visible").all():
        chip.click()
        assert chip.get_attribute("aria-pressed") == "false"

    def behind() -> tuple[int, ...]:
        """Nothing but the robot, its heading, and the canvas itself."""
        x, y, yaw = page.pose()
        return page.colour("overlay", x - 3.0 * math.cos(yaw), y - 3.0 * math.sin(yaw))

    wait_until(lambda: behind() == (0, 0, 0, 0), lambda: f"{behind()} is drawn")


def test_a_kidnapped_robot_is_found_without_a_signal(page: Visit) -> None:
    before, lifts = page.pose("truth"), _lifts(page)
    page.page.click("#kidnap")
    match = page.wait_for_event(r"Kidnapped, with no signal: now at \((-?[\d.]+), (-?[\d.]+)\)")
    assert math.dist((float(match[1]), float(match[2])), before[:2]) > 0.5
    wait_until(lambda: page.pose() and is_near_truth(page, 0.3, 0.2), lambda: f"{page.pose()}")
    assert _lifts(page) == lifts


def _lifts(page: Visit) -> int:
    return sum("Picked up" in text for text in page.events())


def test_a_covered_sensor_keeps_the_pose(page: Visit) -> None:
    page.page.click("#cover")
    wait_until(lambda: "too little" in page.page.inner_text("#reason"), lambda: "nothing is seen")
    assert page.page.inner_text("#cover") == "Uncover the sensor"
    assert page.data("state") == "LOCALIZED"
    page.page.click("#cover")
    wait_until(lambda: "beams fit" in page.page.inner_text("#reason"), lambda: "it sees again")


def test_sensor_and_world_are_chosen_from_menus(changing_server: Server, visit: Visitor) -> None:
    page = visit(changing_server.url)
    page.wait_for_fix()
    page.page.select_option("#sensor", "180° x 8 m")
    page.wait_for_event("Sensor: 180° x 8 m")
    page.page.select_option("#world", "rooms")
    page.page.wait_for_selector("#app[data-map=rooms]")
    page.wait_for_state("DISAMBIGUATING")
    assert page.page.input_value("#sensor") == "180° x 8 m"
    assert page.page.inner_text("#map-name") == "rooms"
    simulation = {"world": "rooms", "sensor": "180° x 8 m", "covered": False, "amcl": "off"}
    simulation["path"] = []
    assert changing_server.status()["simulation"] == simulation


def test_a_plain_amcl_is_a_second_robot_that_a_kidnap_leaves_behind(
    page: Visit, tmp_path: Path
) -> None:
    page.page.select_option("#amcl", "pose")
    wait_until(lambda: page.pose("amcl"), lambda: "AMCL starts")
    page.page.click("#kidnap")
    match = page.wait_for_event(r"Kidnapped, with no signal: now at \((-?[\d.]+), (-?[\d.]+)\)")
    there = float(match[1]), float(match[2])
    wait_until(
        lambda: page.pose() and math.dist(page.pose()[:2], there) < 0.5 and page.pose("amcl"),
        lambda: f"{page.pose()}, not {there}",
    )
    page.page.click("#pause")
    page.page.wait_for_selector("#paused", state="visible")
    x, y, yaw = page.pose("amcl")
    assert math.dist((x, y), there) > 0.5
    assert float(page.page.inner_text("#amcl-error").split()[0]) > 0.5
    edges = [pixels / page.scale for pixels in (8.0, 8.5, 9.0, 9.5, 10.0)]  # of its square
    side = [page.colour("overlay", x + e * math.sin(yaw), y - e * math.cos(yaw)) for e in edges]
    assert any(red > green + 90 and blue > green for red, green, blue, _ in side)  # magenta
    page.shot(tmp_path / "amcl.png")
    print(tmp_path / "amcl.png")  # noqa: T201 - for people
    page.page.click("#pause")
    page.page.select_option("#amcl", "off")
    wait_until(lambda: not page.pose("amcl"), lambda: "AMCL ends")
    page.page.wait_for_selector("#amcl-row", state="hidden")
