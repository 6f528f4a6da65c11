"""Motion of the particles: the increment of the odometry, and noise as large as the alphas give."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig, MotionModel
from firstfix.amcl.motion import Motion, _drive, pieces, propagate
from firstfix.amcl.particles import Particles, equal_weights
from firstfix.core.angles import angle_error, wrap
from firstfix.core.se2 import SE2

SILENT = {f"alpha{k}": 0.0 for k in range(1, 6)}
WHEELED = [MotionModel.DIFFERENTIAL, MotionModel.OMNIDIRECTIONAL]

lengths = st.floats(-20.0, 20.0)
turns = st.floats(-math.pi, math.pi)
increments = st.builds(SE2, lengths, lengths, turns)


def somewhere(n: int, seed: int = 0) -> Particles:
    rng = np.random.default_rng(seed)
    poses = rng.uniform(-1.0, 1.0, (n, 3)) * [20.0, 20.0, math.pi]
    return equal_weights(poses).reweighed(rng.random(n))


def at_origin(n: int) -> Particles:
    return equal_weights(np.zeros((n, 3)))


def off(particles: Particles, pose: SE2) -> NDArray[np.float64]:
    """Poses seen from a pose: along, to the left, turned; shape (n, 3)."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    x, y = particles.x - pose.x, particles.y - pose.y
    return np.column_stack([c * x + s * y, c * y - s * x, wrap(particles.yaw - pose.yaw)])


def chained(pose: SE2, increment: SE2, times: int) -> SE2:
    for _ in range(times):
        pose = pose @ increment
    return pose


def assert_moved_exactly(before: Particles, after: Particles, increment: SE2) -> None:
    for old, new in zip(before.poses(), after.poses(), strict=True):
        expected = SE2.from_array(old) @ increment
        assert math.hypot(new[0] - expected.x, new[1] - expected.y) < 1e-9
        assert angle_error(float(new[2]), expected.yaw) < 1e-9
    np.testing.assert_array_equal(after.weight, before.weight)


@pytest.mark.parametrize("model", WHEELED)
@settings(deadline=None)
@given(increment=increments)
def test_without_noise_every_particle_moves_exactly(model, increment):
    before = somewhere(5)
    config = AmclConfig(robot_model_type=model, **SILENT)
    after = propagate(before, increment, config, np.random.default_rng(0))
    assert_moved_exactly(before, after, increment)


@pytest.mark.parametrize("model", WHEELED)
@pytest.mark.parametrize(
    "increment",
    [
        SE2(0.3, 0.0, 0.0),
        SE2(-0.3, 0.0, 0.0),
        SE2(-0.3, 0.05, -0.1),
        SE2(0.0, 0.0, math.pi),
        SE2(0.0, 0.4, 0.0),
        SE2(40.0, -3.0, 3.0),
        SE2(-0.05, 0.0, math.pi - 0.01),  # turning in place, but for a few centimetres backwards
        SE2(-0.009, 0.0, 0.0),  # too short to have a direction
        SE2(0.002, -0.003, 0.2),
    ],
    ids=str,
)
def test_without_noise_any_way_of_driving_is_exact(model, increment):
    before = somewhere(50)
    config = AmclConfig(robot_model_type=model, **SILENT)
    after = propagate(before, increment, config, np.random.default_rng(0))
    assert_moved_exactly(before, after, increment)


def test_what_stands_still_stays():
    before = somewhere(20)
    for model in MotionModel:
        config = AmclConfig(robot_model_type=model)
        after = propagate(before, SE2.identity(), config, np.random.default_rng(0))
        np.testing.assert_array_equal(after.poses(), before.poses())
    config = AmclConfig(robot_model_type=MotionModel.STATIONARY)
    assert propagate(before, SE2(1.0, 2.0, 3.0), config, np.random.default_rng(0)) is before


@settings(deadline=None)
@given(increments, st.floats(0.0, 2.0), st.floats(0.0, 1.0))
def test_pieces_chained_are_the_increment(increment, far, wide):
    config = AmclConfig(update_min_d=far, update_min_a=wide)
    n, piece = pieces(increment, config)
    whole = chained(SE2.identity(), piece, n)
    assert whole.distance_to(increment) < 1e-8
    assert angle_error(whole.yaw, increment.yaw) < 1e-9
    # On an arc of half a turn the way is longer than its chord by half of pi.
    assert math.hypot(piece.x, piece.y) <= math.pi / 2 * max(0.5, 2 * far) + 1e-9
    assert abs(piece.yaw) <= max(0.4, 2 * wide) + 1e-9


def test_a_way_too_short_for_a_direction_is_as_wrong_as_turning_in_place():
    config = AmclConfig(alpha2=0.0)  # of which the few millimetres would have a share
    sideways, in_place = (
        propagate(at_origin(500), SE2(0.0, y, 0.3), config, np.random.default_rng(9))
        for y in (0.005, 0.0)
    )
    np.testing.assert_allclose(sideways.yaw, in_place.yaw, atol=1e-12)
    assert sideways.yaw.std() < 0.2  # a quarter turn and back would give 0.8


def test_increments_as_long_as_the_updates_are_not_cut():
    config = AmclConfig(update_min_d=0.25, update_min_a=0.2)
    for increment in (SE2(0.5, 0.0, 0.0), SE2(0.0, 0.3, -0.4), SE2.identity()):
        assert pieces(increment, config) == (1, increment)
    assert pieces(SE2(0.6, 0.0, 0.0), config)[0] == 2
    assert pieces(SE2(0.6, 0.0, 0.0), AmclConfig(update_min_d=0.4))[0] == 1
    assert pieces(SE2(0.0, 0.0, 3.0), config)[0] == 8
    assert pieces(SE2(1e9, 0.0, 0.0), config)[0] == 1000


def test_the_twin_of_the_kernel():
    rng = np.random.default_rng(0)
    x, y, yaw = rng.normal(0.0, 3.0, (3, 500))
    yaw = wrap(yaw)
    noise = rng.standard_normal((3, 500), np.float32)
    motion = Motion(*rng.normal(0.0, 1.0, 7).tolist())
    new_x, new_y, new_yaw = _drive(x, y, yaw, tuple(motion), noise)
    n0, n1, n2 = noise.astype(np.float64)
    ahead = np.exp(1j * (yaw + motion.direction + motion.sigma_direction * n0))
    length = motion.length + motion.sigma_length * n1
    moved = x + 1j * y + ahead * (length + 1j * motion.sigma_left * n0)
    np.testing.assert_allclose(new_x + 1j * new_y, moved)
    turn = motion.turn + motion.sigma_direction * n0 + motion.sigma_turn * n2
    assert angle_error(new_yaw, yaw + turn).max() < 1e-12


def turned_by(yaw, turn):
    zero, still = np.zeros(len(yaw)), np.zeros((3, len(yaw)), np.float32)
    return _drive(zero, zero, yaw, (0.0, 0.0, turn, 0.0, 0.0, 0.0, 0.0), still)[2]


@settings(deadline=None)
@given(
    st.lists(st.floats(-math.pi, math.pi), min_size=1),
    st.floats(-math.pi, math.pi) | st.floats(-30.0, 30.0),
)
def test_headings_stay_within_half_a_turn(headings, turn):
    yaw = turned_by(np.array(headings), turn)
    assert ((yaw > -math.pi) & (yaw <= math.pi)).all()


def test_at_the_seam_a_heading_stays_within_half_a_turn():
    seam = np.array([-math.pi, np.nextafter(-math.pi, 0.0), np.nextafter(-math.pi, -4.0)])
    for turn in (*seam, *-seam, *(3 * seam), *(-3 * seam), 0.0):
        yaw = turned_by(np.array([0.0, math.pi, *seam[1:2]]), float(turn))
        assert ((yaw > -math.pi) & (yaw <= math.pi)).all()


# Forwards, turning on the spot, an arc to the right: short enough to be driven in one piece.
SHORT = [SE2(0.4, 0.0, 0.0), SE2(0.0, 0.0, 0.35), SE2(0.3, -0.1, -0.3)]
N = 100_000  # the standard deviation of a standard deviation is 0.22 %


def table_5_6(increment: SE2, config: AmclConfig) -> tuple[float, float, float]:
    """Standard deviations of turn, way and turn of a robot that drives forwards."""
    trans = math.hypot(increment.x, increment.y)
    rot1 = math.atan2(increment.y, increment.x)
    rot2 = increment.yaw - rot1
    a1, a2, a3, a4 = config.alpha1, config.alpha2, config.alpha3, config.alpha4
    return (
        math.sqrt(a1 * rot1**2 + a2 * trans**2),
        math.sqrt(a3 * trans**2 + a4 * rot1**2 + a4 * rot2**2),
        math.sqrt(a1 * rot2**2 + a2 * trans**2),
    )


@pytest.mark.parametrize("increment", SHORT, ids=str)
@pytest.mark.parametrize("alpha", ["alpha1", "alpha2", "alpha3", "alpha4", "alpha5"])
def test_errors_of_a_differential_drive_are_those_of_table_5_6(increment, alpha):
    config = AmclConfig(**(SILENT | {alpha: 0.01}))
    after = propagate(at_origin(N), increment, config, np.random.default_rng(1))
    sigma1, sigma_trans, sigma2 = table_5_6(increment, config)
    turned = wrap(after.yaw - increment.yaw)
    assert turned.std() == pytest.approx(math.hypot(sigma1, sigma2), rel=0.01, abs=1e-12)
    direction = math.atan2(increment.y, increment.x)
    trans = math.hypot(increment.x, increment.y)
    # Way and direction, signed: noise may be larger than the way.
    along = after.x * math.cos(direction) + after.y * math.sin(direction)
    across = after.y * math.cos(direction) - after.x * math.sin(direction)
    if trans == 0.0:
        assert along.std() == pytest.approx(sigma_trans, rel=0.01, abs=1e-12)
    else:
        way, bearing = np.hypot(along, across), np.arctan2(across, along)
        assert way.std() == pytest.approx(sigma_trans, rel=0.01, abs=1e-12)
        assert bearing.std() == pytest.approx(sigma1, rel=0.01, abs=1e-12)
        assert way.mean() == pytest.approx(trans, abs=5 * sigma_trans / math.sqrt(N) + 1e-12)
    assert turned.mean() == pytest.approx(
        0.0, abs=5 * math.hypot(sigma1, sigma2) / math.sqrt(N) + 1e-12
    )


@pytest.mark.parametrize("increment", [*SHORT, SE2(0.0, 0.3, 0.0), SE2(-0.2, -0.2, 0.2)], ids=str)
@pytest.mark.parametrize("alpha", ["alpha1", "alpha2", "alpha3", "alpha4", "alpha5"])
def test_errors_of_an_omnidirectional_drive_are_those_of_nav2(increment, alpha):
    config = AmclConfig(
        robot_model_type=MotionModel.OMNIDIRECTIONAL, **(SILENT | {alpha: 0.01, "alpha3": 0.004})
    )
    after = propagate(at_origin(N), increment, config, np.random.default_rng(2))
    trans2 = increment.x**2 + increment.y**2
    rot2 = increment.yaw**2
    direction = math.atan2(increment.y, increment.x)
    x, y = after.x - increment.x, after.y - increment.y
    along = x * math.cos(direction) + y * math.sin(direction)
    across = y * math.cos(direction) - x * math.sin(direction)
    turned = wrap(after.yaw - increment.yaw)
    for noise, variance in (
        (along, config.alpha3 * trans2 + config.alpha1 * rot2),
        (across, config.alpha1 * rot2 + config.alpha5 * trans2),
        (turned, config.alpha4 * rot2 + config.alpha2 * trans2),
    ):
        assert noise.std() == pytest.approx(math.sqrt(variance), rel=0.01, abs=1e-9)
        assert abs(noise.mean()) < 5 * math.sqrt(variance / N) + 1e-9


def test_errors_of_different_particles_and_kinds_are_independent():
    increment = SE2(0.4, 0.0, 0.0)
    config = AmclConfig(robot_model_type=MotionModel.OMNIDIRECTIONAL)
    noise = off(propagate(at_origin(N), increment, config, np.random.default_rng(3)), increment)
    noise[:, 2] = wrap(propagate(at_origin(N), increment, config, np.random.default_rng(3)).yaw)
    assert np.abs(np.corrcoef(noise.T) - np.eye(3)).max() < 0.02
    assert len(np.unique(noise[:, 0])) > 0.99 * N


def test_backwards_is_forwards_seen_in_a_mirror():
    """The noise follows the smaller angle: backwards is no half turn, way and half turn."""
    for increment in (SE2(0.4, 0.0, 0.0), SE2(0.3, -0.05, -0.2)):
        back = SE2(-increment.x, -increment.y, increment.yaw)
        there = propagate(at_origin(200), increment, AmclConfig(), np.random.default_rng(4))
        other = propagate(at_origin(200), back, AmclConfig(), np.random.default_rng(4))
        np.testing.assert_allclose(other.x, -there.x, atol=1e-12)
        np.testing.assert_allclose(other.y, -there.y, atol=1e-12)
        assert angle_error(other.yaw, there.yaw).max() < 1e-12


@pytest.mark.parametrize("model", WHEELED)
def test_moving_all_particles_before_or_after_is_the_same(model):
    move, increment = SE2(-30.0, 12.0, 2.2), SE2(1.2, 0.3, 0.9)
    config = AmclConfig(robot_model_type=model)
    here = somewhere(100)
    points = move.apply(here.poses()[:, :2])
    there = equal_weights(np.column_stack([points, here.yaw + move.yaw]))
    here = propagate(here, increment, config, np.random.default_rng(5))
    there = propagate(there, increment, config, np.random.default_rng(5))
    np.testing.assert_allclose(there.poses()[:, :2], move.apply(here.poses()[:, :2]), atol=1e-9)
    assert angle_error(there.yaw, here.yaw + move.yaw).max() < 1e-9


@pytest.mark.parametrize("model", WHEELED)
@pytest.mark.parametrize(
    ("times", "short"), [(8, SE2(0.5, 0.0, 0.0)), (6, SE2(0.1, 0.0, 0.4)), (4, SE2(0.5, 0.0, 0.2))]
)
def test_a_long_way_is_as_wrong_at_once_as_bit_by_bit(model, times, short):
    """Uncut, its standard deviation would be about the root of `times` as large."""
    config = AmclConfig(
        robot_model_type=model, alpha1=0.02, alpha2=0.02, alpha3=0.02, alpha4=0.02, alpha5=0.02
    )
    rng = np.random.default_rng(6)
    whole = chained(SE2.identity(), short, times)
    at_once = propagate(at_origin(N), whole, config, rng)
    bit_by_bit = at_origin(N)
    for _ in range(times):
        bit_by_bit = propagate(bit_by_bit, short, config, rng)
    one, other = (np.cov(off(p, whole).T) for p in (at_once, bit_by_bit))
    sigmas = np.sqrt(np.diag(other))
    np.testing.assert_allclose(np.sqrt(np.diag(one)), sigmas, rtol=0.02)
    np.testing.assert_allclose(one, other, atol=0.03 * np.outer(sigmas, sigmas).max())


def test_one_seed_is_one_result():
    for model in WHEELED:
        config = AmclConfig(robot_model_type=model)
        a, b, c = (
            propagate(somewhere(50), SE2(0.7, 0.1, 0.5), config, np.random.default_rng(seed))
            for seed in (7, 7, 8)
        )
        np.testing.assert_array_equal(a.poses(), b.poses())
        assert (a.poses() != c.poses()).all()
