"""The default method: search, refine, verify, judge."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.scan import LaserScan
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS, Beams
from firstfix.global_localization.config import LocateConfig
from firstfix.global_localization.lead import RIVALS, leads_without_its_best_part, part_costs
from firstfix.global_localization.look import find_places
from firstfix.global_localization.places import distinct_places
from firstfix.global_localization.prior import (
    SHARE_OF_SMALL_VIEW,
    SHARE_WITHOUT_PRIOR,
    PlacePrior,
    Prior,
)
from firstfix.global_localization.refine import refine_on_field, refine_on_rays
from firstfix.global_localization.sensors import are_surrounded, joint_beams, see_enough
from firstfix.global_localization.verdict import (
    DIFFERS_IN_LITTLE,
    RIVAL_SHARE,
    SEES_TOO_LITTLE,
    exponent_of,
    judge,
    log_likelihoods,
    nothing_to_match,
    place_probabilities,
)
from firstfix.global_localization.verify import Verification, verified_place, verify

# A third of the beams rejects most places; all beams rank the rest.
FIRST_LOOK_BEAMS = 60
SECOND_LOOK_PLACES = 48

# This many places are listed however unlikely, and all that are a hundredth as likely as the best.
LISTED_PLACES = 10
_LISTED_SHARE = 0.01

# A small view that looks to all sides errs more often in a wrong map: it needs ten times the odds.
SURE_OF_SMALL_VIEW = 0.995


def locate(
    scans: Sequence[LaserScan],
    fields: MapFields,
    config: LocateConfig,
    prior: Prior | None = None,
) -> LocateResult:
    """Search, refine, verify, judge.

    Parameters
    ----------
    scans : sequence of LaserScan
        One of each sensor, with its pose on the robot.
    fields : MapFields
        The prepared map.
    config : LocateConfig
        Settings.
    prior : Prior, optional
        Of the pose of the base in the map.

    Returns
    -------
    LocateResult
        Verdict and ranked hypotheses for ``T_map_base``.
    """
    started = time.perf_counter()
    scan, beams = joint_beams(scans)
    hits = int(np.count_nonzero(beams.hit))
    if hits < FEWEST_HITS:
        return nothing_to_match(
            sum(map(len, scans)), hits, FEWEST_HITS, time.perf_counter() - started
        )
    known = PlacePrior(prior, fields.grid, scan, exponent_of(beams))

    depth = known.depth(config.shortlist)
    candidates, report = find_places(beams, fields, depth, config.max_poses)
    poses = refine_on_field(known.chosen(candidates.poses, config.shortlist), beams, fields)
    poses = _best_of(poses, beams, fields, known, config)
    places = _refined(poses, beams, fields, known, config)
    verdict, reason = _judge(places, scans, beams, fields, known, config)
    verdict, reason = _unless_unsearched(verdict, reason, report)

    hypotheses = places.hypotheses(fields, scan)
    result = LocateResult(verdict, reason, hypotheses, report, 0.0, scans=tuple(scans))
    if prior is not None:
        needed = SHARE_WITHOUT_PRIOR if see_enough(scans) else SHARE_OF_SMALL_VIEW
        result = _with_share_of_prior(result, *places.by_scan_alone(known.exponent), needed)
    return replace(result, elapsed_s=time.perf_counter() - started)


@dataclass(frozen=True, eq=False, slots=True)
class _Places:
    """Refined and verified poses, shape (n, 3), of which some are separate places.

    Parameters
    ----------
    verification : Verification
        Of all poses.
    covariances : ndarray, shape (n, 3, 3)
        Of the poses.
    ranked : ndarray of int, shape (k,)
        The separate places, most likely first by scan and prior.
    by_scan : ndarray of int, shape (m,)
        The separate places, most likely first by the scan alone.
    probabilities : ndarray, shape (k,)
        Of the ranked places.
    """

    verification: Verification
    covariances: NDArray[np.float64]
    ranked: NDArray[np.int64]
    by_scan: NDArray[np.int64]
    probabilities: NDArray[np.float64]

    @property
    def poses(self) -> NDArray[np.float64]:
        """Poses of the sensor in the grid of the ranked places, shape (k, 3)."""
        return self.verification.poses[self.ranked]

    def hypotheses(self, fields: MapFields, scan: LaserScan) -> tuple[Hypothesis, ...]:
        """Return the ranked places as poses of the base in the map frame."""
        return tuple(
            verified_place(
                fields.grid, scan, self.verification, i, self.covariances[i], probability
            )
            for i, probability in zip(
                self.ranked.tolist(), self.probabilities.tolist(), strict=True
            )
        )

    def by_scan_alone(self, exponent: float) -> tuple[float, float]:
        """Return, by the scan alone, the probability of its best place, and the ratio to it.

        The ratio is the likelihood of the best place by scan and prior over that of this one.
        """
        scores = self.verification.scores
        alone = place_probabilities(scores[self.by_scan], exponent)
        logs = log_likelihoods(scores[[self.ranked[0], self.by_scan[0]]], exponent)
        return float(alone[0]), float(np.exp(logs[0] - logs[1]))


def _best_of(
    poses: NDArray[np.float64],
    beams: Beams,
    fields: MapFields,
    known: PlacePrior,
    config: LocateConfig,
) -> NDArray[np.float64]:
    """Keep the separate places that are worth listing by some, then by all beams."""
    resolution = fields.grid.resolution
    first_look = verify(poses, beams.thinned(FIRST_LOOK_BEAMS), fields)
    best = [
        distinct_places(poses, scores, resolution, SECOND_LOOK_PLACES)
        for scores in known.rankings(first_look)
    ]
    second_look = verify(poses[_united(best)], beams, fields)
    best = []
    for scores in known.rankings(second_look):
        ranked = distinct_places(second_look.poses, scores, resolution, config.hypotheses)
        best.append(ranked[: worth_listing(scores[ranked], known.exponent)])
    kept: NDArray[np.float64] = second_look.poses[_united(best)]
    return kept


def _refined(
    poses: NDArray[np.float64],
    beams: Beams,
    fields: MapFields,
    known: PlacePrior,
    config: LocateConfig,
) -> _Places:
    """Refine poses on rays, and rank them again."""
    on_rays, covariances = refine_on_rays(poses, beams, fields)
    # Rays are more precise, but worse in a map with smeared walls: keep the better pose of the two.
    verification = verify(np.concatenate([on_rays, poses]), beams, fields)
    weighed = known.rankings(verification)[0]
    ranked, by_scan = (
        distinct_places(verification.poses, scores, fields.grid.resolution, config.hypotheses)
        for scores in (weighed, verification.scores)
    )
    return _Places(
        verification,
        np.concatenate([covariances, covariances]),
        ranked,
        by_scan,
        place_probabilities(weighed[ranked], known.exponent),
    )


def _judge(
    places: _Places,
    scans: Sequence[LaserScan],
    beams: Beams,
    fields: MapFields,
    known: PlacePrior,
    config: LocateConfig,
) -> tuple[Verdict, str]:
    """Decide by the law of costs; what a single scan cannot decide needs a prior that agrees."""
    evidence = places.verification.evidence(int(places.ranked[0]))
    verdict, reason = judge(places.probabilities, evidence, config.unique_probability)
    if verdict is not Verdict.UNIQUE or known.speaks_for(places.poses[0]):
        return verdict, reason
    doubt = doubt_of_one_scan(scans, places.poses, places.probabilities, beams, fields)
    return (Verdict.AMBIGUOUS, f"{reason}, {doubt}") if doubt else (verdict, reason)


def doubt_of_one_scan(
    scans: Sequence[LaserScan],
    poses: NDArray[np.float64],
    probabilities: NDArray[np.float64],
    beams: Beams,
    fields: MapFields,
) -> str:
    """Return why a scan must not decide by itself, whatever the law of costs says, or nothing.

    Parameters
    ----------
    scans : sequence of LaserScan
        One of each sensor.
    poses : ndarray, shape (k, 3)
        x, y (cells), heading (rad) of the sensor in the grid at separate places, best first.
    probabilities : ndarray, shape (k,)
        Of the places.
    beams : Beams
        The valid beams of the scans.
    fields : MapFields
        The prepared map.
    """
    is_sure = bool(probabilities[0] >= SURE_OF_SMALL_VIEW)
    if not see_enough(scans) and not (are_surrounded(scans) and is_sure):
        return SEES_TOO_LITTLE
    if not leads_without_its_best_part(part_costs(poses[:RIVALS], beams, fields)):
        return DIFFERS_IN_LITTLE
    return ""


def _unless_unsearched(verdict: Verdict, reason: str, report: SearchReport) -> tuple[Verdict, str]:
    """Decide nothing if a part of the map, where a better place may be, was not searched."""
    if report.searched == 1.0:
        return verdict, reason
    unseen = f"; max_poses left {1.0 - report.searched:.0%} of the map unsearched"
    return (Verdict.AMBIGUOUS if verdict is Verdict.UNIQUE else verdict), reason + unseen


def _with_share_of_prior(
    result: LocateResult, favourite: float, ratio: float, needed: float
) -> LocateResult:
    """State how likely the best place is by the scan alone; a prior decides nothing by itself.

    A prior chooses among places that the scan cannot tell apart. If it is wrong, it chooses a place
    that looks like the true one.

    Parameters
    ----------
    result : LocateResult
        By scan and prior.
    favourite : float
        Probability of the best place by the scan alone.
    ratio : float
        Likelihood of the best place of the result against that one, by the scan alone.
    needed : float
        Least probability by the scan alone for UNIQUE.
    """
    alone, both = favourite * ratio, result.hypotheses[0].probability
    reason = f"{result.reason}; {alone:.0%} likely by the scan alone, {both:.0%} with the prior"
    verdict = result.verdict
    if verdict is Verdict.UNIQUE and alone < needed:
        verdict = Verdict.AMBIGUOUS
        reason = (
            f"the prior chooses this place ({both:.0%} likely with it, {alone:.0%} by the scan "
            "alone): a second view can confirm it"
        )
        if ratio < RIVAL_SHARE:
            reason = f"the scan fits {1.0 / ratio:.0f} times better elsewhere than near the prior"
    return replace(result, verdict=verdict, reason=reason, probability_without_prior=alone)


def worth_listing(scores: NDArray[np.float64], exponent: float) -> int:
    """Return how many of some ranked places a result should list.

    Parameters
    ----------
    scores : ndarray, shape (n,)
        Mean cost of a beam at each place, best first, nats.
    exponent : float
        Of the law of costs for the scan.

    Returns
    -------
    int
        `LISTED_PLACES`, or more if more are a hundredth as likely as the best.
    """
    probabilities = place_probabilities(scores, exponent)
    return max(
        LISTED_PLACES, int(np.count_nonzero(probabilities >= _LISTED_SHARE * probabilities[0]))
    )


def _united(rankings: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Return the indices of all rankings, in the order of the first one where it is the only."""
    return rankings[0] if len(rankings) == 1 else np.unique(np.concatenate(rankings))
