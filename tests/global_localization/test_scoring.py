"""Poses that others propose: the right one fits, a wrong one does not, a slip is found."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from firstfix.core.angles import angle_error
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import usable_beams
from firstfix.global_localization.frames import to_cells
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.scoring import classify_beams, score_poses, search_locally
from firstfix.global_localization.verify import BEAMS, BeamClass, verify
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_poses

LIDAR = Lidar(beams=180)
FAR_M, FAR_RAD = 1.0, math.radians(45.0)


@pytest.fixture(scope="session")
def hall(hall_plan: OccupancyGrid) -> MapFields:
    return MapFields(hall_plan)


@pytest.fixture(scope="session")
def office_fields(office_locator: ScanMatcher) -> MapFields:
    return office_locator.fields


def drawn(fields: MapFields, n: int, seed: int = 0) -> list[SE2]:
    return random_free_poses(fields.grid, np.random.default_rng(seed), n, 0.4)


def seen(fields: MapFields, pose: SE2, lidar: Lidar = LIDAR, seed: int = 0) -> LaserScan:
    return lidar.scan(fields.grid, pose, np.random.default_rng(seed))


def off_by(pose: SE2, rng: np.random.Generator, metres: float, degrees: float) -> SE2:
    """Return a pose so far away, to a random side."""
    towards = rng.uniform(-math.pi, math.pi)
    turn = math.radians(degrees) * rng.choice([-1.0, 1.0])
    return pose @ SE2(metres * math.cos(towards), metres * math.sin(towards), turn)


def is_at(pose: SE2, truth: SE2, metres: float = 0.03, degrees: float = 1.0) -> bool:
    near = pose.distance_to(truth) <= metres
    return near and math.degrees(angle_error(pose.yaw, truth.yaw)) <= degrees


def test_the_true_pose_fits_and_the_others_do_not(hall):
    poses = drawn(hall, 30)
    for truth in poses[:10]:
        scan = seen(hall, truth)
        for pose, place in zip(poses, score_poses(scan, poses, hall), strict=True):
            if pose == truth:
                assert place.score < 0.3
                assert place.evidence.explained > 0.95
                assert place.probability > 0.99
            elif pose.distance_to(truth) > FAR_M or angle_error(pose.yaw, truth.yaw) > FAR_RAD:
                assert place.score > 1.7
                assert place.probability < 0.95


def test_a_small_error_is_mended(hall):
    rng = np.random.default_rng(1)
    for truth in drawn(hall, 10, seed=1):
        scan, proposed = seen(hall, truth), off_by(truth, rng, 0.15, 5.0)
        (place,) = score_poses(scan, [proposed], hall)
        assert is_at(place.pose, truth, metres=0.05)
        assert place.score < 0.4


def test_none_becomes_another_place_and_none_becomes_worse(hall):
    """Up to 0.3 m and 10 degrees: more is for a search."""
    truth, *proposed = drawn(hall, 200, seed=2)
    rng = np.random.default_rng(2)
    proposed += [off_by(truth, rng, rng.uniform(0.2, 0.5), rng.uniform(0, 20)) for _ in range(100)]
    scan = seen(hall, truth)
    as_given = verify(
        np.array([to_cells(hall.grid, scan, pose) for pose in proposed]), usable_beams(scan), hall
    )
    moved = 0
    for pose, place, score in zip(
        proposed, score_poses(scan, proposed, hall), as_given.scores, strict=True
    ):
        assert place.pose.distance_to(pose) <= 0.3 + 1e-9
        assert angle_error(place.pose.yaw, pose.yaw) <= math.radians(10.0) + 1e-9
        assert place.score <= score
        moved += place.pose.distance_to(pose) > 0.01
    assert moved > 50  # else nothing was held back


def test_each_is_judged_by_itself_and_in_its_turn(hall):
    poses = drawn(hall, 12, seed=3)
    scan = seen(hall, poses[5])
    together = score_poses(scan, poses, hall)
    assert len(together) == 12
    for pose, place in zip(poses, together, strict=True):
        (alone,) = score_poses(scan, [pose], hall)
        assert (alone.pose, alone.score, alone.probability) == (
            place.pose,
            place.score,
            place.probability,
        )
    backwards = score_poses(scan, poses[::-1], hall)
    assert [place.pose for place in backwards] == [place.pose for place in together][::-1]


@pytest.mark.parametrize("mounting", Mounting)
@pytest.mark.parametrize("T_base_laser", [SE2.identity(), SE2(0.3, -0.2, 2.5)])
def test_the_sensor_may_sit_anywhere_on_the_robot(hall, mounting, T_base_laser):
    lidar = Lidar(beams=180, fov=4.0, T_base_laser=T_base_laser, mounting=mounting)
    truth = SE2(4.0, 3.0, 1.0)
    scan = seen(hall, truth, lidar)
    (place,) = score_poses(scan, [truth @ SE2(0.1, 0.05, 0.05)], hall)
    assert is_at(place.pose, truth, metres=0.1, degrees=1.5)
    near = search_locally(scan, truth @ SE2(0.4, 0.3, -0.4), hall)
    assert is_at(near.pose, truth, metres=0.06)


def test_move_map_and_poses_together_and_nothing_changes(hall):
    moved_by = SE2(-20.0, 7.0, 2.2)
    grid = hall.grid
    moved_grid = OccupancyGrid(grid.cells, grid.resolution, moved_by @ grid.T_map_grid)
    elsewhere = MapFields(moved_grid)
    truth, *others = drawn(hall, 6, seed=4)
    scan = seen(hall, truth)
    poses = [truth @ SE2(0.1, 0.0, 0.05), *others]
    here = score_poses(scan, poses, hall)
    there = score_poses(scan, [moved_by @ pose for pose in poses], elsewhere)
    for a, b in zip(here, there, strict=True):
        assert b.score == pytest.approx(a.score, abs=1e-6)
        assert (moved_by @ a.pose).distance_to(b.pose) < 1e-6
    slipped = truth @ SE2(0.5, 0.2, -0.3)
    near_here = search_locally(scan, slipped, hall)
    near_there = search_locally(scan, moved_by @ slipped, elsewhere)
    assert (moved_by @ near_here.pose).distance_to(near_there.pose) < 1e-6


def test_outside_of_the_map_nothing_fits(hall):
    scan = seen(hall, SE2(4.0, 3.0, 1.0))
    for pose in (SE2(-50.0, 3.0, 0.0), SE2(4.0, 1e6, 1.0), SE2(1e12, -1e12, 0.0)):
        (place,) = score_poses(scan, [pose], hall)
        assert place.score > 2.3
        assert place.evidence.explained == 0.0
        assert search_locally(scan, pose, hall).score > 2.3


@pytest.mark.parametrize(("metres", "degrees"), [(0.0, 0.0), (0.3, 35.0), (0.5, 20.0), (0.7, 35.0)])
def test_a_slip_is_found_from_nearby(office_fields, metres, degrees):
    rng = np.random.default_rng(5)
    for truth in drawn(office_fields, 12, seed=5):
        scan = seen(office_fields, truth)
        place = search_locally(scan, off_by(truth, rng, metres, degrees), office_fields)
        assert is_at(place.pose, truth)
        assert place.score < 0.3
        assert np.linalg.eigvalsh(place.covariance).min() > 0.0
        sigma = np.sqrt(np.diag(place.covariance))
        assert sigma[:2].max() < 0.1
        assert sigma[2] < math.radians(3.0)


def test_nearby_is_not_everywhere(office_fields):
    poses = drawn(office_fields, 20, seed=6)
    for truth, far in zip(poses[:10], poses[10:], strict=True):
        if truth.distance_to(far) > 3.0:
            place = search_locally(seen(office_fields, truth), far, office_fields)
            assert place.pose.distance_to(far) < 2.0
            assert place.score > 0.6


def test_two_calls_agree_to_the_last_bit(hall):
    truth = SE2(4.0, 3.0, 1.0)
    scan = seen(hall, truth)
    a, b = (search_locally(scan, truth @ SE2(0.4, 0.1, 0.3), hall) for _ in range(2))
    assert (a.pose, a.score, a.probability, a.evidence) == (
        b.pose,
        b.score,
        b.probability,
        b.evidence,
    )
    assert a.covariance.tobytes() == b.covariance.tobytes()


@pytest.mark.parametrize("value", [math.nan, 0.0])
def test_a_blind_scan_neither_confirms_nor_rejects(hall, value):
    truth = SE2(4.0, 3.0, 1.0)
    blind = dataclasses.replace(seen(hall, truth), ranges=np.full(180, value, np.float32))
    (place,) = score_poses(blind, [truth], hall)
    assert place.pose == truth
    assert place.evidence.beams == 0
    assert place.probability == pytest.approx(0.5)
    assert search_locally(blind, truth, hall).evidence.beams == 0


def test_what_a_hand_over_the_sensor_leaves_is_not_found_within_a_wall(office_fields):
    """All that is very near would fit there, beam by beam."""
    grid = office_fields.grid
    for seed, truth in enumerate(drawn(office_fields, 6, seed=7)):
        scan = seen(office_fields, truth)
        hand = np.random.default_rng(seed).uniform(0.12, 0.3, len(scan)).astype(np.float32)
        place = search_locally(dataclasses.replace(scan, ranges=hand), truth, office_fields)
        column, row, _ = to_cells(grid, scan, place.pose).astype(int)
        assert not grid.occupied[row, column] or place.score > 2.3


@pytest.mark.parametrize("outside", [SE2(1000.0, 0.0, 0.0), SE2(0.0, -50.0, 1.0)])
def test_a_pose_far_outside_the_map_has_probability_zero(hall, outside):
    """Open space in most directions costs little anywhere: there it proves nothing."""
    (pose,) = drawn(hall, 1)
    scan = seen(hall, pose)
    far = np.where(np.arange(len(scan)) % 8 == 0, scan.ranges, np.inf).astype(np.float32)
    scan = LaserScan(far, scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
    (place,) = score_poses(scan, [outside], hall)
    assert place.probability == 0.0


@pytest.mark.parametrize("n", [90, 180, 720])
def test_classes_of_beams_have_the_shares_of_the_evidence(hall, n):
    (pose,) = drawn(hall, 1)
    scan = seen(hall, pose, Lidar(beams=n, range_max=4.0))
    (judged,) = score_poses(scan, [pose], hall)
    beams, e = classify_beams([scan], judged.pose, hall), judged.evidence
    assert len(beams.classes) == len(beams.ends) == len(beams.hit) == e.beams <= BEAMS
    shares = [beams.share(kind) for kind in BeamClass]
    assert shares == [e.explained, e.short, e.through_wall, e.unknown]


def test_hits_end_at_the_points_of_the_scan(hall):
    (pose,) = drawn(hall, 1)
    scan = seen(hall, pose)
    beams = classify_beams([scan], pose, hall)
    points = pose.apply(scan.points())
    for end in beams.ends[beams.hit]:
        assert np.hypot(*(points - end).T).min() < 1e-6
