"""The published pose is fused with a refinement of the scan: more precise, never wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.drawing import Drawing
from firstfix.localizer.pose_fusion import fuse_with_scan

HERE = SE2(4.0, 3.0, 1.0)
COVARIANCE = np.diag([0.07**2, 0.07**2, math.radians(2.0) ** 2])


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


@pytest.mark.parametrize("seed", range(8))
def test_an_error_of_centimetres_becomes_one_of_millimetres(hall, seed):
    rng = np.random.default_rng(seed)
    estimate = HERE @ SE2(*rng.normal(0.0, np.sqrt(np.diag(COVARIANCE))))
    fused, covariance = fuse_with_scan(estimate, COVARIANCE, seen(hall, HERE, seed), hall)
    assert fused.distance_to(HERE) < 0.015
    assert angle_error(fused.yaw, HERE.yaw) < math.radians(0.3)
    assert np.all(np.linalg.eigvalsh(covariance) > 0.0)
    assert np.all(np.diag(covariance) < np.diag(COVARIANCE))


def test_along_a_corridor_the_estimate_counts_and_across_it_the_scan(corridor):
    middle = SE2(20.0, 1.2, 0.1)
    estimate = SE2(20.2, 1.3, 0.1)
    scan = seen(corridor, middle, range_max=8.0)
    fused, covariance = fuse_with_scan(estimate, COVARIANCE, scan, corridor)
    assert abs(fused.x - estimate.x) < 0.03
    assert abs(fused.y - middle.y) < 0.02
    assert covariance[0, 0] > 4.0 * covariance[1, 1]


@pytest.mark.parametrize("off", [SE2(1.0, 0.0, 0.0), SE2(0.0, 0.0, math.radians(30.0))])
def test_a_refinement_that_leads_far_away_is_not_used(hall, off):
    estimate = HERE @ off
    fused, _ = fuse_with_scan(estimate, COVARIANCE, seen(hall, HERE), hall)
    assert fused.distance_to(estimate) <= 0.3
    assert angle_error(fused.yaw, estimate.yaw) <= math.radians(10.0)


@pytest.mark.parametrize("ranges", [math.nan, math.inf, [2.0] * 7 + [math.nan] * 173])
def test_a_scan_with_too_few_hits_changes_nothing(hall, with_ranges, ranges):
    scan = with_ranges(lambda _: ranges)(seen(hall, HERE))
    fused, covariance = fuse_with_scan(HERE, COVARIANCE, scan, hall)
    assert fused == HERE
    assert covariance is COVARIANCE


def test_headings_are_fused_across_the_turn_from_plus_to_minus_pi(hall):
    west = SE2(4.0, 3.0, math.pi - 0.005)
    estimate = SE2(4.0, 3.0, -math.pi + 0.01)
    fused, _ = fuse_with_scan(estimate, COVARIANCE, seen(hall, west), hall)
    assert angle_error(fused.yaw, west.yaw) < math.radians(0.3)
