"""Binary messages have the content of the snapshot."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from live_lab import drive

from firstfix.amcl.particles import equal_weights
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import usable_beams
from firstfix.global_localization.verify import BEAMS
from firstfix.web.binary_frames import (
    NO_RETURN,
    belief_frame,
    mass_map,
    particles_frame,
    scan_frame,
)
from firstfix.web.snapshot import ParticleCloud, Snapshot


@pytest.fixture(scope="module")
def view() -> Snapshot:
    begun = drive()
    begun.step(30)
    return begun.store.snapshot


def opened(frame: bytes, columns: int) -> tuple[tuple, np.ndarray, bytes]:
    kind, version, zero, n, stamp = struct.unpack_from("<BBHId", frame)
    values = np.frombuffer(frame, "<f4", columns * n, 16).reshape(n, columns)
    return (kind, version, zero, n, stamp), values, frame[16 + 4 * columns * n :]


def test_a_scan_is_drawn_at_its_pose(view):
    header, points, classes = opened(scan_frame(view.scan, view.map), 2)
    scan = view.scan.scan
    hit = usable_beams(scan).thinned(BEAMS).hit
    assert header == (1, 1, 0, len(hit), scan.stamp)
    assert len(classes) == header[3]
    expected = view.scan.T_map_base.apply(scan.points())
    distance = np.hypot(*(points[hit][:, None] - expected).T).min(axis=0)
    np.testing.assert_allclose(distance, 0.0, atol=1e-4)
    kinds = np.frombuffer(classes, np.uint8)
    assert ((kinds == NO_RETURN) == ~hit).all()
    assert (kinds[hit] == 0).mean() > 0.9


def test_beams_without_a_return_end_at_the_maximum_range(view):
    _, points, classes = opened(scan_frame(view.scan, view.map), 2)
    scan = view.scan.scan
    laser = view.scan.T_map_base @ scan.T_base_laser
    silent = points[np.frombuffer(classes, np.uint8) == NO_RETURN]
    assert len(silent) > 0
    reach = np.hypot(silent[:, 0] - laser.x, silent[:, 1] - laser.y)
    np.testing.assert_allclose(reach, scan.range_max, atol=1e-3)


def test_an_empty_frame_is_a_header_alone():
    assert scan_frame(None, None) == struct.pack("<BBHId", 1, 1, 0, 0, 0.0)
    assert particles_frame(None, None, 3.5) == struct.pack("<BBHId", 2, 1, 0, 0, 3.5)


def test_particles_move_with_the_robot():
    poses = np.array([[1.0, 2.0, 0.0], [1.0, 2.0, np.pi / 2]])
    belief = ParticleCloud(equal_weights(poses), SE2(1.0, 2.0, 0.0))
    header, values, rest = opened(particles_frame(belief, SE2(1.0, 2.0, 0.0), 7.0), 3)
    assert (header, rest) == ((2, 1, 0, 2, 7.0), b"")
    np.testing.assert_allclose(values, poses, atol=1e-6)
    _, values, _ = opened(particles_frame(belief, SE2(1.5, 2.0, 0.1), 7.1), 3)
    # Half a metre ahead, each in its own direction.
    moved = [[1.5, 2.0, 0.1], [1.0, 2.5, np.pi / 2 + 0.1]]
    np.testing.assert_allclose(values, moved, atol=1e-6)


class Places:
    """What `belief_frame` reads of a belief."""

    def __init__(self, poses: list[tuple[float, float, float]], probabilities: list[float]):
        self.poses = np.array(poses).reshape(-1, 3)
        self.probabilities = np.array(probabilities)


def test_mass_is_summed_in_the_cell_of_its_place_also_on_a_turned_map():
    grid = OccupancyGrid(np.zeros((40, 100), np.int8), 0.05, SE2(1.0, -2.0, 0.7))
    places = [(0.2, 0.3), (0.4, 0.1), (4.9, 1.9)]  # m from the origin of the map, along its axes
    poses = [(*grid.to_map(np.array([x, y]) / 0.05), 0.0) for x, y in places]
    mass, cell_m = mass_map(
        np.array([*poses, (99.0, 99.0, 0.0)]), np.array([0.2, 0.3, 0.4, 0.1]), grid
    )
    assert (mass.shape, cell_m) == ((4, 10), 0.5)
    assert mass[0, 0] == pytest.approx(0.5)
    assert mass[3, 9] == pytest.approx(0.4)
    assert mass.sum() == pytest.approx(0.9)  # one place is outside of the map


def test_a_large_map_has_a_coarser_heat_map():
    grid = OccupancyGrid(np.zeros((100, 6000), np.int8), 0.05)
    mass, cell_m = mass_map(np.empty((0, 3)), np.empty(0), grid)
    assert max(mass.shape) <= 256
    assert cell_m == pytest.approx(1.2)


def test_a_heat_map_shows_small_masses_and_nothing_where_there_is_none(view):
    near = view.pose.as_array()
    frame = belief_frame(Places([tuple(near), (0.6, 0.6, 0.0)], [0.99, 1e-6]), view.map)
    kind, version, _, n, _ = struct.unpack_from("<BBHId", frame)
    width, height, cell_m = struct.unpack_from("<HHf", frame, 16)
    heat = np.frombuffer(frame, np.uint8, offset=24).reshape(height, width)
    assert (kind, version, n) == (3, 1, heat.size)
    assert sorted(heat[heat > 0].tolist()) == [1, 254]
    row, column = np.argwhere(heat == 254)[0]
    corner = view.map.grid.to_map(np.array([column, row]) * cell_m / view.map.grid.resolution)
    assert np.hypot(*(corner - near[:2])) <= cell_m * 1.5


@pytest.mark.parametrize("belief", [None, Places([], [])])
def test_a_belief_without_places_is_an_empty_heat_map(view, belief):
    assert belief_frame(belief, view.map) == struct.pack("<BBHId", 3, 1, 0, 0, 0.0)
