"""Several places fit: which one wins while the robot moves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Hypothesis, LocateResult, Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.verdict import RIVAL_SHARE, count_rivals, log_likelihoods
from firstfix.localizer.agreement import is_new_view
from firstfix.localizer.config import MonitorConfig

# Two scans half a metre apart are half as good as two of different robots.
_NEWS = 0.5
_MOST_ENTRIES = 64
_LEAST_UNLISTED = 1e-3


class Standing(Enum):
    """How the contest stands."""

    OPEN = "open"
    WON = "won"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class Entry:
    """A place in the contest: it moves with the odometry."""

    T_map_odom: SE2
    log_weight: float
    place: Hypothesis

    def carried(self, T_odom_base: SE2) -> Entry:
        """Return the same place where the odometry has carried it."""
        return replace(self, place=replace(self.place, pose=self.T_map_odom @ T_odom_base))


class Contest:
    """Follows all places that fit, without chance, and weighs them where a scan brings news.

    A particle filter cannot do this: in places that look the same its mass wanders by chance, until
    one of them has it all (docs/decisions/0011).

    Parameters
    ----------
    places : tuple of Hypothesis
        What the scan left open; at least one.
    T_odom_base : SE2
        Odometry at that scan.
    matcher : ScanMatcher
        The static stage.
    config : MonitorConfig
        Settings.
    ids : iterator of int
        Gives every new place its number.
    """

    def __init__(
        self,
        places: tuple[Hypothesis, ...],
        T_odom_base: SE2,
        matcher: ScanMatcher,
        config: MonitorConfig,
        ids: Iterator[int],
    ) -> None:
        self._matcher = matcher
        self._config = config
        self._ids = ids
        self._looked_at = T_odom_base
        self._looks = 0
        self._misses = 0
        # That the robot is where nobody has listed it, in another building perhaps.
        unlisted = 1.0 - sum(place.probability for place in places)
        self._log_unlisted = math.log(max(unlisted, _LEAST_UNLISTED))
        self._entries: list[Entry] = []
        self._entries = self._numbered(places, T_odom_base)

    @property
    def places(self) -> tuple[Hypothesis, ...]:
        """The places at the last look, with their probabilities in the contest, best first."""
        logs = np.array([*(entry.log_weight for entry in self._entries), self._log_unlisted])
        weights = np.exp(logs - logs.max())
        shares = (weights / weights.sum())[:-1].tolist()
        ranked = sorted(zip(shares, self._entries, strict=True), key=lambda pair: -pair[0])
        return tuple(replace(entry.place, probability=share) for share, entry in ranked)

    @property
    def rivals(self) -> int:
        """Number of places that are about as likely as the best one, which is included."""
        return count_rivals(_probabilities(self.places))

    def brings_news(self, T_odom_base: SE2) -> bool:
        """Tell whether the robot has moved enough for a scan to say something new."""
        return is_new_view(self._looked_at, T_odom_base, self._config)

    def look(self, scan: LaserScan, T_odom_base: SE2) -> Standing:
        """Weigh the places by a scan, and ask whether the whole map has a better one.

        Parameters
        ----------
        scan : LaserScan
            The scan.
        T_odom_base : SE2
            Odometry at the scan.

        Returns
        -------
        Standing
            WON if the scan is UNIQUE at one of the places, or if one has nearly all of the
            probability after some looks, and fits; LOST if none of the places fits several times in
            a row, as after a kidnap, or if they have become too many; else OPEN.
        """
        self._looked_at = T_odom_base
        self._looks += 1
        self._weigh(scan, T_odom_base)
        fits = any(e.place.score <= self._config.doubtful_cost for e in self._entries)
        self._misses = 0 if fits else self._misses + 1
        if self._misses >= self._config.decided_views:
            return Standing.LOST
        result = self._matcher.locate(scan)
        if result.verdict is Verdict.UNIQUE and self._wins_outright(result.hypotheses[0]):
            return Standing.WON
        self._admit(result, T_odom_base)
        if len(self._entries) >= _MOST_ENTRIES:
            return Standing.LOST  # the right place may be one that there was no room for
        best = self.places[0]
        decided = best.probability >= self._config.decided_probability
        decided = decided and best.score <= self._config.decided_cost
        enough = self._looks >= self._config.decided_views
        return Standing.WON if decided and enough else Standing.OPEN

    def look_at_rest(self, scan: LaserScan, T_odom_base: SE2) -> Standing:
        """Search with another scan from the same place: people and hands go.

        It is no independent evidence, so nothing is weighed. A UNIQUE scan decides. Before the
        first motion a scan with other rivals replaces the list; otherwise the list and its order
        stay. Arguments as in `look`.

        Returns
        -------
        Standing
            WON or OPEN.
        """
        self._entries = [entry.carried(T_odom_base) for entry in self._entries]
        result = self._matcher.locate(scan)
        best = result.best
        if best is None or result.verdict is Verdict.NO_MATCH:
            return Standing.OPEN
        if self._looks == 0 and self._has_other_rivals(result):
            self._entries = self._numbered(result.hypotheses, T_odom_base)
        if result.verdict is Verdict.UNIQUE and self._wins_outright(best):
            return Standing.WON
        return Standing.OPEN

    def _weigh(self, scan: LaserScan, T_odom_base: SE2) -> None:
        """Multiply the weights of all places by what the scan says there, even of hopeless ones.

        Who is dropped could not be told from a place that nobody has thought of yet.
        """
        poses = [entry.T_map_odom @ T_odom_base for entry in self._entries]
        examined = self._matcher.score_poses(scan, poses)
        scores = np.array([*(place.score for place in examined), self._config.decided_cost])
        *logs, unlisted = _NEWS * log_likelihoods(scores, examined[0].evidence.beams)
        self._log_unlisted += float(unlisted)
        weighed = [
            replace(
                entry,
                T_map_odom=place.pose @ T_odom_base.inverse(),
                log_weight=entry.log_weight + float(log),
                place=replace(place, id=entry.place.id),
            )
            for entry, place, log in zip(self._entries, examined, logs, strict=True)
        ]
        weighed.sort(key=lambda entry: -entry.log_weight)
        self._entries = []
        for entry in weighed:
            if self._known(entry.place) is None:
                self._entries.append(entry)

    def _wins_outright(self, place: Hypothesis) -> bool:
        known = self._known(place)
        if known is None or place.score > self._config.decided_cost:
            return False
        self._entries = [replace(known, place=replace(place, id=known.place.id))]
        return True

    def _admit(self, result: LocateResult, T_odom_base: SE2) -> None:
        """Let in the places that the scan finds and that were not listed, as likely as it says."""
        best = result.best
        if best is None or result.verdict is Verdict.NO_MATCH:
            return
        most = max(entry.log_weight for entry in self._entries)
        for place in result.hypotheses:
            share = place.probability / best.probability
            full = len(self._entries) >= _MOST_ENTRIES
            if share >= RIVAL_SHARE and not full and self._known(place) is None:
                numbered = replace(place, id=next(self._ids))
                self._entries.append(
                    Entry(place.pose @ T_odom_base.inverse(), most + math.log(share), numbered)
                )

    def _known(self, place: Hypothesis) -> Entry | None:
        """Return the entry that is this place, if any."""
        for entry in self._entries:
            if is_same_place(entry.place.pose, place.pose):
                return entry
        return None

    def _numbered(self, places: tuple[Hypothesis, ...], T_odom_base: SE2) -> list[Entry]:
        """Make entries of places; those that are known keep their numbers."""
        entries = []
        for place in places:
            known = self._known(place)
            number = next(self._ids) if known is None else known.place.id
            log_weight = math.log(max(place.probability, 1e-9))
            T_map_odom = place.pose @ T_odom_base.inverse()
            entries.append(Entry(T_map_odom, log_weight, replace(place, id=number)))
        return entries

    def _has_other_rivals(self, result: LocateResult) -> bool:
        """Tell whether a rival has come up or vanished since the last search."""
        found = result.hypotheses[: count_rivals(_probabilities(result.hypotheses))]
        listed = self.places[: self.rivals]
        return any(self._known(place) is None for place in found) or not all(
            any(is_same_place(place.pose, other.pose) for other in result.hypotheses)
            for place in listed
        )


def _probabilities(places: tuple[Hypothesis, ...]) -> NDArray[np.float64]:
    return np.array([place.probability for place in places])
