"""Points in space as the scan of a level sensor."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from firstfix.core.errors import ScanError
from firstfix.core.points import points_from_depth, scan_from_points
from firstfix.core.se2 import SE2

LEVEL = (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)


def ring(radius: float, height: float, n: int = 7200) -> np.ndarray:
    turn = np.linspace(-math.pi, math.pi, n, endpoint=False)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(n, height)])


def test_a_round_wall_is_at_its_distance_in_every_direction():
    scan = scan_from_points(ring(3.0, 0.2), LEVEL)
    assert len(scan) == 720
    assert_allclose(scan.ranges, 3.0, atol=1e-5)
    assert scan.hit.all()


def test_the_nearest_point_of_a_direction_counts():
    scan = scan_from_points(np.vstack([ring(3.0, 0.2), ring(2.0, 0.7)]), LEVEL)
    assert_allclose(scan.ranges, 2.0, atol=1e-5)


def test_ground_ceiling_and_invalid_points_are_left_out():
    ground, ceiling = ring(1.0, -0.45), ring(1.0, 1.5)
    invalid = np.array([[np.nan, 1.0, 0.0], [1.0, np.inf, 0.0], [0.0, 0.0, 0.0], [1e30, 0.0, 0.0]])
    assert not scan_from_points(np.vstack([ground, ceiling, invalid]), LEVEL).hit.any()


@pytest.mark.parametrize("edge", [0.1, 1.8])
def test_the_band_ends_at_its_heights(edge):
    at = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    point = np.array([[2.0, 0.1, edge]], np.float64)
    inwards = np.array([0.0, 0.0, 1.0 if edge < 1.0 else -1.0])
    assert scan_from_points(point + 1e-6 * inwards, at).hit.sum() == 1
    assert scan_from_points(point - 1e-3 * inwards, at).hit.sum() == 0


def test_a_direction_without_a_point_is_not_known_to_be_free():
    scan = scan_from_points([[2.0, 0.01, 0.2]], LEVEL)
    assert scan.hit.sum() == 1
    assert not scan.no_return.any()


def test_no_points_are_a_scan_without_hits():
    assert not scan_from_points(np.empty((0, 3)), LEVEL).hit.any()


def random_pose(rng: np.random.Generator) -> tuple[float, ...]:
    return (*rng.uniform(-0.5, 0.5, 2), rng.uniform(0.2, 1.0), *rng.uniform(-0.6, 0.6, 3))


def turned(pose, points):
    """Points of the base frame in the frame of a sensor: rotations one after another."""
    x, y, z, roll, pitch, yaw = pose
    c, s = math.cos, math.sin
    about_x = np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]])
    about_y = np.array([[c(pitch), 0, s(pitch)], [0, 1, 0], [-s(pitch), 0, c(pitch)]])
    about_z = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    R = about_z @ about_y @ about_x
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, (x, y, z)
    return (points - [x, y, z]) @ R, T


def test_tilt_of_the_sensor_is_undone():
    """The end points are those of the wall, however the sensor sits; the floor never is one."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        pose = random_pose(rng)
        in_base = np.vstack([ring(3.0, 0.6), ring(1.5, 0.0)]) + np.array([0.2, -0.1, 0.0])
        seen, T = turned(pose, in_base)
        for way in (pose, T):
            scan = scan_from_points(seen, way)
            assert scan.T_base_laser == SE2(pose[0], pose[1], 0.0)
            off = np.hypot(*(scan.points() - [0.2, -0.1]).T)
            assert_allclose(off, 3.0, atol=0.03)  # half a beam sideways
            assert len(off) == 720


def test_shape_and_kind_of_the_array_do_not_matter():
    points = ring(3.0, 0.2, 360)
    expected = scan_from_points(points, LEVEL).ranges
    for same in (points.reshape(10, 36, 3), points.astype(np.float32), points.tolist()):
        assert_allclose(scan_from_points(same, LEVEL).ranges, expected, rtol=1e-6)


def test_a_view_is_a_part_of_the_turn():
    scan = scan_from_points(ring(3.0, 0.2), LEVEL, view=(-0.5, 0.5), step=0.01)
    assert len(scan) == 100
    assert_allclose(scan.bearings[[0, -1]], [-0.495, 0.495])
    assert scan.hit.all()


def test_a_depth_image_of_a_wall_is_a_wall():
    """The optical frame looks along x of the base: z forward, x right, y down."""
    T = np.eye(4)
    T[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    T[:3, 3] = (0.1, 0.0, 0.6)
    points = points_from_depth(np.full((120, 160), 2.0), (140.0, 140.0), (79.5, 59.5))
    scan = scan_from_points(points, T, view=(-0.45, 0.45))
    ends = scan.points()
    assert len(ends) == len(scan)
    assert_allclose(ends[:, 0], 2.1, atol=0.01)
    left = points_from_depth([[2.0, 3.0]], (1.0, 1.0), (0.5, 0.0))[0, 0]
    assert left[0] < 0.0


def test_unknown_depth_is_no_point():
    points = points_from_depth([[0.0, np.nan, -1.0, 2.0]], (1.0, 1.0), (0.0, 0.0))
    assert np.isfinite(points).all(axis=-1).tolist() == [[False, False, False, True]]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: scan_from_points(np.zeros((3, 2)), LEVEL), r"\(n, 3\), not float64 of \(3, 2\)"),
        (lambda: scan_from_points([["x", "y", "z"]], LEVEL), "Points are numbers"),
        (lambda: points_from_depth([["far"]], (1, 1), (0, 0)), "depth image of <U3"),
        (lambda: scan_from_points(np.zeros(3), LEVEL), r"shape \(n, 3\)"),
        (lambda: scan_from_points(np.zeros((1, 3)), (0, 0, 0)), "no pose in space"),
        (lambda: scan_from_points(np.zeros((1, 3)), np.diag([1, 1, -1, 1])), "no pose in space"),
        (lambda: scan_from_points(np.zeros((1, 3)), 2 * np.eye(4)), "no pose in space"),
        (lambda: scan_from_points(np.zeros((1, 3)), LEVEL, (2.0, 1.0)), "The band 2.0 to 1.0 m"),
        (lambda: scan_from_points(np.zeros((1, 3)), LEVEL, view=(0.0, 7.0)), "at most a full turn"),
        (lambda: scan_from_points(np.zeros((1, 3)), LEVEL, step=0.0), "is no scan"),
        (lambda: points_from_depth(np.zeros(3), (1, 1), (0, 0)), "depth image of float64 of shape"),
        (lambda: points_from_depth(np.zeros((2, 2)), (0, 1), (0, 0)), "focal lengths"),
    ],
)
def test_other_input_is_refused(call, words):
    with pytest.raises(ScanError, match=words):
        call()
