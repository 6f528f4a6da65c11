"""SE(2) is a group, and acts on points."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.angles import angle_error
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2

metres = st.floats(-1e3, 1e3)
poses = st.builds(SE2, metres, metres, st.floats(-10.0, 10.0))


def assert_close(a: SE2, b: SE2) -> None:
    assert a.distance_to(b) < 1e-8
    assert angle_error(a.yaw, b.yaw) < 1e-9


@given(poses)
def test_identity_changes_nothing(T: SE2) -> None:
    assert_close(T @ SE2.identity(), T)
    assert_close(SE2.identity() @ T, T)


@given(poses)
def test_inverse_undoes_from_both_sides(T: SE2) -> None:
    assert_close(T @ T.inverse(), SE2.identity())
    assert_close(T.inverse() @ T, SE2.identity())
    assert_close(T.inverse().inverse(), T)


@given(poses, poses, poses)
def test_products_are_associative(T_a_b: SE2, T_b_c: SE2, T_c_d: SE2) -> None:
    assert_close((T_a_b @ T_b_c) @ T_c_d, T_a_b @ (T_b_c @ T_c_d))


@given(poses, poses)
def test_the_inverse_of_a_product_swaps_the_factors(T: SE2, U: SE2) -> None:
    assert_close((T @ U).inverse(), U.inverse() @ T.inverse())


@given(poses, poses, metres, metres)
def test_apply_chains_like_the_product(T: SE2, U: SE2, x: float, y: float) -> None:
    points = np.array([[x, y], [0.0, 0.0]])
    np.testing.assert_allclose((T @ U).apply(points), T.apply(U.apply(points)), atol=1e-8)


@given(poses)
def test_apply_keeps_distances_and_takes_the_origin_to_the_pose(T: SE2) -> None:
    points = np.array([[0.0, 0.0], [3.0, 4.0]])
    moved = T.apply(points)
    assert math.dist(*moved) == pytest.approx(5.0)
    np.testing.assert_allclose(moved[0], [T.x, T.y])


def test_a_quarter_turn_goes_counter_clockwise() -> None:
    np.testing.assert_allclose(
        SE2(1.0, 2.0, math.pi / 2).apply(np.array([1.0, 0.0])), [1.0, 3.0], atol=1e-12
    )


def test_yaw_is_stored_in_the_half_open_interval() -> None:
    assert SE2(0.0, 0.0, -math.pi).yaw == math.pi
    assert SE2(0.0, 0.0, 5 * math.pi / 2).yaw == pytest.approx(math.pi / 2)


@given(poses)
def test_arrays_convert_both_ways(T: SE2) -> None:
    assert SE2.from_array(T.as_array()) == T


@given(poses, st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3))
def test_rotation_jacobian_turns_small_steps(T: SE2, dx: float, dy: float, dyaw: float) -> None:
    stepped = T @ SE2(dx, dy, dyaw)
    step = np.array([stepped.x - T.x, stepped.y - T.y, angle_error(stepped.yaw, T.yaw)])
    expected = T.rotation_jacobian() @ np.array([dx, dy, dyaw])
    np.testing.assert_allclose(step[:2], expected[:2], atol=1e-9)
    assert step[2] == pytest.approx(abs(expected[2]), abs=1e-9)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_pose_with_nan_or_infinity_is_refused(bad: float, place: int) -> None:
    numbers = [0.0, 0.0, 0.0]
    numbers[place] = bad
    with pytest.raises(InputError, match="finite"):
        SE2(*numbers)


def test_a_pose_unpacks_and_prints_in_one_line() -> None:
    x, y, yaw = SE2(1.0, -2.0, math.pi)
    assert (x, y, yaw) == (1.0, -2.0, math.pi)
    assert str(SE2(5.898, 1.84, math.radians(-88.8))) == "(5.90, 1.84) m -88.8°"
    assert str(SE2(-0.001, 0.0, -1e-6)) == "(0.00, 0.00) m 0.0°"


@given(poses)
def test_the_quaternion_leads_back_to_the_pose(pose: SE2) -> None:
    assert math.hypot(*pose.quaternion) == pytest.approx(1.0)
    back = SE2.from_quaternion(pose.x, pose.y, pose.quaternion)
    assert (back.x, back.y) == (pose.x, pose.y)
    assert angle_error(back.yaw, pose.yaw) < 1e-9
    negated = [-part for part in pose.quaternion]
    assert angle_error(SE2.from_quaternion(0.0, 0.0, negated).yaw, pose.yaw) < 1e-9


@pytest.mark.parametrize("tilt_deg", [0.0, 10.0, 29.0, 31.0, 90.0, 180.0])
def test_a_small_tilt_is_dropped_and_a_large_one_is_refused(tilt_deg: float) -> None:
    """The quaternion is a tilt about x, then a turn of 0.7 rad about z."""
    tilt, yaw = math.radians(tilt_deg) / 2, 0.7 / 2
    quaternion = (
        math.cos(yaw) * math.sin(tilt),
        math.sin(yaw) * math.sin(tilt),
        math.sin(yaw) * math.cos(tilt),
        math.cos(yaw) * math.cos(tilt),
    )
    if tilt_deg > 30.0:
        with pytest.raises(InputError, match="tilt of at most 30°"):
            SE2.from_quaternion(0.0, 0.0, quaternion)
    else:
        assert SE2.from_quaternion(0.0, 0.0, quaternion).yaw == pytest.approx(0.7)


@pytest.mark.parametrize(
    "quaternion", [(0, 0, 0, 0), (0, 0, 1), (0, 0, 0, math.nan), (1, 1, 1, 1), ()]
)
def test_what_is_no_unit_quaternion_is_refused(quaternion: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match="length 1"):
        SE2.from_quaternion(0.0, 0.0, quaternion)
