"""What is known of the robot's place before the scan, in the answer to one scan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.global_localization.frames import bases_in_map
from firstfix.global_localization.verdict import with_prior
from firstfix.global_localization.verify import Verification

# With a prior the search lists more places, so that some are near it.
DEEPER = 20
# A prior may be wrong, and then a place that looks like the true one lies near it. It is followed
# only to a place that the scans alone find twice as likely as all others together; to one that a
# single scan of a sensor with a small view finds almost certain, because such scans err.
SHARE_WITHOUT_PRIOR = 2.0 / 3.0
SHARE_OF_SMALL_VIEW = 0.98

# Log-likelihood down to which a place is near a prior.
NEAR_LOG = -1.0


class Prior(Protocol):
    """A log-likelihood over poses."""

    def log_likelihood(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return log-likelihoods, shape (n,), at most 0 where all is as good as can be.

        Parameters
        ----------
        poses : ndarray, shape (n, 3)
            x (m), y (m), yaw (rad) of the base in the map frame.
        """

    def check(self, grid: OccupancyGrid) -> None:
        """Raise InputError if no robot of this map can be there."""


def check_prior(prior: Prior, grid: OccupancyGrid) -> None:
    """Refuse what is no prior, or one in which no robot of this map can be.

    Raises
    ------
    InputError
        If it is either.
    """
    if not callable(getattr(prior, "log_likelihood", None)):
        raise InputError(
            f"{prior!r:.60} is no prior. Pass ff.Near(pose, radius), ff.Region(polygon), or one of "
            "your own with log_likelihood and check."
        )
    prior.check(grid)


@dataclass(frozen=True, eq=False, slots=True)
class PlacePrior:
    """A prior for poses of a sensor in the grid.

    Parameters
    ----------
    prior : Prior or None
        Of the pose of the base in the map; None if nothing is known.
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        Of the sensor; has its pose on the robot.
    exponent : float
        Of the law of costs for the scan.
    """

    prior: Prior | None
    grid: OccupancyGrid
    scan: LaserScan
    exponent: float

    def depth(self, shortlist: int) -> int:
        """Return how many places the search should list."""
        return shortlist if self.prior is None else DEEPER * shortlist

    def chosen(self, poses: NDArray[np.float64], shortlist: int) -> NDArray[np.float64]:
        """Keep the first poses, shape (n, 3), and as many of the others that are near the prior.

        The best one near the prior competes with all that the search ranks above it, and with as
        many below: places that look like it are there. Else it would win by their absence.
        """
        if self.prior is None:
            return poses
        near = np.flatnonzero(self._logs(poses) >= NEAR_LOG)
        best = int(near[0]) + shortlist if len(near) else shortlist
        first = np.arange(min(max(shortlist, best), len(poses)))
        kept: NDArray[np.float64] = poses[np.unique(np.concatenate([first, near[:shortlist]]))]
        return kept

    def rankings(self, verification: Verification) -> list[NDArray[np.float64]]:
        """Return the costs, each of shape (n,), by scan and prior, and by the scan alone.

        Both keep their best places, so that a wrong prior is noticed; without a prior they are one.
        """
        scores = verification.scores
        if self.prior is None:
            return [scores]
        return [with_prior(scores, self._logs(verification.poses), self.exponent), scores]

    def speaks_for(self, pose: NDArray[np.float64]) -> bool:
        """Return whether there is a prior, and a pose of shape (3,) is near it."""
        return self.prior is not None and float(self._logs(pose[None])[0]) >= NEAR_LOG

    def _logs(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        assert self.prior is not None  # noqa: S101 - by the callers
        return self.prior.log_likelihood(bases_in_map(self.grid, self.scan, poses))
