"""What has changed in the map, over real connections."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator

import httpx
import numpy as np
import pytest
from live_lab import Site, fed
from page_lab import Visit
from PIL import Image

from firstfix.changes.survey import Change
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.config import ChangesConfig, LocalizerConfig
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.web.map_changes import coloured
from firstfix.web.snapshot_store import SnapshotStore


def driven(hall_plan: OccupancyGrid, days: int) -> SnapshotStore:
    """A robot that drives past a new cabinet in the hall."""
    cells = hall_plan.cells.copy()
    column, row = hall_plan.to_cells(np.array([3.0, 3.4])).astype(int)
    cells[row : row + 6, column : column + 16] = 100
    world = OccupancyGrid(cells, hall_plan.resolution, hall_plan.T_map_grid)
    localizer = Localizer(LocalizerConfig(changes=ChangesConfig(days_kept=days)))
    store, rng, lidar = SnapshotStore("hall"), np.random.default_rng(0), Lidar(beams=180)
    inputs: list[object] = [NewMap(0.0, hall_plan)]
    for k in range(16):
        pose, stamp = SE2(1.2 + 0.2 * k, 1.4, 0.0), 1.7e9 + 0.2 * k
        inputs += [Odometry(stamp, SE2(0.2 * k, 0.0, 0.0)), lidar.scan(world, pose, rng, stamp)]
    for given in inputs:
        store(given, localizer.handle(given), localizer)  # type: ignore[arg-type]
    return store


@pytest.fixture(scope="module")
def site(hall_plan: OccupancyGrid) -> Iterator[Site]:
    with fed(store=driven(hall_plan, days=2)) as site:
        yield site


@pytest.fixture
def api(site: Site) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=site.url, timeout=240.0) as client:
        yield client


def test_areas_are_described(api: httpx.Client) -> None:
    document = api.get("/v1/map/changes").json()
    assert document["days"] == ["2023-11-14"]
    assert document["views"] > 3
    (area,) = document["areas"]
    assert area["change"] == "new"
    assert area["position"] == pytest.approx([3.4, 3.4], abs=0.3)


def test_the_picture_lies_over_that_of_the_map(api: httpx.Client) -> None:
    described = api.get("/v1/map").json()
    answer = api.get(described["changes"])
    assert answer.headers["content-type"] == "image/png"
    picture = np.asarray(Image.open(io.BytesIO(answer.content)))
    assert picture.shape == (described["image"]["height"], described["image"]["width"], 4)
    rows, columns = np.nonzero(np.flipud(picture[..., 3]))
    left, bottom = described["origin"][:2]
    assert columns.mean() * 0.05 + left == pytest.approx(3.4, abs=0.4)
    assert rows.mean() * 0.05 + bottom == pytest.approx(3.4, abs=0.3)
    assert api.get("/v1/map/changes.png", params={"max": "x"}).status_code == 422


def test_a_robot_that_keeps_none_says_so(hall_plan: OccupancyGrid) -> None:
    with fed(store=driven(hall_plan, days=0)) as site:
        assert httpx.get(f"{site.url}v1/map").json()["changes"] is None
        for name in ("changes", "changes.png"):
            answer = httpx.get(f"{site.url}v1/map/{name}")
            assert answer.status_code == 404
            assert "--keep-changes" in answer.json()["detail"]


def test_without_a_map_there_is_nothing_yet() -> None:
    with fed() as site:
        assert httpx.get(f"{site.url}v1/map/changes").status_code == 503


def test_of_the_cells_of_a_pixel_the_most_important_change_is_shown() -> None:
    kinds = np.array([[Change.GONE, Change.NEW, 0], [0, Change.FOUND_FREE, 0]], np.uint8)
    ((pixel, empty),) = coloured(kinds, 2)
    assert pixel.tolist() == coloured(np.full((1, 1), Change.NEW, np.uint8), 1)[0, 0].tolist()
    assert empty.tolist() == [0, 0, 0, 0]


@pytest.mark.slow
def test_the_page_shows_and_hides_the_layer(visit: Callable[..., Visit], site: Site) -> None:
    page = visit(site.url).page
    chip = page.locator("[data-layer=changes]")
    chip.wait_for(state="visible")
    assert chip.get_attribute("aria-pressed") == "true"
    with page.expect_response("**/v1/map/changes.png") as answer:
        pass
    assert answer.value.status == 200
    chip.click()
    assert chip.get_attribute("aria-pressed") == "false"
    with page.expect_response("**/v1/map/changes.png"):
        chip.click()
