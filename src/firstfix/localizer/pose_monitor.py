"""Is the tracked pose still right? Every scan is asked, with the static stage's evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from firstfix.core.angles import angle_error
from firstfix.core.estimate import Hypothesis, Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import FEWEST_HITS, usable_beams
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.config import WatchConfig
from firstfix.localizer.relocation import Candidates, same_place

# Another place must fit so much better that it is not the same fit, a little refined.
_BETTER = 0.75

# A robot that only slipped sees what it saw before, so the place nearby fits as well as the track
# used to, or nearly. Rooms that look somewhat alike do not.
_AS_USUAL = 1.5
_USUAL_RATE = 0.1
_GOOD_COST = 0.3
# Farther off it may as well be another place that looks the same: the whole map must be asked.
_SLIP_M = 0.7
_SLIP_RAD = math.radians(30.0)


class Finding(Enum):
    """What a scan says about the tracked pose."""

    SILENT = "silent"
    FITS = "fits"
    DOUBTFUL = "doubtful"
    ELSEWHERE = "elsewhere"
    CONTRADICTED = "contradicted"


@dataclass(frozen=True, slots=True)
class Look:
    """What came of one look.

    Parameters
    ----------
    finding : Finding
        The finding.
    place : Hypothesis
        The tracked place; with ELSEWHERE the place where the robot really is.
    """

    finding: Finding
    place: Hypothesis


class Watch:
    """Judges a track scan by scan; remembers since when it has been contradicted.

    Parameters
    ----------
    matcher : ScanMatcher
        The static stage.
    config : WatchConfig
        Settings.
    """

    def __init__(self, matcher: ScanMatcher, config: WatchConfig) -> None:
        self._matcher = matcher
        self._config = config
        self._contradicted_since: float | None = None
        self._candidates = Candidates(config)
        self._searched_at: float | None = None
        self._usual_cost = _GOOD_COST

    def look(self, scan: LaserScan, T_odom_base: SE2, T_map_base: SE2) -> Look:
        """Judge the tracked pose by a scan; in doubt look nearby, then everywhere.

        Parameters
        ----------
        scan : LaserScan
            The scan.
        T_odom_base : SE2
            Odometry at the scan.
        T_map_base : SE2
            The tracked pose at the scan.

        Returns
        -------
        Look
            The finding. ELSEWHERE needs several scans in a row that agree.
        """
        (tracked,) = self._matcher.score_poses(scan, [T_map_base])
        if np.count_nonzero(usable_beams(scan).hit) < FEWEST_HITS:
            return Look(Finding.SILENT, tracked)  # a hand before the sensor is no evidence
        if tracked.score <= self._config.doubtful_cost:
            self._contradicted_since = None
            if self._is_off(tracked.pose, T_map_base):
                # A small slip at rest: nothing else would put the track right.
                scans = self._candidates.count(tracked.pose, T_odom_base)
                if scans >= self._config.confirmations:
                    self._calm_down()
                    return Look(Finding.ELSEWHERE, tracked)
                return Look(Finding.FITS, tracked)
            self._calm_down()
            self._usual_cost += _USUAL_RATE * (tracked.score - self._usual_cost)
            return Look(Finding.FITS, tracked)
        place = self._better_place(scan, tracked, T_map_base)
        if place is not None:
            scans = self._candidates.count(place.pose, T_odom_base)
            if scans >= self._config.confirmations:
                self._calm_down()
                return Look(Finding.ELSEWHERE, place)
        if tracked.score <= self._config.impossible_cost:
            self._contradicted_since = None
        elif self._contradicted_since is None:
            self._contradicted_since = scan.stamp
        elif scan.stamp - self._contradicted_since >= self._config.lost_after_s:
            return Look(Finding.CONTRADICTED, tracked)
        return Look(Finding.DOUBTFUL, tracked)

    def _better_place(
        self, scan: LaserScan, tracked: Hypothesis, T_map_base: SE2
    ) -> Hypothesis | None:
        near = self._matcher.search_locally(scan, T_map_base)
        as_usual = max(_GOOD_COST, _AS_USUAL * self._usual_cost)
        fits = near.score <= min(as_usual, self._config.doubtful_cost, _BETTER * tracked.score)
        off = T_map_base.inverse() @ near.pose
        if fits and math.hypot(off.x, off.y) <= _SLIP_M and abs(off.yaw) <= _SLIP_RAD:
            return near
        if tracked.score <= self._config.impossible_cost:
            return None  # most of the scan fits here: people, or the edge of the map
        if self._searched_at is not None:
            waited = scan.stamp - self._searched_at
            if 0.0 <= waited < self._config.search_period_s:
                return None
        self._searched_at = scan.stamp
        result = self._matcher.locate(scan)
        best = result.best
        if best is None or best.score > self._config.doubtful_cost:
            self._candidates.clear()
            return None
        if same_place(best.pose, T_map_base, self._config):  # nowhere does it fit better
            self._calm_down()
            return None
        fits_well = best.score <= min(self._config.won_cost, _BETTER * tracked.score)
        if result.verdict is Verdict.UNIQUE and fits_well:
            return best
        self._candidates.clear()
        return None

    def _is_off(self, a: SE2, b: SE2) -> bool:
        far = a.distance_to(b) > self._config.off_m
        return far or angle_error(a.yaw, b.yaw) > self._config.off_rad

    def _calm_down(self) -> None:
        self._contradicted_since = None
        self._candidates.clear()
