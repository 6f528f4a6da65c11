"""The simulated sensor measures what stands in the map."""

import math

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar


@pytest.fixture
def hall() -> OccupancyGrid:
    """20 x 10 m inside; walls begin at x = 0 and 20, y = 0 and 10."""
    cells = np.zeros((102, 202), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return OccupancyGrid(cells, 0.1, SE2(-0.1, -0.1, 0.0))


def rng() -> np.random.Generator:
    return np.random.default_rng(3)


EXACT = Lidar(beams=4, range_max=12.0, sigma_m=0.0)


def test_exact_beams_end_at_the_walls(hall: OccupancyGrid) -> None:
    scan = EXACT.scan(hall, SE2(4.0, 3.0, 0.0), rng())
    np.testing.assert_allclose(scan.bearings, [-math.pi, -math.pi / 2, 0.0, math.pi / 2])
    np.testing.assert_allclose(scan.ranges, [4.0, 3.0, math.inf, 7.0], atol=1e-5)
    assert scan.no_return.tolist() == [False, False, True, False]


def test_the_place_of_the_sensor_on_the_robot_counts(hall: OccupancyGrid) -> None:
    lidar = Lidar(beams=4, sigma_m=0.0, T_base_laser=SE2(1.0, 0.0, math.pi / 2))
    scan = lidar.scan(hall, SE2(4.0, 3.0, 0.0), rng())
    np.testing.assert_allclose(scan.ranges, [3.0, math.inf, 7.0, 5.0], atol=1e-5)
    points = SE2(4.0, 3.0, 0.0).apply(scan.points())
    np.testing.assert_allclose(points, [[5.0, 0.0], [5.0, 10.0], [0.0, 3.0]], atol=1e-5)


def test_upside_down_it_sweeps_the_other_way_and_sees_the_same(hall: OccupancyGrid) -> None:
    pose = SE2(4.0, 3.0, 0.3)
    upright, hanging = (
        Lidar(beams=91, fov=math.pi, sigma_m=0.0, mounting=mounting).scan(hall, pose, rng())
        for mounting in Mounting
    )
    np.testing.assert_array_equal(hanging.ranges, upright.ranges[::-1])
    np.testing.assert_allclose(hanging.points(), upright.points()[::-1], atol=1e-9)


def test_a_part_of_the_turn_is_centred_and_includes_both_ends() -> None:
    lidar = Lidar(beams=181, fov=math.pi)
    assert math.degrees(lidar.angle_increment) == pytest.approx(1.0)


def test_noise_has_the_spread_it_is_given(hall: OccupancyGrid) -> None:
    pose = SE2(4.0, 3.0, 0.0)
    lidar = Lidar(beams=5000, range_max=30.0, sigma_m=0.05)
    exact = Lidar(beams=5000, range_max=30.0, sigma_m=0.0).scan(hall, pose, rng()).ranges
    noise = lidar.scan(hall, pose, rng()).ranges - exact
    assert float(np.mean(noise)) == pytest.approx(0.0, abs=0.003)
    assert float(np.std(noise)) == pytest.approx(0.05, rel=0.05)


def test_lost_beams_have_no_return(hall: OccupancyGrid) -> None:
    lidar = Lidar(beams=5000, range_max=30.0, dropout=0.2)
    scan = lidar.scan(hall, SE2(4.0, 3.0, 0.0), rng())
    assert np.mean(scan.no_return) == pytest.approx(0.2, abs=0.02)


def test_noise_never_turns_a_return_into_open_space(hall: OccupancyGrid) -> None:
    lidar = Lidar(beams=2000, range_max=4.01, sigma_m=0.5)
    pose = SE2(4.0, 5.0, 0.0)
    exact = Lidar(beams=2000, range_max=4.01, sigma_m=0.0).scan(hall, pose, rng())
    np.testing.assert_array_equal(lidar.scan(hall, pose, rng()).no_return, exact.no_return)


def test_one_seed_gives_one_scan(hall: OccupancyGrid) -> None:
    lidar = Lidar(dropout=0.1)
    a, b = (lidar.scan(hall, SE2(4.0, 3.0, 0.0), rng()).ranges for _ in range(2))
    np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    "wrong",
    [
        {"beams": 0},
        {"fov": 0.0},
        {"fov": 7.0},
        {"fov": math.nan},
        {"sigma_m": -0.1},
        {"sigma_m": math.nan},
        {"dropout": 1.1},
    ],
)
def test_a_sensor_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        Lidar(**wrong)  # type: ignore[arg-type]
