"""Number of particles by KLD-sampling (Fox 2003)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.bins import (
    EMPTY,
    FIRST_ENTRIES,
    bin_of,
    key_of,
    new_table,
    slot_of,
    with_room,
)
from firstfix.amcl.config import AmclConfig
from firstfix.amcl.particles import Particles
from firstfix.amcl.resampling import systematic
from firstfix.fields.kernel_cache import kernel


def sample_size(bins: int, config: AmclConfig) -> int:
    """Return the number of particles for a belief that fills this many bins.

    With this number, the Kullback-Leibler distance to the true belief stays below ``pf_err`` with
    the probability whose standard normal quantile is ``pf_z`` (Fox 2003, eq. 7; the Wilson-Hilferty
    approximation).

    Parameters
    ----------
    bins : int
        Bins of 0.5 m x 0.5 m x 10 degrees with at least one particle.
    config : AmclConfig
        pf_err, pf_z, min_particles, max_particles.

    Returns
    -------
    int
        min_particles to max_particles.
    """
    needed = _needed(bins, config.pf_err, config.pf_z)
    return min(max(math.ceil(needed), config.min_particles), config.max_particles)


def adapted_size(particles: Particles, config: AmclConfig, rng: np.random.Generator) -> int:
    """Return how many draws from a belief are enough for the bins that they fill.

    Parameters
    ----------
    particles : Particles
        The belief.
    config : AmclConfig
        pf_err, pf_z, min_particles, max_particles.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    int
        min_particles to max_particles.
    """
    least, most = config.min_particles, config.max_particles
    if least == most:
        return most
    drawn = rng.permutation(systematic(particles.weight, most, rng))
    return _draws_until_enough(
        particles.x, particles.y, particles.yaw, drawn, least, config.pf_err, config.pf_z
    )


@kernel
def _needed(bins: int, pf_err: float, pf_z: float) -> float:
    if bins <= 1:
        return 1.0
    freedom = bins - 1
    a = 2.0 / (9.0 * freedom)
    root = 1.0 - a + math.sqrt(a) * pf_z
    return float(freedom / (2.0 * pf_err) * root * root * root)


@kernel
def _draws_until_enough(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    yaw: NDArray[np.float64],
    drawn: NDArray[np.int64],
    least: int,
    pf_err: float,
    pf_z: float,
) -> int:
    table = new_table(FIRST_ENTRIES)
    bins, needed = 0, 1.0
    for k in range(drawn.shape[0]):
        i = drawn[k]
        key = key_of(*bin_of(x[i], y[i], yaw[i]))
        if table[slot_of(table, key), 0] == EMPTY:
            table = with_room(table, bins)
            table[slot_of(table, key), 0] = key
            bins += 1
            needed = _needed(bins, pf_err, pf_z)
        if k + 1 >= least and k + 1 >= needed:
            return k + 1
    return int(drawn.shape[0])
