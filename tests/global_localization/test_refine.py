"""Refinement ends at the true pose, with a covariance that matches its errors."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from firstfix.core.angles import wrap
from firstfix.core.grid import OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import Beams, usable_beams
from firstfix.global_localization.refine import refine_on_field, refine_on_rays
from firstfix.lab.simulation.lidar import Lidar

RESOLUTION = 0.05
LIDAR = Lidar(beams=360, sigma_m=0.01, range_max=12.0)


def in_cells(pose: SE2) -> NDArray[np.float64]:
    return np.array([[pose.x / RESOLUTION, pose.y / RESOLUTION, pose.yaw]])


def free_pose(fields: MapFields, rng: np.random.Generator) -> SE2:
    free = np.flatnonzero((fields.clearance > 8) & fields.grid.free)
    row, column = np.divmod(rng.choice(free), fields.grid.width)
    x, y = (np.array([column, row]) + rng.uniform(0.0, 1.0, 2)) * RESOLUTION
    return SE2(float(x), float(y), float(rng.uniform(-np.pi, np.pi)))


def scan_at(fields: MapFields, pose: SE2, rng: np.random.Generator) -> LaserScan:
    return LIDAR.scan(fields.grid, pose, rng)


def errors(refined: NDArray[np.float64], truth: SE2) -> NDArray[np.float64]:
    """Signed errors in x, y (m) and heading (rad), one row for each pose."""
    off = refined - in_cells(truth)
    off[:, :2] *= RESOLUTION
    off[:, 2] = wrap(off[:, 2])
    return off


def refine(poses: NDArray[np.float64], beams: Beams, fields: MapFields):
    return refine_on_rays(refine_on_field(poses, beams, fields), beams, fields)


@pytest.mark.parametrize("seed", range(20))
def test_from_as_far_as_the_search_leaves_it_both_steps_find_home(seed, room):
    rng = np.random.default_rng(seed)
    truth = free_pose(room, rng)
    beams = usable_beams(scan_at(room, truth, rng))
    around = np.arange(8) * (np.pi / 4)
    start = np.repeat(in_cells(truth), 8, axis=0)
    start[:, 0] += 0.1 / RESOLUTION * np.cos(around)
    start[:, 1] += 0.1 / RESOLUTION * np.sin(around)
    start[:, 2] += np.radians(1.4) * np.where(np.arange(8) % 2, 1.0, -1.0)
    off = errors(refine(start, beams, room)[0], truth)
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.01
    assert np.degrees(np.abs(off[:, 2])).max() < 0.1


@pytest.mark.parametrize("seed", range(5))
def test_the_first_step_alone_comes_within_half_a_cell_or_so(seed, room):
    rng = np.random.default_rng(seed)
    truth = free_pose(room, rng)
    beams = usable_beams(scan_at(room, truth, rng))
    start = in_cells(truth) + np.array([2.0, -1.0, 0.02])
    off = errors(refine_on_field(start, beams, room), truth)
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.05
    assert np.degrees(np.abs(off[:, 2])).max() < 1.0


def test_the_input_is_not_changed(room):
    rng = np.random.default_rng(1)
    truth = free_pose(room, rng)
    beams = usable_beams(scan_at(room, truth, rng))
    poses = in_cells(truth) + np.array([1.0, 1.0, 0.02])
    inputs = (poses, beams.bearings, beams.ranges, beams.hit)
    before = [array.copy() for array in inputs]
    for step in (refine_on_field, refine_on_rays):
        step(poses, beams, room)
        for array, copy in zip(inputs, before, strict=True):
            np.testing.assert_array_equal(array, copy)


def test_each_pose_is_refined_alone(room):
    rng = np.random.default_rng(2)
    truth = free_pose(room, rng)
    beams = usable_beams(scan_at(room, truth, rng))
    poses = in_cells(truth) + rng.uniform(-3.0, 3.0, (6, 3)) * [1.0, 1.0, 0.02]
    order = rng.permutation(6)
    together, covariances = refine(poses, beams, room)
    shuffled, shuffled_covariances = refine(poses[order], beams, room)
    np.testing.assert_array_equal(shuffled, together[order])
    np.testing.assert_array_equal(shuffled_covariances, covariances[order])


def test_no_pose_stays_no_pose(room):
    beams = Beams(np.zeros(3), np.ones(3), np.ones(3, np.bool_))
    poses, covariances = refine(np.empty((0, 3)), beams, room)
    assert poses.shape == (0, 3)
    assert covariances.shape == (0, 3, 3)


def test_anywhere_the_covariance_is_symmetric_and_positive(room):
    """Also from a wrong pose, in a wall, outside the map, or with beams that meet nothing."""
    rng = np.random.default_rng(3)
    poses = np.column_stack(
        [rng.uniform(-20, 220, 50), rng.uniform(-20, 180, 50), rng.uniform(-7, 7, 50)]
    )
    beams = Beams(rng.uniform(-7, 7, 90), rng.uniform(0.05, 20, 90), rng.random(90) < 0.8)
    refined, covariances = refine(poses, beams, room)
    assert np.isfinite(refined).all()
    np.testing.assert_allclose(covariances, covariances.transpose(0, 2, 1), rtol=1e-9, atol=1e-12)
    assert (np.linalg.eigvalsh(covariances) > 0.0).all()


def test_the_true_pose_is_within_the_covariance(room):
    """Mahalanobis distance within 3 sigma for at least 95 % of scans, and it is not pessimistic."""
    distances, sigmas = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        truth = free_pose(room, rng)
        beams = usable_beams(scan_at(room, truth, rng))
        start = in_cells(truth) + rng.uniform(-1.0, 1.0, 3) * [2.0, 2.0, 0.02]
        (refined,), (covariance,) = refine(start, beams, room)
        off = refined - in_cells(truth)[0]
        off[2] = wrap(float(off[2]))
        distances.append(np.sqrt(off @ np.linalg.solve(covariance, off)))
        sigmas.append(np.sqrt(np.diag(covariance)) * [RESOLUTION, RESOLUTION, 1.0])
    assert np.mean(np.array(distances) <= 3.0) >= 0.95
    x, y, heading = np.median(sigmas, axis=0)
    assert max(x, y) < 0.03
    assert np.degrees(heading) < 0.5


@pytest.fixture(scope="module", params=["east", "north"])
def corridor(request) -> tuple[MapFields, int]:
    """60 m long and 2 m wide, ends out of sight; and the axis it runs along."""
    cells = np.full((44, 1200), OCCUPIED, np.int8)
    cells[2:-2, 2:-2] = 0
    along = 0
    if request.param == "north":
        cells, along = cells.T.copy(), 1
    return MapFields(OccupancyGrid(np.pad(cells, 4, constant_values=UNKNOWN), 0.05)), along


@pytest.mark.parametrize("yaw", [0.0, 0.6, 2.5])
def test_in_a_corridor_only_the_way_across_is_known(corridor, yaw):
    fields, along = corridor
    middle = fields.grid.width / 2 * RESOLUTION, fields.grid.height / 2 * RESOLUTION
    truth = SE2(*middle, yaw)
    beams = usable_beams(scan_at(fields, truth, np.random.default_rng(0)))
    (refined,), (covariance,) = refine(in_cells(truth), beams, fields)
    sigma = np.sqrt(np.diag(covariance)) * RESOLUTION
    assert sigma[along] > 10.0 * sigma[1 - along]
    assert sigma[along] > 0.1
    assert sigma[1 - along] < 0.03
    off = np.abs(errors(refined[None], truth)[0])
    assert off[1 - along] < 0.01
    # What is not known is left where it was.
    assert off[along] < 0.3


def test_fewer_and_worse_beams_make_it_less_sure(room):
    rng = np.random.default_rng(4)
    truth = free_pose(room, rng)
    beams = usable_beams(scan_at(room, truth, rng))
    noisy = Beams(beams.bearings, beams.ranges + rng.normal(0.0, 0.05, len(beams)), beams.hit)
    volume = [
        np.linalg.det(refine(in_cells(truth), b, room)[1][0])
        for b in (beams, noisy, beams.thinned(30))
    ]
    assert volume[0] < volume[1]
    assert volume[0] < volume[2]


def test_whole_turns_of_the_heading_change_nothing(room):
    rng = np.random.default_rng(5)
    truth = free_pose(room, rng)
    beams = usable_beams(scan_at(room, truth, rng))
    start = in_cells(truth) + np.array([1.0, -1.0, 0.02])
    turn = np.array([0.0, 0.0, 2 * np.pi])
    here, there = (refine(pose, beams, room)[0] for pose in (start, start + turn))
    np.testing.assert_allclose(there, here + turn, atol=1e-6)
