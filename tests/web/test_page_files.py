"""A map and a log that are dropped onto the page are located, in this tab only."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from page_lab import DESKTOP, PHONE, Server, Visit, wait_until

from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.io.logs.npz import save_recording
from firstfix.io.maps.map_server import save_map
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import WORLDS

pytestmark = pytest.mark.slow

Visitor = Callable[..., Visit]
HOUSE = WORLDS["house"]()
PLACES = (SE2(9.0, 6.5, 1.0), SE2(1.5, 1.0, -2.0))


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Give the YAML and image of a map, and a log of two scans."""
    folder = tmp_path_factory.mktemp("own")
    rng = np.random.default_rng(0)
    scans = tuple(Lidar().scan(HOUSE, place, rng, float(i)) for i, place in enumerate(PLACES))
    save_map(HOUSE, folder / "home.yaml")
    save_recording(Recording(scans), folder / "drive.npz")
    return sorted(folder.iterdir())


def is_at(page: Visit, place: SE2) -> bool:
    """Return whether the page shows this pose."""
    return bool(page.pose()) and math.dist(page.pose()[:2], (place.x, place.y)) < 0.1


@pytest.mark.parametrize("device", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_own_files_are_located_and_the_robot_goes_on(
    visit: Visitor, office_server: Server, files: list[Path], device: dict, tmp_path: Path
) -> None:
    page = visit(office_server.url, device)
    page.wait_for_fix()
    if device is PHONE:
        page.page.tap("#sheet-handle")
    with page.page.expect_file_chooser() as chooser:
        page.page.click("#open-files")
    chooser.value.set_files([str(path) for path in files])
    wait_until(lambda: page.data("time") == "file", lambda: page.page.inner_text("#dropped-text"))
    assert is_at(page, PLACES[0])
    assert page.page.inner_text("#state-word") == "UNIQUE"
    assert page.page.text_content("#map-name") == "home"
    page.shot(tmp_path / "files.png")
    print(tmp_path / "files.png")  # noqa: T201 - for people
    page.page.click("#file-next")
    wait_until(lambda: is_at(page, PLACES[1]), lambda: f"{page.pose()}")
    assert page.page.is_hidden("#file-next")
    page.page.click("#file-leave")
    assert page.data("time") == "live"
    assert page.page.text_content("#map-name") == "office"
    wait_until(lambda: page.page.inner_text("#state-word") == "LOCALIZED", lambda: "the robot")


def test_what_is_missing_or_wrong_is_said_in_plain_words(
    visit: Visitor, office_server: Server, files: list[Path], tmp_path: Path
) -> None:
    page = visit(office_server.url)
    page.wait_for_fix()
    _, image, header = files
    choose = page.page.locator("#files")
    choose.set_input_files(str(header))
    assert page.page.inner_text("#dropped-text") == "Now drop a bag or a log with scans."
    broken = tmp_path / "broken.npz"
    broken.write_bytes(b"PK\x03\x04 and nothing else")
    choose.set_input_files([str(broken), str(image)])
    page.page.wait_for_selector("#error-notice", state="visible")
    assert "broken.npz" in page.page.inner_text("#error-notice")
    assert page.page.is_hidden("#dropped")
    assert page.data("time") == "live"
    (tmp_path / "notes.docx").write_bytes(b"")
    choose.set_input_files(str(tmp_path / "notes.docx"))
    wait_until(
        lambda: "of no known kind" in page.page.inner_text("#error-notice"),
        lambda: page.page.inner_text("#error-notice"),
    )
    page.problems = [problem for problem in page.problems if "422" not in problem]


def test_a_log_is_dropped_by_hand(visit: Visitor, office_server: Server, files: list[Path]) -> None:
    page = visit(office_server.url)
    page.wait_for_fix()
    page.page.evaluate("""() => {
        const carried = new DataTransfer();
        carried.items.add(new File(["nothing"], "empty.npz"));
        for (const kind of ["dragover", "drop"]) {
            dispatchEvent(new DragEvent(kind, { dataTransfer: carried, cancelable: true }));
        }
    }""")
    page.page.wait_for_selector("#error-notice", state="visible")
    assert "empty.npz" in page.page.inner_text("#error-notice")
    page.problems = [problem for problem in page.problems if "422" not in problem]
