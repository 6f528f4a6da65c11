"""Priors: what is known of the robot's place before any scan, as log-likelihoods of poses.

A prior is a pure function of pose. Priors add up, and evidence can overrule them: outside, each
costs `FLOOR` and no more. The mass of places that are not listed is not touched, so that a wrong
prior cannot make a bad place look good.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firstfix.core.arguments import as_pose
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.global_localization.prior import Prior

FLOOR = math.log(1e-3)
"""Log-likelihood far outside a prior: a thousand to one."""


@dataclass(frozen=True, slots=True)
class Near:
    """Near a pose: 0 within the radius, then falling as a Gaussian does, down to the floor.

    Parameters
    ----------
    pose : SE2
        ``T_map_base``. A tuple (x, y, yaw) in metres and radians is accepted.
    radius : float
        Distance that is as likely as none, m, above 0.
    angle : float
        Heading error that is as likely as none, rad; the default leaves the heading open.

    Raises
    ------
    InputError
        If the radius or the angle is not above 0.

    Examples
    --------
    >>> result = ff.ScanMatcher(grid).locate(scan, prior=ff.Near((2.0, 1.5, 0.0), radius=1.0))
    >>> result.verdict, result.probability_without_prior > 0.95
    (<Verdict.UNIQUE: 'UNIQUE'>, True)
    """

    pose: SE2
    radius: float
    angle: float = math.pi

    def __post_init__(self) -> None:
        if not (0.0 < self.radius < math.inf and self.angle > 0.0):
            raise InputError(
                expected="a prior near a pose with a radius and an angle above 0",
                received=f"radius {self.radius} m, angle {self.angle} rad",
                remedy="give the distance by which the pose may be wrong, such as 1 m",
            )
        object.__setattr__(self, "pose", as_pose(self.pose, "pose"))

    def log_likelihood(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return log-likelihoods of poses in the map frame, shape (n,)."""
        away = np.hypot(poses[:, 0] - self.pose.x, poses[:, 1] - self.pose.y)
        turned = np.abs(np.remainder(poses[:, 2] - self.pose.yaw + math.pi, 2 * math.pi) - math.pi)
        return _falling(np.maximum(away / self.radius, turned / self.angle))

    def check(self, grid: OccupancyGrid) -> None:
        """Raise InputError if the pose is not on the map, or no free cell is within the radius."""
        column, row = grid.to_cells(np.array([self.pose.x, self.pose.y])).tolist()
        where = f"a pose at ({self.pose.x:.2f}, {self.pose.y:.2f})"
        if not (0 <= column < grid.width and 0 <= row < grid.height):
            raise InputError(
                expected="a prior on the map",
                received=f"{where}, which is outside",
                remedy="give the pose in the map frame, in metres",
            )
        reach = self.radius / grid.resolution
        rows = slice(max(0, int(row - reach)), int(row + reach) + 2)
        columns = slice(max(0, int(column - reach)), int(column + reach) + 2)
        y, x = np.nonzero(grid.seen_free[rows, columns])
        off = np.hypot(y + rows.start + 0.5 - row, x + columns.start + 0.5 - column)
        if not (off <= reach + 1.0).any():
            raise InputError(
                expected=f"free space within {self.radius} m of a prior",
                received=f"{where} with none around it",
                remedy="move the pose to where a robot can be, or enlarge the radius",
            )


# A measured pose is not better than the map, m and rad.
_LEAST_SIGMA = np.array([0.15, 0.15, math.radians(5.0)])


@dataclass(frozen=True, eq=False, slots=True)
class Gaussian:
    """A pose with a covariance, such as a fiducial gives, down to the floor.

    Parameters
    ----------
    pose : SE2
        ``T_map_base``. A tuple (x, y, yaw) in metres and radians is accepted.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame. Standard deviations of less than 0.15 m and 5°
        are enlarged to that: a map is not more precise.

    Raises
    ------
    InputError
        If this is no covariance.

    Examples
    --------
    >>> seen = ff.Gaussian((2.0, 1.5, 0.0), np.diag([0.04, 0.04, 0.03]))
    >>> seen.log_likelihood(np.array([[2.0, 1.5, 0.0], [2.4, 1.5, 0.0], [9.0, 1.5, 0.0]])).round(1)
    array([-0. , -2. , -6.9])
    """

    pose: SE2
    covariance: NDArray[np.float64]
    _information: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        covariance = np.array(self.covariance, np.float64)
        is_good = covariance.shape == (3, 3) and bool(np.isfinite(covariance).all())
        if not is_good or np.linalg.eigvalsh(covariance + covariance.T).min() < -1e-9:
            raise InputError(
                "The covariance of a pose is a matrix of shape (3, 3) of x, y (m), yaw (rad), "
                "finite and without negative variances. Check where the pose comes from."
            )
        missing = np.maximum(0.0, _LEAST_SIGMA**2 - np.diagonal(covariance))
        covariance = 0.5 * (covariance + covariance.T) + np.diag(missing)
        covariance.flags.writeable = False
        object.__setattr__(self, "pose", as_pose(self.pose, "pose"))
        object.__setattr__(self, "covariance", covariance)
        object.__setattr__(self, "_information", np.linalg.inv(covariance))

    def log_likelihood(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return log-likelihoods of poses in the map frame, shape (n,)."""
        off = poses - self.pose.as_array()
        off[:, 2] = np.remainder(off[:, 2] + math.pi, 2.0 * math.pi) - math.pi
        logs = -0.5 * np.einsum("ij,jk,ik->i", off, self._information, off)
        floored: NDArray[np.float64] = np.maximum(FLOOR, logs)
        return floored

    def check(self, grid: OccupancyGrid) -> None:
        """Raise InputError if the pose is not on the map, or no free cell is within three sigma."""
        sigma = math.sqrt(float(self.covariance.diagonal()[:2].max()))
        Near(self.pose, max(1.0, 3.0 * sigma)).check(grid)


@dataclass(frozen=True, eq=False, slots=True)
class Region:
    """Inside a polygon: 0 inside, falling within half a metre outside, down to the floor.

    Parameters
    ----------
    polygon : sequence of (x, y)
        Corners in the map frame, m, in order; at least three. The last is joined to the first.

    Raises
    ------
    InputError
        If these are not three or more finite corners around an area.

    Examples
    --------
    >>> hall = ff.Region([(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)])
    >>> ff.ScanMatcher(grid).locate(scan, prior=hall).verdict
    <Verdict.UNIQUE: 'UNIQUE'>
    """

    polygon: Sequence[tuple[float, float]]
    _corners: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        try:
            corners = np.array(self.polygon, np.float64)
        except (TypeError, ValueError):
            corners = np.empty(0)
        if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
            received = f"{self.polygon!r:.60}"
        elif not np.isfinite(corners).all():
            received = "NaN or infinity among them"
        elif abs(_area(corners)) < 1e-9:
            received = "all on one line"
        else:
            corners.flags.writeable = False
            object.__setattr__(self, "_corners", corners)
            return
        raise InputError(
            expected="a region with at least three corners (x, y) around an area",
            received=received,
            remedy="list the corners in order, in metres in the map frame",
        )

    def log_likelihood(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return log-likelihoods of poses in the map frame, shape (n,)."""
        points = poses[:, :2]
        outside = ~_inside(points, self._corners)
        away = np.where(outside, _distance(points, self._corners), 0.0)
        return _falling(1.0 + away / _EDGE_M)

    def check(self, grid: OccupancyGrid) -> None:
        """Raise InputError if no free cell of the map is inside."""
        rows, columns = np.nonzero(grid.seen_free)
        centres = grid.to_map(np.column_stack([columns, rows]).astype(np.float64) + 0.5)
        if not _inside(centres, self._corners).any():
            raise InputError(
                expected="a region with free space of the map inside",
                received="one without",
                remedy="check its corners: metres, in the map frame",
            )


@dataclass(frozen=True, slots=True)
class All:
    """Several priors at once: their log-likelihoods are added.

    Parameters
    ----------
    priors : tuple of Prior
        In any order.

    Examples
    --------
    >>> both = ff.All((ff.Near((2.0, 1.5, 0.0), 3.0), ff.Near((3.0, 1.5, 0.0), 3.0)))
    >>> both.log_likelihood(np.array([[2.5, 1.5, 0.0]]))
    array([0.])
    """

    priors: tuple[Prior, ...]

    def log_likelihood(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return log-likelihoods of poses in the map frame, shape (n,)."""
        logs = np.zeros(len(poses))
        for prior in self.priors:
            logs += prior.log_likelihood(poses)
        return logs

    def check(self, grid: OccupancyGrid) -> None:
        """Raise InputError if one of them does not fit the map."""
        for prior in self.priors:
            prior.check(grid)


@dataclass(frozen=True, slots=True)
class AnyOf:
    """One of several priors holds, such as one of the docks of a robot.

    Parameters
    ----------
    priors : tuple of Prior
        At least one.
    weights : tuple of float, optional
        How likely each is against the others, above 0; by default all are equally likely.

    Raises
    ------
    InputError
        If there is no prior, or not one weight above 0 for each.

    Examples
    --------
    >>> docks = ff.AnyOf((ff.Near((2.0, 1.5, 0.0), 1.0), ff.Near((9.0, 1.5, 0.0), 1.0)))
    >>> docks.log_likelihood(np.array([[2.0, 1.5, 0.0], [9.0, 1.5, 0.0], [5.0, 1.5, 0.0]])).round(1)
    array([ 0. ,  0. , -6.9])
    """

    priors: tuple[Prior, ...]
    weights: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        weights = self.weights or (1.0,) * len(self.priors)
        good = all(0.0 < weight < math.inf for weight in weights)
        if not self.priors or len(weights) != len(self.priors) or not good:
            raise InputError(
                f"{len(self.priors)} priors with the weights {weights} cannot be used. Give at "
                "least one prior, and one weight above 0 for each."
            )
        object.__setattr__(self, "weights", weights)

    def log_likelihood(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return log-likelihoods of poses in the map frame, shape (n,): those of the best prior."""
        most = max(self.weights)
        logs = [
            prior.log_likelihood(poses) + math.log(weight / most)
            for prior, weight in zip(self.priors, self.weights, strict=True)
        ]
        best: NDArray[np.float64] = np.maximum(FLOOR, np.max(logs, axis=0))
        return best

    def check(self, grid: OccupancyGrid) -> None:
        """Raise InputError if one of them does not fit the map."""
        for prior in self.priors:
            prior.check(grid)


# The edge of a drawn region is meant to about this, m.
_EDGE_M = 0.25


def _falling(ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return 0 up to a ratio of 1, then a Gaussian's fall with that width, down to the floor."""
    log: NDArray[np.float64] = np.maximum(FLOOR, -2.0 * np.maximum(0.0, ratio - 1.0) ** 2)
    return log


def _area(corners: NDArray[np.float64]) -> float:
    x, y = corners.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _inside(points: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Count how often a ray to the right crosses the edges: an odd number means inside."""
    inside = np.zeros(len(points), np.bool_)
    x, y = points.T
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if ay != by:
            crosses = (ay > y) != (by > y)
            inside ^= crosses & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return inside


def _distance(points: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance to the nearest edge, shape (n,), m."""
    nearest = np.full(len(points), np.inf)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = b - a
        length2 = max(float(edge @ edge), 1e-12)
        along = np.clip((points - a) @ edge / length2, 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(points - a - along[:, None] * edge).T))
    return nearest
