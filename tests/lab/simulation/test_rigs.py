"""The sensors that simulated robots have."""

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar, NoReturn
from firstfix.lab.simulation.rigs import RIGS, Rig, find_rig, parse_rig


@pytest.fixture
def hall() -> OccupancyGrid:
    """20 x 10 m inside; walls begin at x = 0 and 20, y = 0 and 10."""
    cells = np.zeros((102, 202), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return OccupancyGrid(cells, 0.1, SE2(-0.1, -0.1, 0.0))


@pytest.mark.parametrize("name", RIGS)
def test_every_rig_measures_the_walls(hall: OccupancyGrid, name: str) -> None:
    pose = SE2(3.0, 3.0, 3.0)
    scans = find_rig(name).scans(hall, pose, np.random.default_rng(0))
    ends = pose.apply(np.concatenate([scan.points() for scan in scans]))
    off = np.min(np.abs([ends[:, 0], ends[:, 0] - 20.0, ends[:, 1], ends[:, 1] - 10.0]), axis=0)
    assert len(ends) > 50
    assert np.quantile(off, 0.95) < 0.1


def test_two_lasers_at_opposite_corners_leave_no_gap() -> None:
    front, rear = RIGS["two-lasers"].lidars
    assert front.T_base_laser.x > 0.0 > rear.T_base_laser.x
    directions = np.concatenate(
        [lidar.bearings + lidar.T_base_laser.yaw for lidar in (front, rear)]
    )
    sorted_ = np.sort(np.remainder(directions, 2 * np.pi))
    assert np.diff(sorted_, append=sorted_[0] + 2 * np.pi).max() < np.radians(0.6)


def test_a_camera_does_not_call_empty_space_free(hall: OccupancyGrid) -> None:
    for no_return, hits_free in ((NoReturn.OPEN_SPACE, 4), (NoReturn.UNKNOWN, 0)):
        lidar = Lidar(beams=4, range_max=1.0, no_return=no_return)
        scan = lidar.scan(hall, SE2(5.0, 5.0, 0.0), np.random.default_rng(0))
        assert np.count_nonzero(scan.no_return) == hits_free
        assert not scan.hit.any()


def test_unknown_names_and_no_sensor_are_refused() -> None:
    with pytest.raises(InputError, match="Did you mean two-lasers"):
        find_rig("two-laser")
    with pytest.raises(InputError, match="without a sensor"):
        Rig(())


def test_sensors_are_read_from_text() -> None:
    (lidar,) = parse_rig("60,5").lidars
    assert (lidar.beams, lidar.range_max) == (61, 5.0)
    assert parse_rig("60,5").words == "60° x 5 m"
    front, rear = parse_rig("2x270,8").lidars
    assert (front.beams, rear.range_max) == (271, 8.0)
    assert front.T_base_laser != rear.T_base_laser
    assert parse_rig("depth-camera") is RIGS["depth-camera"]


@pytest.mark.parametrize("text", ["", "60", "60,5,3", "0,5", "400,5", "60,nan", "3x60,5", "x60,5"])
def test_other_text_is_no_sensor(text: str) -> None:
    with pytest.raises(InputError, match="sensor"):
        parse_rig(text)
