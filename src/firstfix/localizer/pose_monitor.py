"""Is the tracked pose still right? Every scan is compared with the map there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from firstfix.core.angles import angle_error
from firstfix.core.estimate import Hypothesis, Verdict
from firstfix.core.scan import LaserScan, Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.sensors import joint_beams
from firstfix.localizer.agreement import AgreementCounter
from firstfix.localizer.config import MonitorConfig

# Another place must fit so much better that it is not the same fit, a little refined.
_BETTER = 0.75

# After a slip the robot sees what it saw before, so the place nearby fits nearly as well as the
# tracked pose used to. Rooms that look somewhat alike do not.
_AS_USUAL = 1.5
_USUAL_RATE = 0.1
_GOOD_COST = 0.3
# A place farther away may be another one that looks the same: the whole map must be searched.
_SLIP_M = 0.7
_SLIP_RAD = math.radians(30.0)


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
    """

    fit: Fit
    place: Hypothesis


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
        self._agreement = AgreementCounter()
        self._searched_at: float | None = None
        self._usual_cost = _GOOD_COST

    def judge(self, scans: Scans, T_odom_base: SE2, T_map_base: SE2) -> Judgement:
        """Judge the tracked pose by a scan; in doubt search nearby, then everywhere.

        Parameters
        ----------
        scans : LaserScan or sequence of LaserScan
            The scan, or one of each sensor.
        T_odom_base : SE2
            Odometry at the scan.
        T_map_base : SE2
            The tracked pose at the scan.

        Returns
        -------
        Judgement
            UNINFORMATIVE if the sensor sees too little, as when it is covered. ELSEWHERE needs
            several consecutive scans that agree, CONTRADICTED needs `lost_after_s`.
        """
        scans = as_scans(scans)
        (tracked,) = self._matcher.score_poses(scans, [T_map_base])
        if np.count_nonzero(joint_beams(scans)[1].hit) < FEWEST_HITS:
            return Judgement(Fit.UNINFORMATIVE, tracked)
        if tracked.score <= self._config.doubtful_cost:
            return self._judge_consistent(tracked, T_odom_base, T_map_base)
        place = self._better_place(scans, tracked, T_map_base)
        if place is not None and self._is_confirmed(place, T_odom_base):
            return Judgement(Fit.ELSEWHERE, place)
        stamp = max(scan.stamp for scan in scans)
        if tracked.score <= self._config.contradiction_cost:
            self._contradicted_since = None
        elif self._contradicted_since is None:
            self._contradicted_since = stamp
        elif stamp - self._contradicted_since >= self._config.lost_after_s:
            return Judgement(Fit.CONTRADICTED, tracked)
        return Judgement(Fit.DOUBTFUL, tracked)

    def _judge_consistent(
        self, tracked: Hypothesis, T_odom_base: SE2, T_map_base: SE2
    ) -> Judgement:
        self._contradicted_since = None
        if self._is_off(tracked.pose, T_map_base):
            # A small slip at rest: nothing else would correct the pose.
            confirmed = self._is_confirmed(tracked, T_odom_base)
            return Judgement(Fit.ELSEWHERE if confirmed else Fit.CONSISTENT, tracked)
        self._agreement.clear()
        self._usual_cost += _USUAL_RATE * (tracked.score - self._usual_cost)
        return Judgement(Fit.CONSISTENT, tracked)

    def _is_confirmed(self, place: Hypothesis, T_odom_base: SE2) -> bool:
        if self._agreement.count(place.pose, T_odom_base) < self._config.confirmations:
            return False
        self._withdraw_doubt()
        return True

    def _better_place(
        self, scans: tuple[LaserScan, ...], tracked: Hypothesis, T_map_base: SE2
    ) -> Hypothesis | None:
        near = self._matcher.search_locally(scans, T_map_base)
        as_usual = max(_GOOD_COST, _AS_USUAL * self._usual_cost)
        fits = near.score <= min(as_usual, self._config.doubtful_cost, _BETTER * tracked.score)
        off = T_map_base.inverse() @ near.pose
        if fits and math.hypot(off.x, off.y) <= _SLIP_M and abs(off.yaw) <= _SLIP_RAD:
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

    def _is_off(self, a: SE2, b: SE2) -> bool:
        far = a.distance_to(b) > self._config.correct_m
        return far or angle_error(a.yaw, b.yaw) > self._config.correct_rad

    def _withdraw_doubt(self) -> None:
        self._contradicted_since = None
        self._agreement.clear()
