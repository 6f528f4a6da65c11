"""Each scan sharpens the published pose, and odometry keeps it: more precise, never wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.frames import to_cells
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.drawing import Drawing
from firstfix.localizer import pose_fusion
from firstfix.localizer.pose_fusion import SharpPose, hold, sharpen

HERE = SE2(4.0, 3.0, 1.0)
ODOM = SE2(-3.0, 7.0, 2.0)


def variances(metres, degrees):
    return np.diag([metres**2, metres**2, math.radians(degrees) ** 2])


COVARIANCE = variances(0.07, 2.0)


@pytest.fixture(scope="module")
def hall(hall_plan):
    return MapFields(hall_plan)


@pytest.fixture(scope="module")
def corridor():
    """A corridor of 40 m without an end in sight: nothing fixes the pose along it."""
    plan = Drawing(40.0, 3.0, 0.05, 1.0)
    plan.room(0.0, 0.0, 40.0, 2.5)
    return MapFields(plan.grid())


def seen(fields, pose, seed=0, **lidar):
    return Lidar(beams=180, **lidar).scan(fields.grid, pose, np.random.default_rng(seed))


def filtered(pose, T_odom_base=ODOM, covariance=COVARIANCE):
    return SharpPose(pose, covariance, T_odom_base)


def sharp(pose):
    return SharpPose(pose, variances(0.005, 0.1), ODOM)


@pytest.mark.parametrize("seed", range(8))
def test_an_error_of_centimetres_becomes_one_of_millimetres(hall, seed):
    rng = np.random.default_rng(seed)
    estimate = HERE @ SE2(*rng.normal(0.0, np.sqrt(np.diag(COVARIANCE))))
    fused = sharpen(filtered(estimate), seen(hall, HERE, seed), hall)
    assert fused.T_map_base.distance_to(HERE) < 0.015
    assert angle_error(fused.T_map_base.yaw, HERE.yaw) < math.radians(0.3)
    assert np.all(np.linalg.eigvalsh(fused.covariance) > 0.0)
    assert np.all(np.diag(fused.covariance) < np.diag(COVARIANCE))


def test_along_a_corridor_the_estimate_counts_and_across_it_the_scan(corridor):
    middle = SE2(20.0, 1.2, 0.1)
    estimate = SE2(20.2, 1.3, 0.1)
    scan = seen(corridor, middle, range_max=8.0)
    fused = sharpen(filtered(estimate), scan, corridor)
    assert abs(fused.T_map_base.x - estimate.x) < 0.03
    assert abs(fused.T_map_base.y - middle.y) < 0.02
    assert fused.covariance[0, 0] > 4.0 * fused.covariance[1, 1]


def test_along_a_corridor_odometry_keeps_what_earlier_scans_have_fixed(corridor):
    step, T_odom_base = SE2(0.1, 0.0, 0.0), ODOM
    truth, track = SE2(15.0, 1.2, 0.0), sharp(SE2(15.0, 1.2, 0.0))
    for k in range(50):
        truth, T_odom_base = truth @ step, T_odom_base @ step
        wide = np.diag([0.3**2, 0.07**2, math.radians(2.0) ** 2])
        estimate = filtered(truth @ SE2(0.3, 0.0, 0.0), T_odom_base, wide)
        track = sharpen(estimate, seen(corridor, truth, k, range_max=8.0), corridor, track)
    assert abs(track.T_map_base.x - truth.x) < 0.06
    assert math.sqrt(track.covariance[0, 0]) > 0.03


@pytest.mark.parametrize(("scans", "ahead"), [(5, 0.0), (80, 0.25)])
def test_a_refinement_that_leaps_and_fits_no_better_must_persist(
    corridor, monkeypatch, scans, ahead
):
    """People along a bare corridor look like walls across it."""
    middle = SE2(20.0, 1.2, 0.0)
    leap = np.array([[0.25 / 0.05, 0.0, 0.0]])
    refine = pose_fusion.refine_on_rays

    def misled(poses, beams, fields):
        moved, _ = refine(np.array([to_cells(fields.grid, scan, middle)]), beams, fields)
        return moved + leap, np.diag([0.6**2, 0.4**2, 0.002**2])[None]

    monkeypatch.setattr(pose_fusion, "refine_on_rays", misled)
    track = sharp(middle)
    for k in range(scans):
        scan = seen(corridor, middle, k, range_max=8.0)
        track = sharpen(filtered(middle), scan, corridor, track)
    assert abs(track.T_map_base.x - middle.x - ahead) < 0.06


@pytest.mark.parametrize("off", [SE2(1.0, 0.0, 0.0), SE2(0.0, 0.0, math.radians(30.0))])
def test_a_refinement_that_leads_far_away_is_not_used(hall, off):
    estimate = HERE @ off
    fused = sharpen(filtered(estimate), seen(hall, HERE), hall).T_map_base
    assert fused.distance_to(estimate) <= 0.3
    assert angle_error(fused.yaw, estimate.yaw) <= math.radians(10.0)


def test_a_refinement_may_be_as_far_away_as_the_filter_allows_for(hall):
    estimate = HERE @ SE2(0.36, 0.0, 0.0)
    scan = seen(hall, HERE)
    unsure = sharpen(filtered(estimate, covariance=variances(0.3, 2.0)), scan, hall)
    assert unsure.T_map_base.distance_to(HERE) < 0.02
    sure = sharpen(filtered(estimate), scan, hall)
    assert sure.T_map_base == estimate


@pytest.mark.parametrize("off", [SE2(0.4, 0.0, 0.1), SE2(-0.2, 0.3, -0.2)])
def test_a_filter_that_has_gone_astray_does_not_take_the_sharp_pose_along(hall, off):
    estimate = filtered(HERE @ off, covariance=variances(0.03, 1.0))
    fused = sharpen(estimate, seen(hall, HERE), hall, sharp(HERE))
    assert fused.T_map_base.distance_to(HERE) < 0.015


def test_a_robot_that_was_carried_to_another_place_goes_with_the_filter(hall):
    there = SE2(7.5, 5.0, -1.0)
    fused = sharpen(filtered(there), seen(hall, there), hall, sharp(HERE))
    assert fused.T_map_base.distance_to(there) < 0.015


def test_wheels_that_slipped_do_not_turn_the_pose(hall):
    slipped = ODOM @ SE2(0.1, 0.0, math.radians(11.0))
    truth = HERE @ SE2(0.1, 0.0, 0.0)
    estimate = filtered(truth @ SE2(0.03, 0.0, math.radians(3.0)), slipped)
    fused = sharpen(estimate, seen(hall, truth), hall, sharp(HERE))
    assert fused.T_map_base.distance_to(truth) < 0.015
    assert angle_error(fused.T_map_base.yaw, truth.yaw) < math.radians(0.3)


@pytest.mark.parametrize("ranges", [math.nan, math.inf, [2.0] * 7 + [math.nan] * 173])
def test_a_scan_with_too_few_hits_changes_nothing(hall, with_ranges, ranges):
    scan = with_ranges(lambda _: ranges)(seen(hall, HERE))
    estimate = filtered(HERE)
    assert sharpen(estimate, scan, hall) is estimate


def test_without_a_scan_odometry_carries_the_pose_as_long_as_the_filter_agrees():
    step = SE2(0.2, 0.0, 0.3)
    estimate = filtered(HERE @ step @ SE2(0.1, 0.0, 0.0), ODOM @ step)
    assert hold(estimate, sharp(HERE)).T_map_base.distance_to(HERE @ step) < 1e-9
    astray = filtered(HERE @ SE2(0.6, 0.0, 0.0), ODOM @ step)
    assert hold(astray, sharp(HERE)) is astray
    assert hold(estimate, None) is estimate


def test_particles_that_have_become_one_are_no_obstacle(hall):
    estimate, track = filtered(HERE, covariance=np.zeros((3, 3))), None
    for k in range(3):
        track = hold(sharpen(estimate, seen(hall, HERE, k), hall, track), track)
    assert track.T_map_base.distance_to(HERE) < 0.015


def test_a_doubtful_heading_becomes_a_doubtful_position_across_the_way():
    heading = SharpPose(SE2(1.0, 2.0, 0.5), np.diag([1e-8, 1e-8, 0.1**2]), ODOM)
    moved = heading.carried(ODOM @ SE2(3.0, 0.0, 0.0))
    sideways = np.array([-math.sin(0.5), math.cos(0.5)])
    forwards = np.array([math.cos(0.5), math.sin(0.5)])
    position = moved.covariance[:2, :2]
    assert sideways @ position @ sideways > (0.1 * 3.0) ** 2
    assert forwards @ position @ forwards < 0.1 * (sideways @ position @ sideways)
    assert moved.covariance[2] @ [*sideways, 0.0] > 0.0


def test_no_number_of_scans_makes_a_map_exact(hall):
    track = None
    for k in range(30):
        track = sharpen(filtered(HERE), seen(hall, HERE, k), hall, track)
    published = track.covariance_on(hall.grid)
    assert np.sqrt(np.diag(published))[:2].min() > 0.25 * 0.05
    assert np.all(np.linalg.eigvalsh(published - track.covariance) > 0.0)


def test_headings_are_fused_across_the_turn_from_plus_to_minus_pi(hall):
    west = SE2(4.0, 3.0, math.pi - 0.005)
    estimate = filtered(SE2(4.0, 3.0, -math.pi + 0.01))
    fused = sharpen(estimate, seen(hall, west), hall)
    assert angle_error(fused.T_map_base.yaw, west.yaw) < math.radians(0.3)
