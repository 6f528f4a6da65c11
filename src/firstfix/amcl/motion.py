"""Motion models: odometry with noise.

Thrun, Burgard & Fox, "Probabilistic Robotics" (2005), table 5.6, and its extension to robots that
move sideways, with alpha1 to alpha5 as ROS has always read them: times a *squared* motion they give
a variance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig, MotionModel
from firstfix.amcl.particles import Particles
from firstfix.core.angles import angle_error, wrap
from firstfix.core.se2 import SE2
from firstfix.fields.kernel_cache import kernel

# Below this the direction of a translation is noise: its errors are those of a robot turning in
# place (as in ROS).
_NO_TRANSLATION_M = 0.01

# The alphas are tuned on increments of about update_min_d and update_min_a. One long increment,
# where scans are rare, would get many times the noise of the same way in several (the standard
# deviation grows with the length, not with its root), so longer ones are driven in pieces.
_PIECE_M = 0.5
_PIECE_RAD = 0.4
_MAX_PIECES = 1000


class Motion(NamedTuple):
    """A motion and the standard deviations of its errors, the same for all particles.

    An error in the first direction stays in the heading; what goes to the left is error only.
    """

    direction: float  # of travel against the heading before, rad
    length: float  # m
    turn: float  # of the heading, rad
    sigma_direction: float
    sigma_length: float
    sigma_left: float
    sigma_turn: float


def propagate(
    particles: Particles, T_before_after: SE2, config: AmclConfig, rng: np.random.Generator
) -> Particles:
    """Move every particle by the odometry, each with its own noise.

    Parameters
    ----------
    particles : Particles
        The belief before the motion.
    T_before_after : SE2
        The increment: pose of the base after the motion in the base frame before it.
    config : AmclConfig
        Motion model and its alphas.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    Particles
        The belief after it, with the weights of before.
    """
    if config.robot_model_type is MotionModel.STATIONARY:
        return particles
    count, T_piece = pieces(T_before_after, config)
    if config.robot_model_type is MotionModel.OMNIDIRECTIONAL:
        motion = _omnidirectional(T_piece, config)
    else:
        motion = _differential(T_piece, config)
    x, y, yaw = particles.x, particles.y, particles.yaw
    for _ in range(count):
        noise = rng.standard_normal((3, len(particles)), np.float32)
        x, y, yaw = _drive(x, y, yaw, tuple(motion), noise)
    return Particles(x, y, yaw, particles.weight)


def pieces(T_before_after: SE2, config: AmclConfig) -> tuple[int, SE2]:
    """Cut an increment into equal parts of an arc, none much longer than the alphas are meant for.

    Parameters
    ----------
    T_before_after : SE2
        The increment.
    config : AmclConfig
        update_min_d and update_min_a.

    Returns
    -------
    tuple of int and SE2
        Number of parts n, and the part: chained n times it is the increment.
    """
    length = math.hypot(T_before_after.x, T_before_after.y)
    turn = T_before_after.yaw
    longest = max(_PIECE_M, 2.0 * config.update_min_d)
    widest = max(_PIECE_RAD, 2.0 * config.update_min_a)
    n = min(_MAX_PIECES, math.ceil(max(length / longest, abs(turn) / widest)))
    if n <= 1:
        return 1, T_before_after
    # A circular arc: its chord spans the direction of travel, half the turn further.
    direction = math.atan2(T_before_after.y, T_before_after.x) - turn / 2.0
    shorter = 1.0 / n if abs(turn) < 1e-9 else math.sin(turn / 2 / n) / math.sin(turn / 2)
    chord, along = length * shorter, direction + turn / 2.0 / n
    return n, SE2(chord * math.cos(along), chord * math.sin(along), turn / n)


def _differential(T_before_after: SE2, config: AmclConfig) -> Motion:
    """Turn, drive, turn; each with noise (table 5.6)."""
    trans = math.hypot(T_before_after.x, T_before_after.y)
    rot1 = math.atan2(T_before_after.y, T_before_after.x)
    rot2 = wrap(T_before_after.yaw - rot1)
    turns = (rot1, rot2) if trans >= _NO_TRANSLATION_M else (0.0, T_before_after.yaw)
    # Driving backwards is not a half turn and back: the noise follows the smaller angle.
    turn1, turn2 = (min(angle_error(r, 0.0), angle_error(r, math.pi)) for r in turns)
    return Motion(
        direction=rot1,
        length=trans,
        turn=T_before_after.yaw,
        sigma_direction=math.sqrt(config.alpha1 * turn1**2 + config.alpha2 * trans**2),
        sigma_length=math.sqrt(config.alpha3 * trans**2 + config.alpha4 * (turn1**2 + turn2**2)),
        sigma_left=0.0,
        sigma_turn=math.sqrt(config.alpha1 * turn2**2 + config.alpha2 * trans**2),
    )


def _omnidirectional(T_before_after: SE2, config: AmclConfig) -> Motion:
    """Drive in any direction while turning; noise along, across and in turn."""
    trans = math.hypot(T_before_after.x, T_before_after.y)
    turn = T_before_after.yaw
    return Motion(
        direction=math.atan2(T_before_after.y, T_before_after.x),
        length=trans,
        turn=turn,
        sigma_direction=0.0,
        sigma_length=math.sqrt(config.alpha3 * trans**2 + config.alpha1 * turn**2),
        sigma_left=math.sqrt(config.alpha1 * turn**2 + config.alpha5 * trans**2),
        sigma_turn=math.sqrt(config.alpha4 * turn**2 + config.alpha2 * trans**2),
    )


@kernel
def _drive(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    yaw: NDArray[np.float64],
    motion: tuple[float, ...],
    noise: NDArray[np.float32],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    direction, length, turn, sigma_direction, sigma_length, sigma_left, sigma_turn = motion
    n = x.shape[0]
    new_x, new_y, new_yaw = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        astray = sigma_direction * np.float64(noise[0, i])
        ahead = length + sigma_length * np.float64(noise[1, i])
        # No model has noise both in direction and to the left: they share a draw.
        left = sigma_left * np.float64(noise[0, i])
        along = yaw[i] + direction + astray
        c, s = math.cos(along), math.sin(along)
        new_x[i] = x[i] + c * ahead - s * left
        new_y[i] = y[i] + s * ahead + c * left
        turned = yaw[i] + turn + astray + sigma_turn * np.float64(noise[2, i])
        wrapped = turned - 2.0 * math.pi * math.ceil(turned / (2.0 * math.pi) - 0.5)
        # Rounding may leave it beyond either end by a last bit.
        new_yaw[i] = wrapped if -math.pi < wrapped <= math.pi else math.pi
    return new_x, new_y, new_yaw
