"""Initial beliefs: around a pose, around several places, or over free space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.particles import Particles, equal_weights
from firstfix.core.errors import InputError
from firstfix.core.estimate import Hypothesis
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2


def around_pose(
    T_map_base: SE2, covariance: NDArray[np.float64], n: int, rng: np.random.Generator
) -> Particles:
    """Draw particles around a known pose.

    Parameters
    ----------
    T_map_base : SE2
        The pose.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame.
    n : int
        Number of particles.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    Particles
        n particles.

    Raises
    ------
    InputError
        If the covariance is none.
    """
    return equal_weights(_normal_poses(T_map_base, covariance, n, rng))


def around_hypotheses(
    hypotheses: Sequence[Hypothesis], n: int, rng: np.random.Generator
) -> Particles:
    """Draw particles around several places, in proportion to their probabilities.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        At least one, for example of an AMBIGUOUS verdict.
    n : int
        Number of particles.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    Particles
        n particles; a place gets the whole number below or above its share.

    Raises
    ------
    InputError
        If there is no hypothesis of positive probability.
    """
    return equal_weights(hypothesis_poses(hypotheses, n, rng))


def hypothesis_poses(
    hypotheses: Sequence[Hypothesis], n: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Draw poses around several places; x (m), y (m), yaw (rad), shape (n, 3), as above."""
    probability = np.array([hypothesis.probability for hypothesis in hypotheses])
    if not probability.sum() > 0.0:
        raise InputError(
            expected="at least one hypothesis of positive probability",
            received=f"{len(hypotheses)} hypotheses, probabilities {probability.tolist()}",
            remedy="start from a pose or from free space instead",
        )
    # Rounding the cumulative sum spends exactly n and keeps every place within one of its share.
    edges = np.rint(np.append(0.0, np.cumsum(probability) / probability.sum()) * n)
    counts = np.diff(edges).astype(np.int64).tolist()
    return np.concatenate(
        [
            _normal_poses(place.pose, place.covariance, count, rng)
            for place, count in zip(hypotheses, counts, strict=True)
        ]
    )


def over_free_space(grid: OccupancyGrid, n: int, rng: np.random.Generator) -> Particles:
    """Draw particles over all of the map where a robot can be, in any direction.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    n : int
        Number of particles.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    Particles
        n particles.

    Raises
    ------
    InputError
        If the map has no free cell.
    """
    return equal_weights(free_poses(grid, n, rng))


def free_poses(grid: OccupancyGrid, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw poses over free space; return x (m), y (m), yaw (rad), shape (n, 3), as above."""
    free = np.flatnonzero(grid.seen_free)
    if free.size == 0:
        raise InputError(
            expected="a map with free space",
            received="a map without a free cell",
            remedy="check the thresholds of the map with `firstfix map check`",
        )
    row, column = np.divmod(free[rng.integers(0, free.size, n)], grid.width)
    cells = np.column_stack([column, row]) + rng.random((n, 2))
    return np.column_stack([grid.to_map(cells), rng.uniform(-np.pi, np.pi, n)])


def _normal_poses(
    pose: SE2, covariance: NDArray[np.float64], n: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    covariance = np.asarray(covariance, np.float64)
    symmetric = (
        covariance.shape == (3, 3)
        and bool(np.isfinite(covariance).all())
        and np.allclose(covariance, covariance.T)
    )
    if not symmetric or np.linalg.eigvalsh(covariance).min() < -1e-9:
        raise InputError(
            expected="a symmetric covariance of x, y, yaw without negative eigenvalue",
            received=f"{covariance.tolist()}",
            remedy="half a metre and 15 degrees would be diag(0.25, 0.25, 0.07)",
        )
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    drawn: NDArray[np.float64] = pose.as_array() + rng.standard_normal((n, 3)) @ root.T
    return drawn
