"""Drawn worlds that several tests use, and checks of answers."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.angles import angle_error
from firstfix.core.estimate import LocateResult
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.worlds.catalog import office


@pytest.fixture(scope="session")
def draw_room() -> Callable[[float], OccupancyGrid]:
    """Give a function that draws one room of 8 x 6 m with cells of any size.

    Its walls begin and end on multiples of 0.5 m, so that every size of cell draws them exactly; no
    turn of it looks the same.
    """

    def draw(resolution: float) -> OccupancyGrid:
        def span(low: float, high: float) -> slice:
            return slice(round(low / resolution), round(high / resolution))

        cells = np.full((round(8.0 / resolution), round(10.0 / resolution)), UNKNOWN, np.int8)
        cells[span(0.5, 7.5), span(0.5, 9.5)] = OCCUPIED
        cells[span(1.0, 7.0), span(1.0, 9.0)] = FREE
        for x0, y0, x1, y1 in (
            (1.0, 5.0, 3.0, 7.0),  # a corner cut out
            (5.5, 3.5, 6.0, 4.0),  # a pillar
            (7.5, 1.0, 9.0, 1.5),  # a shelf
            (3.5, 1.0, 4.0, 2.5),  # a stub of wall
        ):
            cells[span(y0, y1), span(x0, x1)] = OCCUPIED
        return OccupancyGrid(cells, resolution)

    return draw


@pytest.fixture(scope="session")
def room(draw_room: Callable[[float], OccupancyGrid]) -> MapFields:
    return MapFields(draw_room(0.05))


@pytest.fixture(scope="session")
def maps_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("maps")


@pytest.fixture(scope="session")
def office_locator(maps_cache: Path) -> ScanMatcher:
    return ScanMatcher(office(), cache_dir=maps_cache)


@pytest.fixture(scope="session")
def found() -> Callable[[LocateResult, SE2, float, float], bool]:
    """Give a function that returns whether the best hypothesis is near the truth: m, degrees."""

    def found(result: LocateResult, truth: SE2, most_m: float, most_deg: float) -> bool:
        best = result.best
        assert best is not None
        off_deg = math.degrees(angle_error(best.pose.yaw, truth.yaw))
        return best.pose.distance_to(truth) < most_m and off_deg < most_deg

    return found


@pytest.fixture(scope="session")
def content_of() -> Callable[[LocateResult], tuple[object, ...]]:
    """Give a function that returns all of an answer but the time it took, to the last bit."""

    def content_of(result: LocateResult) -> tuple[object, ...]:
        return (
            result.verdict,
            result.reason,
            result.search,
            [
                (h.pose, h.covariance.tolist(), h.score, h.probability, h.evidence)
                for h in result.hypotheses
            ],
        )

    return content_of


@pytest.fixture(scope="session")
def with_pose() -> Callable[..., LaserScan]:
    """Give a function that makes the scan of a sensor with another pose or other limits."""

    def with_pose(scan: LaserScan, **changes: object) -> LaserScan:
        settings = {
            name: getattr(scan, name)
            for name in ("ranges", "angle_min", "angle_increment", "range_min", "range_max")
        }
        return LaserScan(**{**settings, **changes})

    return with_pose
