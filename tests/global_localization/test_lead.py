"""A place must be ahead by more than one thing, which may have been moved."""

from __future__ import annotations

import numpy as np
import pytest

from firstfix.core.estimate import Verdict
from firstfix.core.grid import FREE, OCCUPIED, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.fields.raycast import expected_ranges
from firstfix.global_localization.beams import usable_beams
from firstfix.global_localization.frames import to_cells
from firstfix.global_localization.lead import leads_without_its_best_part, part_costs
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.sensors import are_surrounded

CELL_M = 0.05
ROOM_M = 4.0
LEFT, RIGHT = SE2(2.0, 2.1, 0.0), SE2(6.1, 2.1, 0.0)
Box = tuple[float, float, float, float]


def two_rooms(*boxes: Box) -> OccupancyGrid:
    """Draw two equal rooms side by side; boxes are x, y, width and height, m."""
    cells = np.full((84, 166), FREE, np.int8)
    cells[[0, 1, -2, -1]] = cells[:, [0, 1, 82, 83, -2, -1]] = OCCUPIED
    for x, y, width, height in boxes:
        rows = slice(round(y / CELL_M), round((y + height) / CELL_M))
        cells[rows, round(x / CELL_M) : round((x + width) / CELL_M)] = OCCUPIED
    return OccupancyGrid(cells, CELL_M)


def scan_in(world: OccupancyGrid, pose: SE2, beams: int = 180, range_max: float = 12.0):
    step = 2 * np.pi / beams
    bearings = np.arange(beams) * step
    ranges = expected_ranges(world, pose, bearings, range_max)
    return LaserScan(ranges.astype(np.float32), 0.0, step, 0.05, range_max)


def is_ahead(world: OccupancyGrid, beams: int = 180) -> bool:
    scan = scan_in(world, LEFT, beams)
    poses = np.array([to_cells(world, scan, pose) for pose in (LEFT, RIGHT)])
    return leads_without_its_best_part(part_costs(poses, usable_beams(scan), MapFields(world)))


def test_one_small_thing_is_no_lead():
    assert not is_ahead(two_rooms((3.4, 2.0, 0.2, 0.2)))


@pytest.mark.parametrize("beams", [20, 180])
def test_things_on_all_sides_are_a_lead(beams):
    around = (
        (0.5, 0.5, 1.0, 0.6),
        (3.0, 0.3, 0.5, 1.2),
        (0.3, 3.0, 1.2, 0.8),
        (3.0, 3.2, 0.8, 0.4),
    )
    assert is_ahead(two_rooms(*around), beams)


def test_a_place_without_a_rival_leads():
    world = two_rooms()
    scan = scan_in(world, LEFT)
    poses = np.array([to_cells(world, scan, LEFT)])
    assert leads_without_its_best_part(part_costs(poses, usable_beams(scan), MapFields(world)))


def test_what_was_measured_counts_not_what_the_sensor_could_see():
    world = two_rooms()
    assert are_surrounded([scan_in(world, LEFT, range_max=5.0)])  # 79 m²
    assert not are_surrounded([scan_in(world, LEFT, range_max=3.5)])  # 38 m²
    hall = OccupancyGrid(np.pad(two_rooms().cells[:, :1], ((0, 0), (0, 400))), CELL_M)
    assert not are_surrounded([scan_in(hall, SE2(10.0, 2.1, 0.0), range_max=5.0)])  # all is far
    half = scan_in(world, LEFT)
    half = LaserScan(half.ranges[:90], 0.0, half.angle_increment, 0.05, 12.0)
    assert not are_surrounded([half])
    other = LaserScan(half.ranges, np.pi, half.angle_increment, 0.05, 12.0)
    assert are_surrounded([half, other])


@pytest.mark.parametrize(
    ("size", "small"), [(0.5, Verdict.UNIQUE), (0.8, Verdict.AMBIGUOUS)], ids=["sure", "likely"]
)
def test_a_small_view_to_all_sides_must_be_surer_than_a_large_one(size, small):
    world = two_rooms(
        (0.5, 0.5, size, 0.6 * size),
        (3.0, 0.3, 0.5, 1.2 * size),
        (0.3, 3.0, 1.2 * size, 0.8),
        (3.0, 3.2, 0.8 * size, 0.4),
    )
    matcher = ScanMatcher(world)
    assert matcher.locate(scan_in(world, LEFT, range_max=5.0)).verdict is small
    assert matcher.locate(scan_in(world, LEFT, range_max=12.0)).verdict is Verdict.UNIQUE
