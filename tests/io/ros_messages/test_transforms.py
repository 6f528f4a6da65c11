"""Transforms in space: scipy judges the matrices, laws judge the rest."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import StampedTransform, to_planar
from firstfix.io.ros_messages.transforms import flat, inverse, matrix

LENGTHS = st.floats(-100.0, 100.0)
POINTS = st.tuples(LENGTHS, LENGTHS, LENGTHS)
ANGLES = st.floats(-math.pi, math.pi)
ROTATIONS = st.tuples(ANGLES, ANGLES, ANGLES).map(lambda a: Rotation.from_euler("xyz", a))


def transform(xyz, rotation):
    return StampedTransform("base", "laser", 1.0, xyz, tuple(rotation.as_quat()))


TRANSFORMS = st.builds(transform, POINTS, ROTATIONS)


@given(POINTS, ROTATIONS, POINTS)
def test_a_matrix_turns_and_shifts_points(xyz, rotation, point):
    T = matrix(transform(xyz, rotation))
    assert_allclose(T[:3, :3] @ point + T[:3, 3], rotation.apply(point) + xyz, atol=1e-9)
    assert_allclose(T[3], [0.0, 0.0, 0.0, 1.0])


@given(TRANSFORMS)
def test_there_and_back_is_nowhere(given_):
    T = matrix(given_)
    assert_allclose(inverse(T) @ T, np.eye(4), atol=1e-9)
    assert_allclose(inverse(inverse(T)), T, atol=1e-9)


@given(TRANSFORMS)
def test_the_shadow_on_the_floor_is_that_of_the_message(given_):
    shadow, planar = flat(matrix(given_)), to_planar(given_)
    assert_allclose([shadow.x, shadow.y], [planar.x, planar.y])
    R = matrix(given_)[:3, :3]
    if math.hypot(R[0, 0], R[1, 0]) > 1e-6:  # an axis that stands upright has no direction
        assert angle_error(shadow.yaw, planar.yaw) < 1e-6


@given(LENGTHS, LENGTHS, ANGLES)
def test_a_motion_on_the_floor_is_its_own_shadow(x, y, yaw):
    level = matrix(transform((x, y, 0.3), Rotation.from_euler("z", yaw)))
    assert flat(level).distance_to(SE2(x, y, yaw)) < 1e-12
    assert angle_error(flat(level).yaw, yaw) < 1e-12
