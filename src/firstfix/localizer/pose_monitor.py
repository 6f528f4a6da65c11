"""Is the tracked pose still right? Every scan is compared with the map there."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import angle_error, wrap
from firstfix.core.estimate import Hypothesis, Verdict
from firstfix.core.scan import LaserScan, Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.prior import SHARE_OF_SMALL_VIEW, SHARE_WITHOUT_PRIOR
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.sensors import joint_beams, see_enough
from firstfix.localizer.agreement import AgreementCounter
from firstfix.localizer.config import MonitorConfig

# Another place must fit so much better that it is not the same fit, a little refined.
_BETTER = 0.75

# After a slip the robot sees what it saw before, so the place nearby fits nearly as well as the
# tracked pose used to. Rooms that look somewhat alike do not.
_AS_USUAL = 1.5
_USUAL_RATE = 0.1
_GOOD_COST = 0.3
# A fit that is worse than usual by this much, nats, has not become worse by a few more people.
_SUDDEN_COST = 0.5
# A place farther away may be another one that looks the same: the whole map must be searched.
_SLIP_M = 0.7
_SLIP_RAD = math.radians(30.0)

# Odometry drifts less than this in the few seconds in which people hide the walls.
_LEAP_M = 0.25
_LEAP_RAD = math.radians(10.0)

# A pose that is off by less than the filter itself allows for is not corrected: along a corridor
# the best pose of one scan follows people. 99 % of a chi-square distribution with 3 degrees of
# freedom; to the covariance of the filter, the noise of one scan in an imperfect map.
_SURPRISING = 11.3
_SCAN_NOISE = np.diag([0.03**2, 0.03**2, math.radians(1.0) ** 2])


class Fit(Enum):
    """How a scan fits the tracked pose."""

    UNINFORMATIVE = "uninformative"
    CONSISTENT = "consistent"
    DOUBTFUL = "doubtful"
    ELSEWHERE = "elsewhere"
    CONTRADICTED = "contradicted"


@dataclass(frozen=True, slots=True)
class Judgement:
    """The result for one scan.

    Parameters
    ----------
    fit : Fit
        How the scan fits.
    place : Hypothesis
        The tracked place; with ELSEWHERE the place where the robot really is.
    is_sudden : bool
        True if the scans before fitted much better.
    has_jumped : bool
        True if the very scan before did.
    """

    fit: Fit
    place: Hypothesis
    is_sudden: bool = False
    has_jumped: bool = False


class PoseMonitor:
    """Judges the tracked pose scan by scan, and records since when it has been contradicted.

    Parameters
    ----------
    matcher : ScanMatcher
        Global localization on the map in use.
    config : MonitorConfig
        Settings.
    """

    def __init__(self, matcher: ScanMatcher, config: MonitorConfig) -> None:
        self._matcher = matcher
        self._config = config
        self._contradicted_since: float | None = None
        self._suspected_since: float | None = None  # a contradiction, not yet resolved
        self._has_leapt = False  # since then
        self._T_map_odom: SE2 | None = None  # at the last consistent scan before it
        self._agreement = AgreementCounter()
        self._searched_at: float | None = None
        self._usual_cost = _GOOD_COST
        self._last_cost: float | None = None

    def judge(
        self,
        scans: Scans,
        T_odom_base: SE2,
        T_map_base: SE2,
        covariance: NDArray[np.float64] | None = None,
        tracked: Hypothesis | None = None,
    ) -> Judgement:
        """Judge the tracked pose by a scan; in doubt search nearby, then everywhere.

        Parameters
        ----------
        scans : LaserScan or sequence of LaserScan
            The scan, or one of each sensor.
        T_odom_base : SE2
            Odometry at the scan.
        T_map_base : SE2
            The tracked pose at the scan.
        covariance : ndarray, shape (3, 3), optional
            Of it: x (m), y (m), yaw (rad) in the map frame. None if the pose is exact.
        tracked : Hypothesis, optional
            The pose, scored by the scan. None scores it.

        Returns
        -------
        Judgement
            UNINFORMATIVE if the sensor sees too little, as when it is covered. ELSEWHERE needs
            several consecutive scans that agree. CONTRADICTED needs `lost_after_s`, or a leap to
            one of several places that look the same: a slip, or a kidnap to a similar place.
        """
        scans = as_scans(scans)
        if tracked is None:
            (tracked,) = self._matcher.score_poses(scans, [T_map_base])
        before, self._last_cost = self._last_cost, tracked.score
        judgement = self._judge(scans, tracked, T_odom_base, T_map_base, covariance)
        has_jumped = before is not None and tracked.score - before > _SUDDEN_COST
        return replace(judgement, has_jumped=has_jumped)

    def _judge(
        self,
        scans: tuple[LaserScan, ...],
        tracked: Hypothesis,
        T_odom_base: SE2,
        T_map_base: SE2,
        covariance: NDArray[np.float64] | None,
    ) -> Judgement:
        if np.count_nonzero(joint_beams(scans)[1].hit) < FEWEST_HITS:
            return Judgement(Fit.UNINFORMATIVE, tracked)
        stamp = max(scan.stamp for scan in scans)
        if tracked.score <= self._config.doubtful_cost:
            self._contradicted_since = None
            if self._suspected_since is not None:
                return self._judge_suspected(scans, tracked, T_odom_base, T_map_base)
            self._T_map_odom = T_map_base @ T_odom_base.inverse()
            noise = _SCAN_NOISE if covariance is None else covariance + _SCAN_NOISE
            return self._judge_consistent(tracked, T_odom_base, T_map_base, noise)
        if tracked.score > self._config.contradiction_cost and self._suspected_since is None:
            self._suspected_since = stamp
        place = self._better_place(scans, tracked, T_map_base)
        if place is not None and self._is_confirmed(place, T_odom_base):
            if not is_slip(T_map_base, place.pose) or self._may_follow(scans, place, T_odom_base):
                self._withdraw_doubt()
                return Judgement(Fit.ELSEWHERE, place)
            self._agreement.clear()
            if self._suspected_since is not None:
                return Judgement(Fit.CONTRADICTED, tracked)
        if tracked.score <= self._config.contradiction_cost:
            self._contradicted_since = None
        elif self._contradicted_since is None:
            self._contradicted_since = stamp
        elif stamp - self._contradicted_since >= self._config.lost_after_s:
            return Judgement(Fit.CONTRADICTED, tracked)
        return Judgement(Fit.DOUBTFUL, tracked, is_sudden=self._is_sudden(tracked))

    def _judge_consistent(
        self,
        tracked: Hypothesis,
        T_odom_base: SE2,
        T_map_base: SE2,
        noise: NDArray[np.float64],
    ) -> Judgement:
        if self._is_off(tracked.pose, T_map_base, noise):
            # A small slip at rest: nothing else would correct the pose.
            if self._is_confirmed(tracked, T_odom_base):
                self._withdraw_doubt()
                return Judgement(Fit.ELSEWHERE, tracked)
            return Judgement(Fit.CONSISTENT, tracked)
        self._agreement.clear()
        is_sudden = self._is_sudden(tracked)
        self._usual_cost += _USUAL_RATE * (tracked.score - self._usual_cost)
        return Judgement(Fit.CONSISTENT, tracked, is_sudden=is_sudden)

    def _is_sudden(self, tracked: Hypothesis) -> bool:
        return tracked.score - self._usual_cost > _SUDDEN_COST

    def _is_confirmed(self, place: Hypothesis, T_odom_base: SE2) -> bool:
        return self._agreement.count(place.pose, T_odom_base) >= self._config.confirmations

    def _better_place(
        self, scans: tuple[LaserScan, ...], tracked: Hypothesis, T_map_base: SE2
    ) -> Hypothesis | None:
        near = self._matcher.search_locally(scans, T_map_base)
        as_usual = max(_GOOD_COST, _AS_USUAL * self._usual_cost)
        fits = near.score <= min(as_usual, self._config.doubtful_cost, _BETTER * tracked.score)
        if fits and is_slip(T_map_base, near.pose):
            return near
        if tracked.score <= self._config.contradiction_cost:
            return None  # most of the scan fits here: people, or the edge of the map
        stamp = max(scan.stamp for scan in scans)
        if self._searched_at is not None:
            waited = stamp - self._searched_at
            if 0.0 <= waited < self._config.search_period_s:
                return None
        self._searched_at = stamp
        result = self._matcher.locate(scans)
        best = result.best
        if best is None or best.score > self._config.doubtful_cost:
            self._agreement.clear()
            return None
        if is_same_place(best.pose, T_map_base):  # no other place fits better
            self._withdraw_doubt()
            return None
        fits_well = best.score <= min(self._config.decided_cost, _BETTER * tracked.score)
        if result.verdict is Verdict.UNIQUE and fits_well:
            return best
        self._agreement.clear()
        return None

    def _judge_suspected(
        self, scans: tuple[LaserScan, ...], tracked: Hypothesis, T_odom_base: SE2, T_map_base: SE2
    ) -> Judgement:
        """Judge a pose that fits again after a contradiction, at the end of `lost_after_s`.

        Particles near the old pose find a place that looks like where the robot was carried to.
        """
        assert self._suspected_since is not None  # noqa: S101 - by the caller
        self._agreement.clear()
        stamp = max(scan.stamp for scan in scans)
        waited, period = stamp - self._suspected_since, self._config.lost_after_s
        if waited <= 2.0 * period:  # later, odometry may have drifted as far
            self._has_leapt |= self._leaps(T_map_base, T_odom_base)
        if 0.0 <= waited < period:
            return Judgement(Fit.CONSISTENT, tracked, is_sudden=self._is_sudden(tracked))
        has_leapt, self._has_leapt, self._suspected_since = self._has_leapt, False, None
        if has_leapt and not self._is_alone(scans, T_map_base):
            return Judgement(Fit.CONTRADICTED, tracked)
        return Judgement(Fit.CONSISTENT, tracked)

    def _may_follow(
        self, scans: tuple[LaserScan, ...], place: Hypothesis, T_odom_base: SE2
    ) -> bool:
        """Return whether a better place nearby is where the wheels slipped to.

        It may also be one of several that look like the place to which the robot was carried.
        """
        if self._T_map_odom is None:
            return True
        is_same = is_same_place(self._T_map_odom @ T_odom_base, place.pose)
        has_leapt = self._suspected_since is not None and self._leaps(place.pose, T_odom_base)
        return (is_same and not has_leapt) or self._is_alone(scans, place.pose)

    def _leaps(self, T_map_base: SE2, T_odom_base: SE2) -> bool:
        """Return whether a pose is not where odometry goes on from the last consistent scan."""
        if self._T_map_odom is None:
            return False
        off = (self._T_map_odom @ T_odom_base).inverse() @ T_map_base
        return math.hypot(off.x, off.y) > _LEAP_M or abs(off.yaw) > _LEAP_RAD

    def _is_alone(self, scans: tuple[LaserScan, ...], T_map_base: SE2) -> bool:
        """Return whether the scan alone finds this place, and no other as likely."""
        best = self._matcher.locate(scans).best
        if best is None or not is_same_place(best.pose, T_map_base):
            return False
        return best.probability >= (
            SHARE_WITHOUT_PRIOR if see_enough(scans) else SHARE_OF_SMALL_VIEW
        )

    def _is_off(self, a: SE2, b: SE2, noise: NDArray[np.float64]) -> bool:
        far = a.distance_to(b) > self._config.correct_m
        if not far and angle_error(a.yaw, b.yaw) <= self._config.correct_rad:
            return False
        offset = a.as_array() - b.as_array()
        offset[2] = wrap(offset[2])
        return bool(offset @ np.linalg.solve(noise, offset) > _SURPRISING)

    def _withdraw_doubt(self) -> None:
        self._contradicted_since = None
        self._agreement.clear()


def is_slip(a: SE2, b: SE2) -> bool:
    """Tell whether wheels may have slipped from one pose to the other."""
    off = a.inverse() @ b
    return math.hypot(off.x, off.y) <= _SLIP_M and abs(off.yaw) <= _SLIP_RAD
