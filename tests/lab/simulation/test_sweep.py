"""Sweeps see walls as ray casting does, and people before them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.sweep import sweep

EXACT = Lidar(beams=90, sigma_m=0.0, T_base_laser=SE2(0.07, 0.02, 0.3))


def hall(yaw: float = 0.0) -> Floor:
    """20 x 10 m inside; walls begin at x = 0 and 20, y = 0 and 10 of a frame turned by yaw."""
    cells = np.zeros((102, 202), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    cells[30:36, 60:70] = 100
    return Floor(OccupancyGrid(cells, 0.1, SE2(0.0, 0.0, yaw) @ SE2(-0.1, -0.1, 0.0)))


HALL = hall()


def rng() -> np.random.Generator:
    return np.random.default_rng(3)


@settings(max_examples=50, deadline=None)
@given(st.floats(0.5, 19.5), st.floats(0.5, 9.5), st.floats(-3.1, 3.1), st.sampled_from(Mounting))
def test_without_people_a_sweep_is_what_is_expected(
    x: float, y: float, yaw: float, mounting: Mounting
) -> None:
    lidar = Lidar(beams=90, sigma_m=0.0, T_base_laser=EXACT.T_base_laser, mounting=mounting)
    pose = SE2(x, y, yaw)
    scan = sweep(lidar, HALL, pose, rng())
    np.testing.assert_array_equal(scan.ranges, lidar.scan(HALL.grid, pose, rng()).ranges)
    expected = expected_ranges(HALL.grid, pose @ scan.T_base_laser, scan.bearings, 12.0)
    np.testing.assert_allclose(scan.ranges, expected, atol=1e-5)


def test_the_scan_of_a_still_robot_is_not_skewed() -> None:
    pose, lidar = SE2(4.0, 3.0, 0.4), Lidar(dropout=0.1)
    at_once = sweep(lidar, HALL, pose, rng(), stamp=7.0)
    rolling = sweep(lidar, HALL, pose, rng(), stamp=7.0, T_map_base_after=pose)
    np.testing.assert_array_equal(rolling.ranges, at_once.ranges)
    assert rolling.stamp == 7.0


@pytest.mark.parametrize("turned_by", [0.0, 1.3])
def test_each_beam_of_a_moving_robot_is_measured_from_where_it_was(turned_by: float) -> None:
    floor, T_map_hall = hall(turned_by), SE2(0.0, 0.0, turned_by)
    start, end = (T_map_hall @ SE2(4.0, 3.0, 3.0), T_map_hall @ SE2(4.2, 3.1, -3.0))  # over ±π
    scan = sweep(EXACT, floor, start, rng(), T_map_base_after=end)
    T_start_end = start.inverse() @ end
    for beam in (0, 30, 60, 89):
        share = beam / 90
        x, y = (a + share * (b - a) for a, b in ((start.x, end.x), (start.y, end.y)))
        still = SE2(x, y, start.yaw + share * T_start_end.yaw)
        alone = sweep(EXACT, floor, still, rng()).ranges[beam]
        # The sensor sits off the axis of the turn: its way is a little bent.
        assert scan.ranges[beam] == pytest.approx(alone, abs=0.02)


def test_half_a_turn_takes_half_the_time() -> None:
    lidar = Lidar(beams=91, fov=math.pi, sigma_m=0.0)
    start, end = SE2(4.0, 5.0, 0.0), SE2(5.0, 5.0, 0.0)
    skewed = sweep(lidar, HALL, start, rng(), T_map_base_after=end)
    last = sweep(lidar, HALL, SE2(4.5, 5.0, 0.0), rng())
    assert skewed.ranges[-1] == pytest.approx(float(last.ranges[-1]), abs=1e-5)


@pytest.mark.parametrize("turned_by", [0.0, -2.0])
def test_people_block_beams_at_the_range_of_their_skin(turned_by: float) -> None:
    floor, T_map_hall = hall(turned_by), SE2(0.0, 0.0, turned_by)
    lidar = Lidar(beams=360, sigma_m=0.0)
    people = T_map_hall.apply(np.array([[12.0, 5.0], [10.0, 1.0]]))
    circles = np.column_stack([people, [0.25, 0.2]])
    pose = T_map_hall @ SE2(10.0, 5.0, 0.0)
    scan = sweep(lidar, floor, pose, rng(), circles=circles)
    alone = sweep(lidar, floor, pose, rng())
    blocked = scan.ranges < alone.ranges - 0.01
    ahead, right = 180, 90  # bearings 0 and -90°
    assert scan.ranges[ahead] == pytest.approx(1.75, abs=1e-5)
    assert scan.ranges[right] == pytest.approx(3.8, abs=1e-5)
    widths = [2 * math.degrees(math.asin(r / d)) for r, d in ((0.25, 2.0), (0.2, 4.0))]
    assert np.count_nonzero(blocked) == pytest.approx(sum(widths), abs=2.0)
    np.testing.assert_array_equal(scan.ranges[~blocked], alone.ranges[~blocked])


def test_a_person_behind_a_wall_is_not_seen() -> None:
    pose = SE2(4.0, 3.2, 0.0)
    hidden = np.array([[9.0, 3.2, 0.2], [4.0, 10.5, 0.2]])
    np.testing.assert_array_equal(
        sweep(EXACT, HALL, pose, rng(), circles=hidden).ranges,
        sweep(EXACT, HALL, pose, rng()).ranges,
    )


def test_a_covered_sensor_has_no_valid_reading() -> None:
    scan = sweep(EXACT, HALL, SE2(4.0, 3.2, 0.0), rng(), circles=np.array([[4.0, 3.2, 0.3]]))
    assert not scan.hit.any()
    assert not scan.no_return.any()
