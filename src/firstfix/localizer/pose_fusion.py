"""A pose estimate sharpened by a ray refinement of each scan, and carried to the next by odometry.

A particle filter keeps an error of centimetres: its likelihood is flattened on purpose, and its
particles are few. A refinement of the scan on rays has a tenth of that error where walls fix the
pose, and a large covariance along a corridor. Odometry keeps what earlier scans have fixed there.
The filter does not use the sharp pose, but decides whether it is still believed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import angle_error, wrap
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan, Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS, Beams
from firstfix.global_localization.frames import to_cells, to_map
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.refine import MAP_COVARIANCE, refine_on_rays
from firstfix.global_localization.sensors import joint_beams
from firstfix.global_localization.verify import verify

# A refinement that moves the filter's pose farther went to another wall, unless the filter's
# covariance allows for it.
_FARTHEST_M = 0.3
_FARTHEST_RAD = math.radians(10.0)
# Two estimates agree up to this: 99 % of a chi-square distribution with 3 degrees of freedom.
_AGREEING = 11.3
# The refinement and the cost do not count beams alike: it may cost a tenth more and be right.
_NO_WORSE = 1.1
# Costs that differ by less than this, nats a beam, do not tell two poses apart.
_ALIKE = 0.05

# What odometry adds to the covariance: m and rad per root of a metre, rad per root of a radian.
# Wheels that differ turn a robot by 0.03 rad a metre, and do so all the time.
_DRIFT_M = 0.03
_DRIFT_RAD = 0.1
# It is not exact at rest either: 1 mm and 0.02 degrees.
_LEAST_DRIFT = np.diag([1e-6, 1e-6, 1e-7])
# The errors of consecutive scans are alike, for the map has errors: the past counts ten scans.
_FORGETTING = 1.1


@dataclass(frozen=True, eq=False, slots=True)
class SharpPose:
    """A pose that scans have sharpened.

    Parameters
    ----------
    T_map_base : SE2
        The pose.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame, without what all scans have in common.
    T_odom_base : SE2
        Odometry at the pose.
    """

    T_map_base: SE2
    covariance: NDArray[np.float64]
    T_odom_base: SE2

    def covariance_on(self, grid: OccupancyGrid) -> NDArray[np.float64]:
        """Return the covariance with the errors of the map, which no number of scans reduces."""
        size = np.array([grid.resolution, grid.resolution, 1.0])
        total: NDArray[np.float64] = self.covariance + MAP_COVARIANCE * np.outer(size, size)
        return total

    def carried(self, T_odom_base: SE2) -> SharpPose:
        """Return where odometry (``T_odom_base`` now) puts the robot, and how surely."""
        step = self.T_odom_base.inverse() @ T_odom_base
        moved = self.T_map_base @ step
        way, turn = math.hypot(step.x, step.y), abs(step.yaw)
        turned = np.eye(3)
        turned[0, 2] = self.T_map_base.y - moved.y
        turned[1, 2] = moved.x - self.T_map_base.x
        drift = np.diag([_DRIFT_M**2 * way, _DRIFT_M**2 * way, _DRIFT_RAD**2 * (way + turn)])
        covariance = _FORGETTING * turned @ self.covariance @ turned.T + drift + _LEAST_DRIFT
        return SharpPose(moved, covariance, T_odom_base)

    def fused(self, T_map_base: SE2, noise: NDArray[np.float64]) -> SharpPose:
        """Return the fusion by covariance with a second estimate, of this covariance."""
        gain = np.linalg.solve(self.covariance + noise, self.covariance).T
        fused = self.T_map_base.as_array() + gain @ _offset(self.T_map_base, T_map_base)
        return SharpPose(SE2.from_array(fused), gain @ noise, self.T_odom_base)

    def agrees(self, T_map_base: SE2, noise: NDArray[np.float64]) -> bool:
        """Tell whether a second estimate, of this covariance, may be of the same pose."""
        offset = _offset(self.T_map_base, T_map_base)
        return bool(offset @ np.linalg.solve(self.covariance + noise, offset) < _AGREEING)


def sharpen(
    estimate: SharpPose, scans: Scans, fields: MapFields, before: SharpPose | None = None
) -> SharpPose:
    """Sharpen the estimate of a filter by a scan, and by the sharp pose at the scan before.

    Parameters
    ----------
    estimate : SharpPose
        Mean and covariance of the filter, and the odometry at the scan.
    scans : LaserScan or sequence of LaserScan
        The scan, or one of each sensor.
    fields : MapFields
        The prepared map.
    before : SharpPose, optional
        The result at the scan before. None if there is none.

    Returns
    -------
    SharpPose
        The fused pose; the one before, carried by odometry, where it fits as well as a refinement
        that contradicts it; the estimate if neither fits about as well.
    """
    scan, beams = joint_beams(as_scans(scans))
    if np.count_nonzero(beams.hit) < FEWEST_HITS:
        return hold(estimate, before)
    refine = _Refinement(scan, beams, fields)
    carried = None if before is None else before.carried(estimate.T_odom_base)
    found = []
    if carried is not None:
        found.append(refine.from_pose(carried.T_map_base, estimate.T_map_base))
        if _goes_on(estimate, carried, found[0]):
            return carried.fused(found[0].T_map_base, found[0].noise)
        if _agree(estimate, carried) and found[0].starts_best:
            return carried
    found.append(refine.from_pose(estimate.T_map_base, estimate.T_map_base))
    best = min(found, key=lambda each: each.cost)
    is_near = _is_near(estimate.T_map_base, best.T_map_base)
    if best.fits and (is_near or estimate.agrees(best.T_map_base, best.noise)):
        return estimate.fused(best.T_map_base, best.noise)
    return hold(estimate, before) if found[0].starts_well else estimate


def hold(estimate: SharpPose, before: SharpPose | None) -> SharpPose:
    """Return the sharp pose before, carried by odometry, if the filter's estimate allows it."""
    if before is None:
        return estimate
    carried = before.carried(estimate.T_odom_base)
    return carried if _agree(estimate, carried) else estimate


def _goes_on(estimate: SharpPose, carried: SharpPose, found: _Refined) -> bool:
    """Tell whether a scan continues the sharp poses before."""
    if not carried.agrees(found.T_map_base, found.noise):
        return False
    if _agree(estimate, carried):
        return found.fits
    # The filter itself has gone astray, if the scan says so.
    is_same = is_same_place(estimate.T_map_base, carried.T_map_base)
    return is_same and found.cost <= found.cost_of_estimate


def _agree(a: SharpPose, b: SharpPose) -> bool:
    return a.agrees(b.T_map_base, b.covariance)


@dataclass(frozen=True, eq=False, slots=True)
class _Refined:
    """A refinement in the map frame, and mean costs of a beam, nats."""

    T_map_base: SE2
    noise: NDArray[np.float64]
    cost: float
    cost_at_start: float
    cost_of_estimate: float

    @property
    def fits(self) -> bool:
        return self.cost <= _NO_WORSE * self.cost_of_estimate

    @property
    def starts_best(self) -> bool:
        best = min(self.cost, self.cost_of_estimate)
        return self.cost_at_start <= _NO_WORSE * best + _ALIKE

    @property
    def starts_well(self) -> bool:
        return self.cost_at_start <= _NO_WORSE * self.cost_of_estimate


@dataclass(frozen=True, eq=False, slots=True)
class _Refinement:
    """The refinement of one scan."""

    scan: LaserScan
    beams: Beams
    fields: MapFields

    def from_pose(self, start: SE2, estimate: SE2) -> _Refined:
        grid = self.fields.grid
        cells = np.array([to_cells(grid, self.scan, pose) for pose in (start, estimate)])
        poses, covariances = refine_on_rays(cells[:1], self.beams, self.fields)
        costs = verify(np.concatenate([poses, cells]), self.beams, self.fields).scores
        pose, noise = to_map(grid, self.scan, poses[0], covariances[0])
        return _Refined(pose, noise, *costs.tolist())


def _is_near(a: SE2, b: SE2) -> bool:
    turned = angle_error(a.yaw, b.yaw)
    return a.distance_to(b) <= _FARTHEST_M and bool(turned <= _FARTHEST_RAD)


def _offset(a: SE2, b: SE2) -> NDArray[np.float64]:
    offset = b.as_array() - a.as_array()
    offset[2] = wrap(offset[2])
    return offset
