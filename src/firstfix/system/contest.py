"""Several places fit: which one wins while the robot moves."""

from __future__ import annotations

import math
from enum import Enum

from firstfix.amcl.clusters import Cluster
from firstfix.core.estimate import Hypothesis, LocateResult, Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.locate import Locator
from firstfix.system.config import WatchConfig
from firstfix.system.watch import same_place

# A cluster with less of the belief than this is not there.
_SOME_MASS = 0.01
_LIKELY = 0.5


class Standing(Enum):
    """How the contest stands after a look."""

    OPEN = "open"
    WON = "won"
    LOST = "lost"


class Contest:
    """Watches a belief over several places; looks again only where a scan brings news.

    Parameters
    ----------
    locator : Locator
        The static stage.
    config : WatchConfig
        Settings.
    """

    def __init__(self, locator: Locator, config: WatchConfig) -> None:
        self._locator = locator
        self._config = config
        self._looked_at: SE2 | None = None
        self._wins = 0
        self._misses = 0
        self.result: LocateResult | None = None

    def look(
        self, scan: LaserScan, T_odom_base: SE2, clusters: tuple[Cluster, ...]
    ) -> tuple[Standing, Hypothesis | None]:
        """Compare the places of the belief with what the next scan says of the whole map.

        A place wins if a scan is UNIQUE there and the belief knows it, or if it has nearly all of
        the belief and is the likeliest place of the map several times, each time seen from
        somewhere else. A particle filter alone must not decide: its likelihoods are not independent
        from scan to scan, and chance alone moves its mass between places that look the same.

        Parameters
        ----------
        scan : LaserScan
            The scan.
        T_odom_base : SE2
            Odometry at the scan.
        clusters : tuple of Cluster
            The belief, heaviest first, poses at the scan.

        Returns
        -------
        tuple of Standing and (Hypothesis or None)
            WON with the place; LOST if three looks in a row know of no place of the belief; else
            OPEN.
        """
        if not self._brings_news(T_odom_base):
            self.result = None
            return Standing.OPEN, None
        self._looked_at = T_odom_base
        self.result = self._locator.locate(scan)
        best = self.result.best
        if best is None or self.result.verdict is Verdict.NO_MATCH:
            return Standing.OPEN, None
        known = [
            cluster
            for cluster in clusters
            if cluster.mass >= _SOME_MASS and same_place(cluster.pose, best.pose, self._config)
        ]
        if known and self.result.verdict is Verdict.UNIQUE:
            return Standing.WON, best
        top = bool(known) and known[0] is clusters[0]
        likely = top and best.probability >= _LIKELY and known[0].mass >= self._config.won_mass
        self._wins = self._wins + 1 if likely else 0
        if self._wins >= self._config.won_looks:
            return Standing.WON, best
        listed = any(
            same_place(cluster.pose, place.pose, self._config)
            for cluster in clusters
            for place in self.result.hypotheses
        )
        self._misses = 0 if listed and not self._is_unique_elsewhere() else self._misses + 1
        return (Standing.LOST if self._misses >= self._config.won_looks else Standing.OPEN), None

    def _is_unique_elsewhere(self) -> bool:
        # A UNIQUE place that the belief knows would have won above.
        return self.result is not None and self.result.verdict is Verdict.UNIQUE

    def _brings_news(self, T_odom_base: SE2) -> bool:
        if self._looked_at is None:
            return True
        moved = self._looked_at.inverse() @ T_odom_base
        far = math.hypot(moved.x, moved.y) >= self._config.look_again_m
        return far or abs(moved.yaw) >= self._config.look_again_rad
