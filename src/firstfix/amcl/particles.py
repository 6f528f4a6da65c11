"""The belief: weighted poses, one array for each coordinate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import wrap


@dataclass(frozen=True, eq=False, slots=True)
class Particles:
    """Poses ``T_map_base`` with weights that sum to one.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Positions in the map frame, m. Made read-only.
    yaw : ndarray, shape (n,)
        Headings, rad, in (-π, π]. Made read-only.
    weight : ndarray, shape (n,)
        Probabilities. Made read-only.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    yaw: NDArray[np.float64]
    weight: NDArray[np.float64]

    def __post_init__(self) -> None:
        for array in (self.x, self.y, self.yaw, self.weight):
            array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.x)

    @property
    def effective(self) -> float:
        """Effective sample size, 1 to n (Kong, Liu & Wong 1994)."""
        return float(1.0 / np.square(self.weight).sum())

    def poses(self) -> NDArray[np.float64]:
        """Return x (m), y (m), yaw (rad) of all particles, shape (n, 3)."""
        return np.column_stack([self.x, self.y, self.yaw])

    def reweighed(self, likelihood: NDArray[np.float64]) -> Particles:
        """Return the same poses, each weight multiplied by a likelihood, normalised (Bayes' rule).

        Parameters
        ----------
        likelihood : ndarray, shape (n,)
            Not negative; up to a factor.

        Returns
        -------
        Particles
            The belief after the evidence; unchanged if it excludes every particle.
        """
        weight = self.weight * likelihood
        total = weight.sum()
        if not total > 0.0:
            return self
        return Particles(self.x, self.y, self.yaw, weight / total)

    def drawn(self, index: NDArray[np.int64]) -> Particles:
        """Return copies of some particles, all of the same weight.

        Parameters
        ----------
        index : ndarray of int64, shape (m,)
            Which, in the order of the result.

        Returns
        -------
        Particles
            m particles.
        """
        m = len(index)
        return Particles(self.x[index], self.y[index], self.yaw[index], np.full(m, 1.0 / m))


def equal_weights(poses: NDArray[np.float64]) -> Particles:
    """Make particles of the same weight.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x (m), y (m), yaw (rad) in the map frame.

    Returns
    -------
    Particles
        n particles in the order of the poses.
    """
    n = len(poses)
    return Particles(poses[:, 0].copy(), poses[:, 1].copy(), wrap(poses[:, 2]), np.full(n, 1.0 / n))
